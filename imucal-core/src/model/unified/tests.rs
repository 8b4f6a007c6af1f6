use super::*;
use crate::{
    model::rig::{Axis, ReferencePose, RigAxes},
    rotation::quaternion,
    solver::jacobian_check::largest_jacobian_error,
};
use proptest::prelude::*;

const AXES: RigAxes = RigAxes([Axis::Z, Axis::Y, Axis::X]);

proptest! {
    #[test]
    fn the_analytic_jacobian_is_the_numerical_one(
        noise in prop::collection::vec(-0.05f64..0.05, UNIFIED),
        angles in prop::array::uniform3(-3.0f64..3.0),
    ) {
        let poses = [GimbalPose::new(Vector3::new(0.1, 0.2, -0.3), &Vector3::from(angles))];
        let start = UnifiedParameters::nominal(Vector3::new(0.2, 0.1, -1.0));
        let base = UnifiedParameters::from_vector(&(start.to_vector() + SVector::from_column_slice(&noise)));
        let terms = Terms::new(core::array::from_fn::<u8, UNIFIED, _>(|k| k as u8));
        let model = UnifiedModel { poses: &poses, axes: AXES, base, terms, held: 0 };
        prop_assert!(largest_jacobian_error(&model, &terms.theta(&base)) < 1e-8);
    }
}

#[test]
fn a_reference_s_attitude_is_as_good_as_the_angles_it_follows_from() {
    let gimbals = GimbalPose::new(Vector3::new(0.1, 0.2, -0.3), &Vector3::new(0.4, -1.1, 2.3));
    let c_t_p = gimbals.rotations(&AXES).c_p_t.transpose();
    let pose = ReferencePose { value: gimbals.value, attitude: quaternion(&c_t_p) };
    let base = UnifiedParameters::nominal(Vector3::new(0.2, 0.1, -1.0));
    assert!((base.predict(&pose.rotations(&())) - base.predict(&gimbals.rotations(&AXES))).norm() < 1e-15);
    // Without gimbals there is nothing that their sources could do.
    let poses = [pose];
    let terms = Terms::new(core::array::from_fn::<u8, UNIFIED, _>(|k| k as u8));
    let model = UnifiedModel { poses: &poses, axes: (), base, terms, held: 0 };
    let (_, by) = model.jacobian(&base, &pose.rotations(&()), &Tilt::new(base.tilt));
    assert_eq!(by.fixed_columns::<6>(17).amax(), 0.0);
    assert!(largest_jacobian_error(&model, &terms.theta(&base)) < 1e-8);
}

/// Residuals and rows, as a solver is given them.
#[derive(Default)]
struct Rows<const JACOBIAN: bool>(std::vec::Vec<(f64, SVector<f64, UNIFIED>)>);

impl<const JACOBIAN: bool> RowSink<f64, UNIFIED> for Rows<JACOBIAN> {
    const JACOBIAN: bool = JACOBIAN;

    fn row(&mut self, residual: f64, jacobian: &SVector<f64, UNIFIED>) {
        self.0.push((residual, *jacobian));
    }
}

#[test]
fn residuals_are_the_same_without_a_jacobian() {
    let poses = [GimbalPose::new(Vector3::new(0.1, 0.2, -0.3), &Vector3::new(0.4, -1.1, 2.3))];
    let base = UnifiedParameters::nominal(Vector3::new(0.2, 0.1, -1.0));
    let terms = Terms::new(core::array::from_fn::<u8, UNIFIED, _>(|k| k as u8));
    let held = 5;
    let model = UnifiedModel { poses: &poses, axes: AXES, base, terms, held: 1 << held };
    let mut theta = terms.theta(&base);
    theta[held] += 0.01;
    let (mut with, mut without) = (Rows::<true>::default(), Rows::<false>::default());
    model.rows(&theta, &mut with);
    model.rows(&theta, &mut without);
    assert_eq!((with.0.len(), without.0.len()), (4, 4));
    for ((one, _), (other, _)) in with.0.iter().zip(&without.0) {
        assert!((one - other).abs() < 1e-15, "{one} {other}");
    }
    let output = UnifiedParameters::from_vector(&theta).predict(&poses[0].rotations(&AXES));
    for axis in 0..3 {
        assert!((with.0[axis].0 - (output - poses[0].value)[axis]).abs() < 1e-15);
        assert_eq!(with.0[axis].1[held], 0.0);
    }
    assert!((with.0[3].0 - 0.01).abs() < 1e-15);
    let own = SVector::<f64, UNIFIED>::from_fn(|k, _| f64::from(u8::from(k == held)));
    assert_eq!(with.0[3].1, own);
}

#[test]
fn a_tilted_base_shows_gravity_as_the_paper_s_reconstruction_has_it() {
    let g = 9.8;
    let mut parameters = UnifiedParameters::nominal(Vector3::new(0.0, 0.0, -g));
    let (alpha, beta) = (0.02f64, -0.01f64);
    parameters.tilt = [alpha, beta];
    let level = GimbalPose::new(Vector3::zeros(), &Vector3::zeros()).rotations(&AXES);
    let expected = Vector3::new(g * beta.sin(), -g * beta.cos() * alpha.sin(), -g * beta.cos() * alpha.cos());
    assert!((parameters.predict(&level) - expected).norm() < 1e-14);
}

#[test]
fn all_entries_come_back_from_their_row() {
    let row = SVector::<f64, UNIFIED>::from_fn(|k, _| k as f64);
    assert_eq!(UnifiedParameters::from_vector(&row).to_vector(), row);
}

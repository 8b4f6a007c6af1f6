//! What the residual of a fit to known attitudes could follow: columns for [`crate::calibrate::fit::score_test`].
//!
//! ```text
//! m = y + q∘y² + c∘y³ + …,   y = K v                     (imucal_core::model::unified)
//! z = ∂m/∂p d φ        d = e_j for b, q, c, x, the base's tilt and e
//!                      d = e_j e_jᵀ K and K [e_j]× for K: a gain, and the mounting
//! z = e_j |y_j|        gains that differ by sign
//! z = e_j s_j          hysteresis; s: the side from which the output came to the pose ([`super::side`])
//! z = ∂m/∂ψ (1, sin θ_k, cos θ_k)      an encoder that is off by a constant, or by one period a turn
//! z = ∂m/∂ψ                             axes of two gimbals that are not at right angles
//! z = ∂m/∂d_i (C e)_j                   soft iron on a gimbal; C e: the field in the gimbal's axes
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | p, d | entries of the unified model, and the direction in which they could change |
//! | φ | a course over the poses: time, a step in time, temperature |
//! | θ_k | angle of gimbal k, outermost first |
//! | ψ | a small rotation between a gimbal and its parent: about its own axis, or across both axes |
//!
//! Source: ours, from the unified model. Not tested: what the fit takes into its parameters, as the zero of the innermost
//! encoder, which is a mounting of the sensor.

use std::ops::Range;

use imucal_core::{
    model::{
        rig::{GimbalPose, Pose, PoseRotations},
        unified::{Terms, UNIFIED, UnifiedModel, UnifiedParameters},
    },
    rotation::exp,
};
use nalgebra::{DMatrix, Matrix3, SVector, Vector3};

use super::residual_driver::Course;
use crate::{
    calibrate::{fit::rows::Rows, suspicion::Follows},
    recording::SensorKind,
};

/// Half of the angle over which the effect of a small rotation is differentiated, rad.
const ANGLE: f64 = 1e-4;

/// A fit to poses.
#[derive(Clone, Copy, Debug)]
pub(super) struct PoseFit<'a, G: Pose<f64>> {
    pub poses: &'a [G],
    pub axes: G::Axes,
    pub parameters: &'a UnifiedParameters<f64>,
    /// Of each pose; none where no hysteresis is tested.
    pub sides: &'a [Vector3<f64>],
}

/// How an output could differ; see the module's equation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Alteration {
    /// b.
    Bias,
    /// K, a row at a time.
    Gain,
    /// K, by a small rotation of the sensor on the table.
    Mounting,
    /// The base's tilt.
    Tilt,
    /// The field.
    Field,
    /// q.
    Quadratic,
    /// c.
    Cubic,
    /// x.
    CrossProduct,
    /// Gains that differ by sign.
    BySign,
    /// The side that the output came from.
    Hysteresis,
}

/// One test: an alteration, and the course that it is multiplied with.
#[derive(Clone, Debug)]
pub struct Term<'a> {
    /// What a residual with it follows.
    pub follows: Follows,
    /// In words, after "follows".
    pub name: String,
    alteration: Alteration,
    course: Option<&'a Course>,
}

impl Term<'_> {
    /// A higher rung of the accelerometer's ladder has it.
    pub fn is_of_ladder(&self) -> bool {
        matches!(self.alteration, Alteration::Quadratic | Alteration::Cubic | Alteration::CrossProduct)
    }
}

/// What depends on direction alone, in words.
const OF_DIRECTION: [(Alteration, &str); 5] = [
    (Alteration::Cubic, "direction, as cubic terms make it"),
    (Alteration::Quadratic, "direction, as quadratic terms make it"),
    (Alteration::CrossProduct, "direction, as products of two axes make it"),
    (Alteration::BySign, "direction, as gains make it that differ by sign"),
    (Alteration::Hysteresis, "the direction before, as hysteresis makes it"),
];

/// What follows the direction alone.
pub fn of_direction<'a>() -> impl Iterator<Item = Term<'a>> {
    OF_DIRECTION.into_iter().map(|(alteration, name)| Term {
        follows: Follows::Direction,
        name: name.to_owned(),
        alteration,
        course: None,
    })
}

/// What follows courses.
pub fn of_courses(kind: SensorKind, courses: &[Course]) -> Vec<Term<'_>> {
    let surroundings = match kind {
        SensorKind::Mag => (Alteration::Field, "field"),
        _ => (Alteration::Tilt, "tilt of the base"),
    };
    let of_course = [
        (Alteration::Bias, "bias"),
        (Alteration::Gain, "gain"),
        (Alteration::Mounting, "mounting"),
        surroundings,
    ];
    let terms = courses.iter().flat_map(|course| {
        of_course.iter().map(move |(alteration, name)| Term {
            follows: course.follows,
            name: course.changing(name),
            alteration: *alteration,
            course: Some(course),
        })
    });
    terms.collect()
}

impl<G: Pose<f64>> PoseFit<'_, G> {
    /// Residuals of some poses, and their derivatives by all entries of the model.
    pub fn rows(&self, of: Range<usize>) -> Rows<UNIFIED> {
        let entries: [u8; UNIFIED] = std::array::from_fn(|entry| entry as u8);
        let terms = Terms::new(entries);
        let base = *self.parameters;
        let model = UnifiedModel { poses: &self.poses[of], axes: self.axes, base, terms, held: 0 };
        Rows::of(&model, &base.to_vector())
    }

    /// A term's columns at some poses, whose derivatives are given: three rows a pose.
    pub fn columns(&self, term: &Term<'_>, of: Range<usize>, rows: &Rows<UNIFIED>) -> DMatrix<f64> {
        let first = of.start;
        let mut columns = match term.alteration {
            Alteration::BySign => self.diagonal(of, |k| self.linear(k).abs()),
            Alteration::Hysteresis => self.diagonal(of, |k| self.sides.get(k).copied().unwrap_or_default()),
            linear => {
                let along = directions(linear, &self.parameters.sensitivity);
                let of_row = |row: usize, k: usize| rows.jacobian[row].dot(&along[k]);
                DMatrix::from_fn(rows.jacobian.len(), along.len(), of_row)
            }
        };
        if let Some(course) = term.course {
            for (row, mut values) in columns.row_iter_mut().enumerate() {
                values *= course.value(first + row / 3);
            }
        }
        columns
    }

    /// By how much the entries of K change with a term of such coefficients, to either side of the mean; `None` where the term does
    /// not change K. A bias is not asked for: slow noise changes it as well.
    pub fn change(&self, term: &Term<'_>, coefficients: &[f64]) -> Option<SVector<f64, UNIFIED>> {
        let course =
            term.course.filter(|_| matches!(term.alteration, Alteration::Gain | Alteration::Mounting))?;
        let most = course.largest(self.poses.len());
        let along = directions(term.alteration, &self.parameters.sensitivity);
        Some(along.iter().zip(coefficients).map(|(along, c)| along * (*c * most)).sum())
    }

    /// y of a pose.
    fn linear(&self, k: usize) -> Vector3<f64> {
        let none = Vector3::zeros();
        let linear = UnifiedParameters {
            bias: none,
            quadratic: none,
            cubic: none,
            cross_product: none,
            ..*self.parameters
        };
        linear.predict(&self.poses[k].rotations(&self.axes))
    }

    /// What is added to each axis by its own parameter.
    fn diagonal(&self, of: Range<usize>, value: impl Fn(usize) -> Vector3<f64>) -> DMatrix<f64> {
        let mut columns = DMatrix::zeros(3 * of.len(), 3);
        for (row, k) in of.enumerate() {
            columns.fixed_view_mut::<3, 3>(3 * row, 0).copy_from(&Matrix3::from_diagonal(&value(k)));
        }
        columns
    }
}

impl PoseFit<'_, GimbalPose<f64>> {
    /// Of an encoder's error, by gimbal, outermost first: 1, sin θ and cos θ times the derivative by the angle.
    pub fn encoder(&self, gimbal: usize) -> DMatrix<f64> {
        let slopes = self.slopes(gimbal, |axes| axes[gimbal]);
        DMatrix::from_fn(3 * slopes.len(), 3, |row, k| {
            let (sin, cos) = self.poses[row / 3].angles()[gimbal].sin_cos();
            slopes[row / 3][row % 3] * [1.0, sin, cos][k]
        })
    }

    /// Of the axes of a gimbal and of its parent that are not at right angles; `None` of the outermost.
    pub fn oblique(&self, gimbal: usize) -> Option<DMatrix<f64>> {
        let parent = gimbal.checked_sub(1)?;
        let slopes = self.slopes(gimbal, |axes| axes[parent].cross(&axes[gimbal]));
        Some(DMatrix::from_fn(3 * slopes.len(), 1, |row, _| slopes[row / 3][row % 3]))
    }

    /// Of iron on the outer (0) or the middle gimbal that a field magnetises: by each entry of a matrix that turns the field there
    /// into what it adds, as a constant source there would.
    pub fn soft_iron(&self, gimbal: usize, rows: &Rows<UNIFIED>) -> DMatrix<f64> {
        let by_source = [17, 20][gimbal];
        let of_pose = |pose: &GimbalPose<f64>| {
            let r = pose.rotations(&self.axes);
            [r.c_o_t, r.c_m_t][gimbal].tr_mul(&(r.c_p_t * self.parameters.vector_n))
        };
        let fields: Vec<Vector3<f64>> = self.poses.iter().map(of_pose).collect();
        let of_row = |row: usize, k: usize| rows.jacobian[row][by_source + k / 3] * fields[row / 3][k % 3];
        DMatrix::from_fn(rows.jacobian.len(), 9, of_row)
    }

    /// How outputs change where a gimbal, and all that it carries, turns about an axis, of those of all gimbals in the table's
    /// frame.
    fn slopes(&self, gimbal: usize, about: impl Fn([Vector3<f64>; 3]) -> Vector3<f64>) -> Vec<Vector3<f64>> {
        let named = self.axes.0.map(|axis| Vector3::ith(axis as usize, 1.0));
        let of_pose = |pose: &GimbalPose<f64>| {
            let r = pose.rotations(&self.axes);
            let axis = about([r.c_p_t * named[0], r.c_o_t * named[1], r.c_m_t * named[2]]);
            let turned = |angle: f64| {
                let by = exp(&(axis * -angle));
                let [c_p_t, c_o_t, c_m_t] = [(0, r.c_p_t), (1, r.c_o_t), (2, r.c_m_t)]
                    .map(|(frame, c)| if frame <= gimbal { by * c } else { c });
                self.parameters.predict(&PoseRotations { c_p_t, c_o_t, c_m_t })
            };
            (turned(ANGLE) - turned(-ANGLE)) / (2.0 * ANGLE)
        };
        self.poses.iter().map(of_pose).collect()
    }
}

/// Directions of all entries in which an alteration moves them.
fn directions(alteration: Alteration, sensitivity: &Matrix3<f64>) -> Vec<SVector<f64, UNIFIED>> {
    let of_entries = |entries: Range<usize>| entries.map(|entry| SVector::ith(entry, 1.0)).collect();
    let of_sensitivity = |change: &dyn Fn(usize) -> Matrix3<f64>| {
        (0..3)
            .map(|axis| {
                let change = change(axis);
                SVector::from_fn(|entry, _| if entry < 9 { change[(entry / 3, entry % 3)] } else { 0.0 })
            })
            .collect()
    };
    match alteration {
        Alteration::Bias => of_entries(9..12),
        Alteration::Tilt => of_entries(12..14),
        Alteration::Field => of_entries(14..17),
        Alteration::Quadratic => of_entries(23..26),
        Alteration::Cubic => of_entries(26..29),
        Alteration::CrossProduct => of_entries(29..32),
        Alteration::Gain => {
            of_sensitivity(&|axis| Matrix3::from_fn(|i, j| if i == axis { sensitivity[(i, j)] } else { 0.0 }))
        }
        Alteration::Mounting => {
            of_sensitivity(&|axis| sensitivity * Vector3::<f64>::ith(axis, 1.0).cross_matrix())
        }
        Alteration::BySign | Alteration::Hysteresis => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use imucal_core::model::rig::{Axis, RigAxes};

    use super::*;

    const AXES: RigAxes = RigAxes([Axis::Z, Axis::Y, Axis::X]);
    const STEP: f64 = 1e-5;

    fn poses() -> Vec<GimbalPose<f64>> {
        let angle = |k: usize, step: f64| (step * k as f64).sin() * 2.0;
        let angles = |k: usize| Vector3::new(angle(k, 1.0), angle(k, 1.7), angle(k, 2.9));
        (0..12).map(|k| GimbalPose::new(Vector3::zeros(), &angles(k))).collect()
    }

    fn parameters() -> UnifiedParameters<f64> {
        UnifiedParameters {
            sensitivity: Matrix3::new(1.02, 0.01, -0.02, 0.03, 0.97, 0.01, 0.0, -0.01, 1.01),
            bias: Vector3::new(0.1, -0.2, 0.3),
            tilt: [0.01, -0.02],
            quadratic: Vector3::new(1e-4, -2e-4, 3e-4),
            ..UnifiedParameters::nominal(Vector3::new(0.0, 0.0, -9.81))
        }
    }

    fn outputs(
        parameters: &UnifiedParameters<f64>,
        angles: impl Fn(Vector3<f64>) -> Vector3<f64>,
    ) -> Vec<f64> {
        let poses = poses();
        let of_pose = |pose: &GimbalPose<f64>| {
            let turned = GimbalPose::new(pose.value, &angles(pose.angles()));
            let output = parameters.predict(&turned.rotations(&AXES));
            [output.x, output.y, output.z]
        };
        poses.iter().flat_map(of_pose).collect()
    }

    /// Columns are the difference of outputs that are altered by a step to either side.
    fn assert_slope(column: &DMatrix<f64>, axis: usize, altered: impl Fn(f64) -> Vec<f64>) {
        for (row, (above, below)) in altered(STEP).iter().zip(altered(-STEP)).enumerate() {
            let slope = (above - below) / (2.0 * STEP);
            assert!((slope - column[(row, axis)]).abs() < 1e-6, "{axis}: {slope} {}", column[(row, axis)]);
        }
    }

    #[test]
    fn columns_are_how_outputs_differ_where_parameters_do() {
        let (poses, parameters) = (poses(), parameters());
        let fit = PoseFit { poses: &poses, axes: AXES, parameters: &parameters, sides: &[] };
        let rows = fit.rows(0..poses.len());
        let k = parameters.sensitivity;
        let gain = |axis: usize, step: f64| {
            let scale = Matrix3::identity() + Matrix3::from_diagonal(&Vector3::ith(axis, step));
            UnifiedParameters { sensitivity: scale * k, ..parameters }
        };
        let mounting = |axis: usize, step: f64| {
            let turned = Matrix3::identity() + Vector3::<f64>::ith(axis, step).cross_matrix();
            UnifiedParameters { sensitivity: k * turned, ..parameters }
        };
        let quadratic = |axis: usize, step: f64| {
            let quadratic = parameters.quadratic + Vector3::ith(axis, step);
            UnifiedParameters { quadratic, ..parameters }
        };
        type Altered<'a> = &'a dyn Fn(usize, f64) -> UnifiedParameters<f64>;
        let all: [(Alteration, Altered<'_>); 3] = [
            (Alteration::Gain, &gain),
            (Alteration::Mounting, &mounting),
            (Alteration::Quadratic, &quadratic),
        ];
        for (alteration, altered) in all {
            let term = Term { follows: Follows::Direction, name: String::new(), alteration, course: None };
            let columns = fit.columns(&term, 0..poses.len(), &rows);
            for axis in 0..3 {
                assert_slope(&columns, axis, |step| outputs(&altered(axis, step), |angles| angles));
            }
        }
    }

    #[test]
    fn an_encoder_s_columns_are_how_outputs_differ_where_its_angle_does() {
        let (poses, parameters) = (poses(), parameters());
        let fit = PoseFit { poses: &poses, axes: AXES, parameters: &parameters, sides: &[] };
        for gimbal in 0..3 {
            let factors: [fn(f64) -> f64; 3] = [|_| 1.0, f64::sin, f64::cos];
            let columns = fit.encoder(gimbal);
            for (column, factor) in factors.into_iter().enumerate() {
                let off = |step: f64| {
                    move |angles: Vector3<f64>| angles + Vector3::ith(gimbal, step * factor(angles[gimbal]))
                };
                assert_slope(&columns, column, |step| outputs(&parameters, off(step)));
            }
        }
    }

    #[test]
    fn axes_at_right_angles_have_parents_and_change_all_that_they_carry() {
        let (poses, parameters) = (poses(), parameters());
        let fit = PoseFit { poses: &poses, axes: AXES, parameters: &parameters, sides: &[] };
        assert!(fit.oblique(0).is_none());
        for gimbal in 1..3 {
            // z, y, x: the third axis of a pair is about which they are oblique, and no encoder turns about it.
            let (column, encoder) = (fit.oblique(gimbal).unwrap(), fit.encoder(gimbal));
            let cosine =
                column.column(0).dot(&encoder.column(0)) / (column.norm() * encoder.column(0).norm());
            assert!(column.norm() > 1.0 && cosine.abs() < 0.9, "{cosine}");
        }
    }
}

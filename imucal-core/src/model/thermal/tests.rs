use std::vec::Vec;

use nalgebra::{Matrix3, Quaternion, SVector, Vector3};
use proptest::array::{uniform3, uniform12, uniform15};
use proptest::prelude::*;

use super::*;
use crate::{
    model::{
        norm::NormModel,
        parameterisation::{FULL, UPPER_TRIANGULAR},
        rig::{Axis, GimbalPose, RigAxes},
        turn::TurnModel,
        unified::{Terms, UnifiedModel, UnifiedParameters},
    },
    observation::{Block, Durations, ShellPoint, Turn},
    rotation::matrix,
    solver::{LevenbergMarquardt, jacobian_check::largest_jacobian_error},
    triad::Triad,
};

const ALL: [u8; 24] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23];
const GAIN: ThermalForm<12, 24> = ThermalForm::new(ALL, Side::Gain);

fn theta(triad: &Triad<f64>, terms: [f64; 12]) -> SVector<f64, 24> {
    let cold = FULL.theta(triad);
    SVector::from_fn(|k, _| if k < 12 { cold[k] } else { terms[k - 12] })
}

fn turned(noise: [f64; 12]) -> Triad<f64> {
    FULL.triad(&(FULL.theta(&Triad::identity()) + SVector::from(noise)))
}

proptest! {
    #[test]
    fn the_jacobian_of_a_norm_at_several_temperatures_is_the_numerical_one(
        noise in uniform12(-0.05f64..0.05), terms in uniform12(-0.05f64..0.05),
        points in prop::collection::vec((uniform3(2.0f64..12.0), -3.0f64..3.0), 1..4),
    ) {
        let shell: Vec<ShellPoint<f64>> = points.iter().map(|(p, _)| ShellPoint::new(Vector3::from(*p))).collect();
        let changes: Vec<f64> = points.iter().map(|(_, change)| *change).collect();
        let of = |k: usize| Some(NormModel { points: shell.get(k..=k)?, norm: 9.8, form: FULL });
        let model = ThermalModel { changes: &changes, of, form: GAIN, held: 0 };
        prop_assert!(largest_jacobian_error(&model, &theta(&turned(noise), terms)) < 1e-7);
        let linear = ThermalModel { changes: &changes, of, form: UPPER_TRIANGULAR_LINEAR, held: 1 << 10 };
        let at = UPPER_TRIANGULAR_LINEAR.theta(&FULL.theta(&turned(noise)));
        prop_assert!(largest_jacobian_error(&linear, &at) < 1e-7);
    }

    #[test]
    fn the_jacobian_of_poses_on_a_rig_is_the_numerical_one(
        noise in uniform12(-0.05f64..0.05), terms in uniform12(-0.05f64..0.05),
        angles in prop::collection::vec((uniform3(-3.0f64..3.0), -3.0f64..3.0), 1..4),
    ) {
        const FORM: ThermalForm<14, 26> = ThermalForm::new(
            [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25],
            Side::Sensitivity,
        );
        let poses: Vec<GimbalPose<f64>> =
            angles.iter().map(|(a, _)| GimbalPose::new(Vector3::new(1.0, 2.0, -3.0), &Vector3::from(*a))).collect();
        let changes: Vec<f64> = angles.iter().map(|(_, change)| *change).collect();
        let base = UnifiedParameters::nominal(Vector3::new(0.0, 0.0, -9.8));
        let of = |k: usize| Some(UnifiedModel {
            poses: poses.get(k..=k)?,
            axes: RigAxes([Axis::Z, Axis::Y, Axis::X]),
            base,
            terms: Terms::new([0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13]),
            held: 0,
        });
        let model = ThermalModel { changes: &changes, of, form: FORM, held: 0 };
        let triad = theta(&turned(noise), terms);
        let at = SVector::<f64, 26>::from_fn(|k, _| match k {
            0..12 => triad[k],
            12 | 13 => 0.01,
            _ => triad[k - 2],
        });
        prop_assert!(largest_jacobian_error(&model, &at) < 1e-7);
    }

    #[test]
    fn the_jacobian_of_a_turn_is_the_numerical_one(
        noise in uniform12(-0.05f64..0.05), terms in uniform12(-0.05f64..0.05), change in -3.0f64..3.0,
        rates in prop::collection::vec(uniform3(-1.0f64..1.0), 2..5),
    ) {
        let blocks: Vec<Block<f64>> = rates
            .iter()
            .map(|r| Block { s0: Vector3::from(*r) * 0.2, s1: Vector3::from(*r) * 0.01, c: Vector3::repeat(1e-3) })
            .collect();
        let turns = [Turn {
            blocks: &blocks,
            durations: Durations::Uniform(0.2),
            before: Vector3::z(),
            after: matrix(&Quaternion::new(0.9, 0.1, 0.3, -0.2)) * Vector3::z(),
        }];
        let of = |k: usize| Some(TurnModel { turns: turns.get(k..=k)?, form: FULL });
        let model = ThermalModel { changes: &[change], of, form: GAIN, held: 0 };
        prop_assert!(largest_jacobian_error(&model, &theta(&turned(noise), terms)) < 1e-7);
    }

    #[test]
    fn terms_of_a_parameter_vector_are_those_the_corrector_applies(
        parameters in uniform15(-0.1f64..0.1), raw in uniform3(-10.0f64..10.0), change in -3.0f64..3.0,
    ) {
        let form = UPPER_TRIANGULAR_LINEAR;
        let theta = SVector::from(parameters) + form.theta(&FULL.theta(&Triad::identity()));
        let (cold, terms) = (form.cold(&theta), form.warmth(&theta));
        let at = FULL.triad(&Warm::new(&cold, &terms, change).theta(Side::Gain, &terms));
        let corrected = form.terms(&theta, 20.0).correct(&FULL.triad(&cold), &Vector3::from(raw), 20.0 + UNIT * change);
        prop_assert!((at.correct(&Vector3::from(raw)) - corrected).norm() < 1e-12);
    }
}

/// Rests of a sensor in many poses, at temperatures that come in no order: raw points and δ.
fn warm_rests<T: Scalar>(count: usize) -> (Vec<ShellPoint<T>>, Vec<T>, Triad<f64>, TemperatureTerms<f64>) {
    let triad = Triad {
        gain: Matrix3::new(1.02, 0.01, -0.02, 0.0, 0.98, 0.015, 0.0, 0.0, 1.01),
        bias: Vector3::new(0.2, -0.1, 0.3),
    };
    let terms = TemperatureTerms {
        reference: 25.0,
        bias_slope: [4e-3, -2e-3, 1e-3],
        scale_slope: [2e-4, -1e-4, 5e-5],
    };
    let rest = |k: usize| {
        let z = 1.0 - (2 * k + 1) as f64 / count as f64;
        let (sin, cos) = (2.4 * k as f64).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        let change = ((7 * k) % count) as f64 / count as f64 * 6.0 - 3.0;
        let force = Vector3::new(cos * radius, sin * radius, z) * 9.8;
        (terms.predict(&triad, &force, 25.0 + UNIT * change).unwrap(), change)
    };
    let rests: Vec<_> = (0..count).map(rest).collect();
    let points = rests.iter().map(|(raw, _)| ShellPoint::new(raw.map(T::of))).collect();
    (points, rests.iter().map(|(_, change)| T::of(*change)).collect(), triad, terms)
}

fn fitted<T: Scalar>() -> (SVector<T, 15>, T, Triad<f64>, TemperatureTerms<f64>) {
    let (points, changes, triad, terms) = warm_rests::<T>(48);
    let of = |k: usize| Some(NormModel { points: points.get(k..=k)?, norm: T::of(9.8), form: FULL });
    let form = UPPER_TRIANGULAR_LINEAR;
    let model = ThermalModel { changes: &changes, of, form, held: 0 };
    let start = form.theta(&FULL.theta(&Triad::identity()));
    let mut solver = LevenbergMarquardt::new(start, Default::default());
    let report = solver.run(&model);
    assert!(report.termination.was_successful(), "{report:?}");
    (*solver.theta(), report.condition, triad, terms)
}

#[test]
fn rests_at_several_temperatures_give_gain_bias_and_their_slopes() {
    let (theta, _, triad, terms) = fitted::<f64>();
    let found = UPPER_TRIANGULAR_LINEAR.terms(&theta, 25.0);
    let expected = UPPER_TRIANGULAR.theta(&triad);
    for k in 0..9 {
        assert!((theta[k] - expected[k]).abs() < 1e-8, "{k}: {} for {}", theta[k], expected[k]);
    }
    for axis in 0..3 {
        assert!((found.bias_slope[axis] - terms.bias_slope[axis]).abs() < 1e-9);
        assert!((found.scale_slope[axis] - terms.scale_slope[axis]).abs() < 1e-10);
    }
}

#[test]
fn a_device_s_precision_gives_the_slopes_to_a_thousandth_of_what_they_do() {
    let (theta, condition, _, terms) = fitted::<f32>();
    let found = UPPER_TRIANGULAR_LINEAR.terms(&theta, 25.0);
    // Columns of one size: no more than two decimal digits of seven are lost.
    assert!(condition < 100.0, "{condition}");
    for axis in 0..3 {
        // Over 30 K the bias moves by 0.12 m/s², the scale by 0.06 m/s² of 9.8.
        assert!((f64::from(found.bias_slope[axis]) - terms.bias_slope[axis]).abs() < 4e-6, "{found:?}");
        assert!((f64::from(found.scale_slope[axis]) - terms.scale_slope[axis]).abs() < 2e-7, "{found:?}");
    }
}

#[test]
fn a_term_that_is_held_stays_zero_and_counts_for_no_freedom() {
    let (points, changes, ..) = warm_rests::<f64>(48);
    let of = |k: usize| Some(NormModel { points: points.get(k..=k)?, norm: 9.8, form: FULL });
    let form = UPPER_TRIANGULAR_LINEAR;
    let held = 0b111_u32 << 12;
    let model = ThermalModel { changes: &changes, of, form, held };
    let mut solver = LevenbergMarquardt::new(form.theta(&FULL.theta(&Triad::identity())), Default::default());
    let report = solver.run(&model);
    assert!(report.termination.was_successful(), "{report:?}");
    assert_eq!(report.independent_rows, 48 + 3);
    assert!((12..15).all(|k| solver.theta()[k].abs() < 1e-12), "{}", solver.theta());
}

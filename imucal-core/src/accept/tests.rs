use super::*;
use crate::{
    model::{norm::NormModel, parameterisation::UPPER_TRIANGULAR},
    observation::ShellPoint,
};
use nalgebra::Vector3;

fn coverage(observations: usize, share: f64, flatness: f64, distinct: usize) -> Coverage<f64> {
    Coverage { observations, share, flatness, distinct }
}

#[test]
fn thirteen_rests_on_six_faces_are_not_redundant_for_nine_parameters() {
    let verdict = check_observations(&coverage(13, 0.4, 0.3, 6), 9, &Limits::for_norm(9, 10));
    assert_eq!(verdict, Err(Refusal::NotRedundant { directions: 6, need: 10, parameters: 9 }));
    assert!(check_observations(&coverage(13, 0.4, 0.3, 6), 6, &Limits::for_norm(6, 6)).is_ok());
}

#[test]
fn a_plane_is_refused_for_its_coverage_however_many_observations_it_has() {
    let verdict = check_observations(&coverage(500, 0.5, 1e-4, 24), 9, &Limits::for_norm(9, 10));
    assert_eq!(verdict.unwrap_err().reason(), "poor-coverage");
}

#[test]
fn a_cloud_without_noise_is_not_judged_by_its_rounding() {
    let points: std::vec::Vec<_> = (0..200u32)
        .map(|k| {
            let z = 1.0 - (2.0 * f64::from(k) + 1.0) / 200.0;
            let (r, a) = ((1.0 - z * z).sqrt(), 2.399_963 * f64::from(k));
            let on_shell = Vector3::new(1.1 * r * a.cos(), 0.9 * r * a.sin(), z);
            ShellPoint::new(on_shell + Vector3::new(1.3, -0.7, 0.9))
        })
        .collect();
    let model = NormModel { points: &points, norm: 1.0, form: UPPER_TRIANGULAR };
    let near = Triad { gain: Matrix3::identity(), bias: Vector3::new(1.0, -0.5, 0.7) };
    let mut fit = LevenbergMarquardt::new(UPPER_TRIANGULAR.theta(&near), Default::default());
    assert!(fit.run(&model).termination.was_successful());
    assert!(fit.variance().unwrap() > 0.0, "rounding leaves something");
    assert_eq!(nonlinearity(&fit, &model, 1.0), 0.0);
}

#[test]
fn what_is_expected_of_a_vector_is_what_its_gain_and_bias_are_known_to() {
    let gain = Matrix3::identity() * 2.0f64;
    // A hundredth of each axis; a bias of three thousandths of the length on one.
    let std = Triad { gain: Matrix3::identity() * 0.02, bias: Vector3::new(0.015, 0.0, 0.0) };
    let error = relative_error(&gain, &std, 5.0);
    assert!((error - (1e-4f64 + 9e-6).sqrt()).abs() < 1e-12, "{error}");
    assert!(check_precision(error, &Limits::for_norm(9, 10)).is_ok());
    let unknown = Triad { gain: Matrix3::repeat(f64::INFINITY), ..std };
    let refused = check_precision(relative_error(&gain, &unknown, 5.0), &Limits::for_norm(9, 10));
    assert_eq!(refused.unwrap_err().reason(), "ill-conditioned");
}

#[test]
fn a_large_condition_is_no_reason_while_standard_errors_are_small() {
    let report = SolveReport {
        termination: Termination::Gradient,
        iterations: 1,
        evaluations: 1,
        independent_rows: 40,
        cost: 1e-9f32,
        gradient: 0.0,
        condition: 700.0,
    };
    assert_eq!(check_report(&report), Ok(()));
    let singular = SolveReport { condition: f32::MAX, ..report };
    assert_eq!(check_report(&singular).unwrap_err().reason(), "ill-conditioned");
}

#[test]
fn a_gain_of_three_times_nominal_is_implausible() {
    let triad = Triad { gain: Matrix3::identity() * 3.0f32, bias: Vector3::zeros() };
    let verdict = check_plausibility(&triad, true, 0.0, &Limits::for_norm(9, 10));
    assert_eq!(verdict.unwrap_err().reason(), "implausible");
    assert!(check_plausibility(&triad, false, 0.0, &Limits::for_norm(9, 10)).is_ok());
}

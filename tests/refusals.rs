//! Recordings that cannot be calibrated are refused, each for its own reason.

use std::f64::consts::{FRAC_PI_2, PI};

use imucal_host::{
    calibrate::{Calibration, Options, calibrate},
    recording::SensorKind,
    simulator::{SimulatedUnit, Tumble, record},
};
use nalgebra::{UnitQuaternion, Vector3};

/// First rest, other rests and turns, s.
const USUAL: (f64, f64, f64) = (10.0, 3.0, 2.0);

fn calibrated(attitudes: Vec<UnitQuaternion<f64>>, durations: (f64, f64, f64)) -> Calibration {
    let recording = record("refused.csv", &Tumble::through(attitudes, durations), &SimulatedUnit::mtx(), 11);
    calibrate(&recording, &Options::default(), &|_| {})
}

fn reason(calibration: &Calibration, kind: SensorKind) -> &'static str {
    let outcome = calibration.sensor(kind).expect("recorded");
    let refused = outcome.verdict.as_ref().expect_err("refused");
    assert!(!refused.advice.is_empty(), "a refusal says what to do");
    refused.refusal.reason()
}

fn about(axis: Vector3<f64>, angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(axis * angle)
}

/// Angles that leave no two rests alike: steps of the golden angle.
fn angle(k: usize) -> f64 {
    2.399_963 * k as f64
}

#[test]
fn turns_about_one_axis_only_are_poor_coverage() {
    let attitudes = (0..16).map(|k| about(Vector3::x(), angle(k))).collect();
    let calibration = calibrated(attitudes, USUAL);
    // Gravity stays in one plane of the sensor, the field on one cone.
    for kind in SensorKind::ALL {
        assert_eq!(reason(&calibration, kind), "poor-coverage", "{kind}");
    }
}

#[test]
fn rests_in_one_plane_are_poor_coverage_despite_turns_about_two_axes() {
    let attitudes =
        (0..16).map(|k| about(Vector3::z(), 1.7 * angle(k)) * about(Vector3::x(), angle(k))).collect();
    let calibration = calibrated(attitudes, USUAL);
    assert_eq!(reason(&calibration, SensorKind::Acc), "poor-coverage");
    assert_eq!(reason(&calibration, SensorKind::Gyr), "poor-coverage");
}

#[test]
fn turns_about_the_vertical_only_are_poor_coverage() {
    let attitudes = (0..16).map(|k| about(Vector3::z(), angle(k))).collect();
    let calibration = calibrated(attitudes, USUAL);
    for kind in SensorKind::ALL {
        assert_eq!(reason(&calibration, kind), "poor-coverage", "{kind}");
    }
}

#[test]
fn a_sensor_that_is_never_laid_down_has_no_rest() {
    let attitudes = (0..40)
        .map(|k| about(Vector3::new(angle(k).cos(), angle(k).sin(), 0.4).normalize(), 0.7 * PI * k as f64))
        .collect();
    let calibration = calibrated(attitudes, (0.0, 0.0, 1.5));
    assert_eq!(reason(&calibration, SensorKind::Acc), "no-rest");
    assert_eq!(reason(&calibration, SensorKind::Gyr), "no-rest");
}

#[test]
fn seven_rests_are_too_few() {
    let calibration = calibrated(faces().into_iter().chain([UnitQuaternion::identity()]).collect(), USUAL);
    assert_eq!(reason(&calibration, SensorKind::Acc), "too-few-observations");
    assert_eq!(reason(&calibration, SensorKind::Gyr), "too-few-observations");
}

#[test]
fn six_faces_twice_are_not_redundant() {
    let twice = faces().into_iter().chain(faces()).collect();
    let calibration = calibrated(twice, USUAL);
    assert_eq!(reason(&calibration, SensorKind::Acc), "not-redundant");
    assert_eq!(reason(&calibration, SensorKind::Gyr), "not-redundant");
}

#[test]
fn a_sensor_that_is_never_touched_has_no_motion() {
    let calibration = calibrated(vec![about(Vector3::x(), 0.3)], (60.0, 0.0, 0.0));
    assert_eq!(reason(&calibration, SensorKind::Acc), "no-motion");
    assert_eq!(reason(&calibration, SensorKind::Gyr), "no-motion");
    // A ball of noise around one point of the field covers every direction from its own middle, so that the solver
    // has to say it; what it says depends on the noise.
    let mag = calibration.sensor(SensorKind::Mag).expect("recorded");
    assert!(mag.verdict.is_err(), "{mag:?}");
}

/// Each axis up and down.
fn faces() -> Vec<UnitQuaternion<f64>> {
    [(Vector3::x(), 0.0), (Vector3::x(), FRAC_PI_2), (Vector3::x(), PI), (Vector3::x(), -FRAC_PI_2)]
        .into_iter()
        .chain([(Vector3::y(), FRAC_PI_2), (Vector3::y(), -FRAC_PI_2)])
        .map(|(axis, turn)| about(axis, turn))
        .collect()
}

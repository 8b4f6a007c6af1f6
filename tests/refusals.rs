//! Recordings that cannot be calibrated are refused, each for its own reason.

use std::f64::consts::{FRAC_PI_2, PI};

use imucal_host::{
    calibrate::{Calibration, Options, calibrate, outcome::SensorOutcome},
    recording::{SensorKind, Triple},
    simulator::{SimulatedUnit, Tumble, record},
};
use imucal_tests::simulated;
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

#[test]
fn a_gyroscope_that_is_stuck_at_rest_is_refused_and_leaves_the_accelerometer_its_rests() {
    let mut recording = simulated::tumbled(24, 60);
    let still = calibrate(&recording, &Options::default(), &|_| {}).segmentation.expect("rests").rests;
    let gyr = recording.gyr.as_mut().expect("recorded");
    // A dead band: whatever is slower than 5 °/s is none.
    gyr.values.iter_mut().for_each(|rate| *rate = rate.map(|w| if w.abs() < 0.09 { 0.0 } else { w }));
    let calibration = calibrate(&recording, &Options::default(), &|_| {});
    assert!(calibration.sensor(SensorKind::Acc).expect("recorded").accepted().is_some());
    assert_eq!(calibration.segmentation.as_ref().expect("rests").rests.len(), still.len());
    assert_eq!(reason(&calibration, SensorKind::Gyr), "no-rest");
    let gyr = calibration.sensor(SensorKind::Gyr).expect("recorded");
    assert!(gyr.verdict.as_ref().expect_err("refused").advice.contains("dead band"));
}

#[test]
fn sensors_that_are_measured_in_turns_calibrate_with_the_errors_of_their_fewer_samples() {
    let mut recording = simulated::tumbled(30, 61);
    let whole = calibrate(&recording, &Options::default(), &|_| {});
    let missing = |triple: &mut Option<Triple>, kept: usize| {
        let values = triple.as_mut().expect("recorded").values.iter_mut();
        values.enumerate().filter(|(row, _)| row % 2 != kept).for_each(|(_, value)| value.fill(f64::NAN));
    };
    missing(&mut recording.acc, 0);
    missing(&mut recording.gyr, 1);
    let half = calibrate(&recording, &Options::default(), &|_| {});
    for kind in [SensorKind::Acc, SensorKind::Gyr] {
        let [half, whole] =
            [&half, &whole].map(|all| all.sensor(kind).and_then(SensorOutcome::accepted).expect("accepted"));
        let difference = half.triad.gain - whole.triad.gain;
        let std = half.gain_std.map(|std| if std > 0.0 { std } else { 1.0 });
        assert!(difference.component_div(&std).amax() < 4.0, "{kind}: {difference}");
        // Half of the samples: the square root of two, by what else the errors hold.
        let ratio = half.gain_std.norm() / whole.gain_std.norm();
        assert!((1.0..2.0).contains(&ratio), "{kind}: {ratio}");
    }
}

/// Each axis up and down.
fn faces() -> Vec<UnitQuaternion<f64>> {
    [(Vector3::x(), 0.0), (Vector3::x(), FRAC_PI_2), (Vector3::x(), PI), (Vector3::x(), -FRAC_PI_2)]
        .into_iter()
        .chain([(Vector3::y(), FRAC_PI_2), (Vector3::y(), -FRAC_PI_2)])
        .map(|(axis, turn)| about(axis, turn))
        .collect()
}

//! Recordings that are sound, but whose motion cannot tell what is asked.

use imucal_tests::simulated::{recorded, tumbled, turned_about};
use nalgebra::{UnitQuaternion, Vector3};

use super::{Bad, GYR};

#[test]
fn without_a_rest_the_accelerometer_is_refused() {
    // Turns about two axes at once, never still, with the shaking of a hand.
    let bad = Bad::of(&recorded(80.0, |t| {
        let turned = |t: f64| UnitQuaternion::from_euler_angles(1.3 * t, 0.9 * (0.7 * t).sin(), 0.8 * t);
        let rate = (turned(t).inverse() * turned(t + 1e-4)).scaled_axis() / 1e-4;
        let shaking = Vector3::new((31.0 * t).sin(), (37.0 * t).cos(), (41.0 * t).sin()) * 1.5;
        [
            turned(t).inverse() * Vector3::new(0.0, 0.0, -9.7997) + shaking,
            rate,
            turned(t).inverse() * Vector3::new(25.3, 2.6, 40.1),
        ]
    }));
    let ended = bad.calibrate();
    let json = bad.json();
    for kind in ["acc", "gyr"] {
        let reason = json["sensors"][kind]["reason"].as_str().expect("refused");
        assert!(["no-rest", "too-few-observations"].contains(&reason), "{kind}: {reason} {ended:#?}");
    }
    ended.printing(&["to do:", "rest"]);
}

#[test]
fn too_few_rests_are_counted() {
    let bad = Bad::of(&tumbled(6, 5));
    bad.calibrate()
        .printing(&["accelerometer (T9): REFUSED, too-few-observations", "6 observations, 10 needed"]);
    assert_eq!(bad.json()["sensors"]["gyr"]["status"], "refused");
}

#[test]
fn rests_in_one_plane_are_refused() {
    // About a level axis: gravity stays in a plane of the sensor.
    let bad = Bad::of(&turned_about(Vector3::x(), UnitQuaternion::identity(), 0.7, 18));
    let ended = bad.calibrate();
    for kind in ["acc", "gyr", "mag"] {
        assert_eq!(bad.json()["sensors"][kind]["status"], "refused", "{kind}: {ended:#?}");
    }
    ended.with(1).printing(&["poor-coverage", "to do:"]);
}

#[test]
fn turns_about_the_vertical_tell_nothing_of_the_accelerometer() {
    let bad = Bad::of(&turned_about(Vector3::z(), UnitQuaternion::identity(), 0.7, 18));
    let ended = bad.calibrate();
    for kind in ["acc", "gyr", "mag"] {
        assert_eq!(bad.json()["sensors"][kind]["status"], "refused", "{kind}: {ended:#?}");
    }
    ended.with(1);
}

#[test]
fn a_gyroscope_that_did_not_follow_is_refused() {
    // Its cable was off: noise around zero, while the accelerometer was turned.
    let mut bad = Bad::new();
    for (index, row) in bad.rows.iter_mut().enumerate().skip(1) {
        for axis in 0..3 {
            row[GYR + axis] = (32768 + (index * (7 + axis) % 11)).to_string();
        }
    }
    bad.calibrate();
    assert_eq!(bad.json()["sensors"]["gyr"]["status"], "refused", "{}", bad.json()["sensors"]["gyr"]);
}

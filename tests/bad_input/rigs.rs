//! Recordings of a rig whose encoders, axes or poses are wrong, and of a reference that is not there.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use imucal_tests::rig::{Draw, angles};
use imucal_tests::simulated;
use nalgebra::Vector3;

use super::{ALL, Bad};

/// A rig in 24 attitudes.
fn on_rig() -> Bad {
    let mut draw = Draw::new(8);
    let at: Vec<Vector3<f64>> = (0..24).map(|_| angles(&draw.attitude())).collect();
    Bad::of(&simulated::on_rig(&at))
}

/// Columns of the encoders.
fn encoders(bad: &Bad) -> Vec<usize> {
    let header = &bad.rows[0];
    (0..header.len()).filter(|column| header[*column].starts_with("gimbal_")).collect()
}

fn models(bad: &Bad) -> [String; 3] {
    let json = bad.json();
    ALL.map(|kind| json["sensors"][kind]["model"].as_str().expect("a model").to_owned())
}

/// Calibrates and gives the three sensors' gains and biases; all must be accepted by the rig's models.
fn calibrated(bad: &Bad) -> Vec<f64> {
    bad.calibrate().with(0);
    assert_eq!(models(bad), ["I14", "G12", "X21"]);
    let json = bad.json();
    let sensor = |kind: &&str| {
        let sensor = &json["sensors"][kind];
        assert_eq!(sensor["status"], "accepted", "{sensor}");
        let rows = sensor["gain"].as_array().expect("rows").iter().chain([&sensor["bias"]]);
        rows.flat_map(|row| row.as_array().expect("numbers").clone()).collect::<Vec<_>>()
    };
    ALL.iter().flat_map(sensor).map(|value| value.as_f64().expect("a number")).collect()
}

#[test]
fn encoders_that_count_on_beyond_half_a_turn_are_as_good_as_wrapped_ones() {
    let bad = on_rig();
    let clean = calibrated(&bad);
    let mut unwrapped = on_rig();
    for column in encoders(&bad) {
        unwrapped.map(column, |angle| if angle < 0.0 { angle + TAU } else { angle });
    }
    for (found, clean) in calibrated(&unwrapped).iter().zip(&clean) {
        assert!((found - clean).abs() < 1e-9 * (1.0 + clean.abs()), "{found} {clean}");
    }
}

#[test]
fn encoders_in_degrees_are_said_to_be_so_and_the_field_forms_are_used() {
    let mut bad = on_rig();
    for column in encoders(&bad) {
        bad.map(column, f64::to_degrees);
    }
    let ended = bad.calibrate().with(0);
    ended.printing(&["the rig is not used", "expected −π to π", "[units] gimbal = \"deg\""]);
    assert_eq!(models(&bad), ["T9", "K9", "E9"]);
    // Said so in the manifest, they are what they were.
    let clean = calibrated(&on_rig());
    bad.manifest("gimbal = \"rad\"", "gimbal = \"deg\"");
    for (found, clean) in calibrated(&bad).iter().zip(&clean) {
        assert!((found - clean).abs() < 1e-9 * (1.0 + clean.abs()), "{found} {clean}");
    }
}

#[test]
fn encoders_missing_for_a_stretch_cost_that_stretch_alone() {
    let mut bad = on_rig();
    let clean = calibrated(&bad);
    let columns = encoders(&bad);
    for row in &mut bad.rows[3000..3300] {
        columns.iter().for_each(|column| row[*column].clear());
    }
    let found = calibrated(&bad);
    let json = bad.json();
    assert!(json["sensors"]["acc"]["observations"].as_u64().is_some_and(|poses| (22..24).contains(&poses)));
    assert!(json["sensors"]["gyr"]["left_out"].to_string().contains("no attitude is known"), "{json}");
    for (k, (found, clean)) in found.iter().zip(&clean).enumerate().filter(|(k, _)| k % 12 < 9) {
        assert!((found - clean).abs() < 0.01 * clean.abs().max(1e-4), "{k}: {found} {clean}");
    }
}

#[test]
fn without_encoders_the_field_forms_are_used_with_a_warning() {
    let mut bad = on_rig();
    let columns = encoders(&bad);
    for row in &mut bad.rows[1..] {
        columns.iter().for_each(|column| row[*column].clear());
    }
    bad.calibrate().with(0).printing(&["the rig is not used", "no row holds all three encoder angles"]);
    assert_eq!(models(&bad), ["T9", "K9", "E9"]);
}

#[test]
fn poses_in_gimbal_lock_are_refused_and_the_lock_is_named() {
    // The middle gimbal at a right angle: outer and inner gimbal turn about one axis.
    let at: Vec<_> =
        (0..24).map(|k| Vector3::new(0.3 * f64::from(k) - PI, FRAC_PI_2, 0.5 * f64::from(k % 7))).collect();
    let bad = Bad::of(&simulated::on_rig(&at));
    let ended = bad.calibrate();
    let json = bad.json();
    for kind in ["acc", "mag"] {
        let sensor = &json["sensors"][kind];
        assert_eq!(sensor["status"], "refused", "{kind}: {ended:#?}");
        let reason = sensor["reason"].as_str().expect("a reason");
        assert!(["poor-coverage", "ill-conditioned", "not-redundant"].contains(&reason), "{reason}");
    }
    ended.printing(&["gimbal lock", "turn all three gimbals"]);
}

#[test]
fn without_a_reference_attitude_the_field_forms_are_used() {
    let mut recording = simulated::small();
    recording.reference = Some(vec![[f64::NAN; 4]; recording.rows()]);
    let bad = Bad::of(&recording);
    bad.calibrate().with(0).printing(&["the reference attitude is not used", "ref_qw", "export it again"]);
    assert_eq!(models(&bad), ["T9", "K9", "E9"]);
}

//! Recordings that cannot answer, or only in part: never a confident answer from them.

use imucal_host::recording::{Recording, SensorKind, manifest::Axis};
use imucal_host::simulator::{Programme, Simulation};
use nalgebra::Vector3;
use serde_json::Value;

use super::{Folder, afflicted, causes, rates, remarks, without_rig};

/// No cause, nothing closed, and a reason in words with these parts.
fn assert_refused(diagnosis: &Value, parts: &[&str]) {
    assert_eq!(diagnosis["verdict"], "not-testable", "{diagnosis:#}");
    assert!(causes(diagnosis).is_empty() && diagnosis["gap_closed_total"].is_null());
    assert!(diagnosis["credible_set"].as_array().unwrap().is_empty());
    let remarks = remarks(diagnosis);
    for part in parts {
        assert!(remarks.contains(part), "`{part}` is missing in {remarks}");
    }
}

/// Effects that are said to be not testable.
fn not_testable(diagnosis: &Value) -> Vec<&str> {
    let list = diagnosis["not_testable"].as_array().expect("a list");
    list.iter().filter_map(|entry| entry["effect"].as_str()).collect()
}

fn absent(diagnosis: &Value) -> Vec<&str> {
    let list = diagnosis["absent"].as_array().expect("a list");
    list.iter().filter_map(|entry| entry["effect"].as_str()).collect()
}

/// Rows of every column from one on, to another.
fn cut(recording: &mut Recording, from: usize, to: usize) {
    recording.time = recording.time[from..to].to_vec();
    for triple in [&mut recording.acc, &mut recording.gyr, &mut recording.mag].into_iter().flatten() {
        triple.values = triple.values[from..to].to_vec();
    }
    recording.temperature = recording.temperature.as_ref().map(|column| column[from..to].to_vec());
    recording.gimbal = recording.gimbal.as_ref().map(|column| column[from..to].to_vec());
}

#[test]
fn without_rig_and_reference_a_motion_is_not_testable() {
    let folder = Folder::with(&rates(4), |recording| {
        without_rig(recording);
        // Turning throughout: no rest whose attitude could be determined.
        cut(recording, 40 * 50, 100 * 50);
    });
    assert_refused(&folder.diagnosed(1), &["gimbal_outer"]);
}

#[test]
fn a_rig_whose_axes_are_not_named_is_not_testable() {
    let folder = Folder::with(&rates(4), |recording| {
        recording.manifest.rig.iter_mut().for_each(|rig| rig.axes = None);
    });
    assert_refused(&folder.diagnosed(1), &["axes"]);
}

#[test]
fn a_recording_of_a_few_seconds_is_not_testable() {
    let folder = Folder::with(&rates(4), |recording| cut(recording, 20 * 50, 32 * 50));
    assert_refused(&folder.diagnosed(1), &["short"]);
}

#[test]
fn an_unreadable_recording_of_two_rows_does_not_panic() {
    let folder = Folder::with(&rates(4), |recording| cut(recording, 0, 2));
    assert_refused(&folder.diagnosed(1), &[]);
}

#[test]
fn without_revisits_the_cost_is_said() {
    // It ends before it comes back to where it began.
    let folder = Folder::with(&rates(4), |recording| cut(recording, 0, 45 * 50));
    let ended = folder.run("diagnose run.csv --json -");
    let diagnosis: Value = serde_json::from_str(&ended.out).expect("JSON");
    assert!(causes(&diagnosis).is_empty(), "{diagnosis:#}");
    assert!(remarks(&diagnosis).contains("revisit"), "{diagnosis:#}");
}

#[test]
fn at_constant_temperature_its_effects_are_not_testable() {
    let folder = Folder::with(&rates(4), |recording| {
        recording.temperature.iter_mut().flatten().for_each(|degrees| *degrees = 25.0);
    });
    let diagnosis = folder.diagnosed(0);
    for kind in SensorKind::ALL {
        for name in ["temp_bias", "temp_bias_quadratic", "temp_scale"] {
            let id = format!("{kind}.{name}");
            assert!(not_testable(&diagnosis).contains(&id.as_str()), "{id}: {diagnosis:#}");
            assert!(!absent(&diagnosis).contains(&id.as_str()) && !causes(&diagnosis).contains(&id.as_str()));
        }
    }
}

#[test]
fn without_a_thermometer_effects_of_temperature_are_not_testable() {
    let folder = Folder::with(&rates(4), |recording| recording.temperature = None);
    let diagnosis = folder.diagnosed(0);
    assert!(not_testable(&diagnosis).contains(&"acc.temp_bias"), "{diagnosis:#}");
    assert!(!absent(&diagnosis).contains(&"acc.temp_bias"));
}

#[test]
fn with_one_sensor_only_the_others_effects_are_neither_causes_nor_absent() {
    for kind in SensorKind::ALL {
        let folder = Folder::with(&rates(4), |recording| {
            for other in SensorKind::ALL.into_iter().filter(|other| *other != kind) {
                match other {
                    SensorKind::Acc => recording.acc = None,
                    SensorKind::Gyr => recording.gyr = None,
                    SensorKind::Mag => recording.mag = None,
                }
            }
        });
        let diagnosis = folder.diagnosed(0);
        assert!(causes(&diagnosis).is_empty(), "{kind}: {diagnosis:#}");
        for other in SensorKind::ALL.into_iter().filter(|other| *other != kind) {
            let own = format!("{other}.");
            assert!(absent(&diagnosis).iter().all(|id| !id.starts_with(&own)), "{kind}: {diagnosis:#}");
        }
        let gap = diagnosis["gap"].as_array().unwrap();
        assert!(!gap.is_empty() && gap.iter().all(|channel| channel["sensor"] == kind.prefix()));
    }
}

#[test]
fn a_rig_with_its_axes_in_another_order_is_reported_instead_of_explained() {
    let folder = Folder::with(&rates(4), |recording| {
        recording.manifest.rig.iter_mut().for_each(|rig| rig.axes = Some(vec![Axis::X, Axis::Y, Axis::Z]));
    });
    assert_refused(&folder.diagnosed(1), &["axes = [\"z\", \"y\", \"x\"]"]);
}

#[test]
fn samples_that_are_noise_alone_are_not_explained() {
    let folder = Folder::with(&rates(4), |recording| {
        // No seed is needed: a chaotic sequence will do.
        let mut x = 0.3;
        let mut next = || {
            x = 3.99 * x * (1.0 - x);
            20.0 * (x - 0.5)
        };
        recording
            .acc
            .iter_mut()
            .flat_map(|acc| &mut acc.values)
            .for_each(|v| *v = Vector3::from_fn(|_, _| next()));
    });
    let ended = folder.run("diagnose run.csv --json -");
    let diagnosis: Value = serde_json::from_str(&ended.out).expect("JSON");
    assert_refused(&diagnosis, &["acc"]);
}

#[test]
fn swapped_columns_are_named_with_their_code() {
    let folder = Folder::of(afflicted(rates(4), "gyr.axis_swap", 17.0).record("run.csv"));
    let diagnosis = folder.diagnosed(0);
    assert_eq!(causes(&diagnosis), ["gyr.axis_swap"], "{diagnosis:#}");
    assert_eq!(diagnosis["causes"][0]["parameters"][0]["value"], 17.0);
}

#[test]
fn stretches_without_samples_change_no_answer() {
    let simulation = rates(4);
    let folder = Folder::with(&simulation, |recording| {
        for triple in [&mut recording.acc, &mut recording.gyr, &mut recording.mag].into_iter().flatten() {
            triple.values[2000..2400].fill(Vector3::repeat(f64::NAN));
            triple.values.iter_mut().step_by(97).for_each(|value| value.y = f64::NAN);
        }
        recording.gimbal.iter_mut().flatten().skip(5000).take(100).for_each(|row| *row = [f64::NAN; 3]);
    });
    let diagnosis = folder.diagnosed(0);
    assert_eq!(diagnosis["verdict"], "none", "{diagnosis:#}");
}

#[test]
fn a_sensor_of_which_nothing_was_measured_is_left_out() {
    let folder = Folder::with(&rates(4), |recording| {
        recording.mag.iter_mut().flat_map(|mag| &mut mag.values).for_each(|v| *v = Vector3::repeat(f64::NAN));
    });
    let ended = folder.run("diagnose run.csv --json -");
    assert!(ended.status == 0 || ended.status == 1, "{ended:#?}");
    let diagnosis: Value = serde_json::from_str(&ended.out).expect("JSON");
    assert!(causes(&diagnosis).iter().all(|id| !id.starts_with("mag.")), "{diagnosis:#}");
    assert!(absent(&diagnosis).iter().all(|id| !id.starts_with("mag.")), "{diagnosis:#}");
}

#[test]
fn rests_in_one_attitude_name_no_cause() {
    // Rests are stretched, so that the first lasts for minutes.
    let simulation = Simulation {
        programme: Programme::MultiPosition,
        rate: 10.0,
        duration: Some(4000.0),
        seed: 6,
        ..Simulation::default()
    };
    let folder = Folder::with(&simulation, |recording| cut(recording, 0, 1000));
    let ended = folder.run("diagnose run.csv --json -");
    let diagnosis: Value = serde_json::from_str(&ended.out).expect("JSON");
    assert!(causes(&diagnosis).is_empty(), "{diagnosis:#}");
}

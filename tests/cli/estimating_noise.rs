//! `imucal noise`: coefficients with intervals, refusals with figures, settings of other programs.

use imucal_host::allan::drawn::{Drawn, Source};
use nalgebra::Vector3;
use serde_json::Value;

use super::Folder;

const MANIFEST: &str = "format = \"imucal-recording/1\"\n[units]\nt = \"s\"\nacc = \"m/s^2\"\ngyr = \"rad/s\"\n\
                        [sensor]\nname = \"board\"\nserial = \"7\"\n";

/// Rates of a still gyroscope at 50 Hz and a still accelerometer, changed by `also`.
pub(super) fn still(
    folder: &Folder,
    rows: u32,
    also: impl Fn(f64, &mut Vector3<f64>, &mut Vector3<f64>) -> bool,
) {
    let mut gyr = Source::new(Drawn { white: 1e-3, walk: 2e-6, ..Drawn::default() }, 1);
    let mut acc = Source::new(Drawn { white: 5e-3, flicker: 1e-3, ..Drawn::default() }, 2);
    let mut text = String::from("t,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z\n");
    for row in 0..rows {
        let time = f64::from(row) / 50.0;
        let (mut f, mut w) = (acc.sample() + Vector3::z() * 9.81, gyr.sample() + Vector3::x() * 0.01);
        if also(time, &mut f, &mut w) {
            text += &format!("{time},{:.7},{:.7},{:.7},{:.8},{:.8},{:.8}\n", f.x, f.y, f.z, w.x, w.y, w.z);
        }
    }
    folder.write("still.csv", text);
    folder.write("still.toml", MANIFEST);
}

fn json(folder: &Folder, name: &str) -> Value {
    serde_json::from_slice(&folder.bytes(name)).expect("JSON")
}

#[test]
fn coefficients_have_intervals_and_what_is_not_seen_has_a_reason() {
    let folder = Folder::new();
    still(&folder, 100_000, |_, _, _| true);
    let parts = ["gyroscope: 100000 samples at 50.00 Hz", "N rad/s/sqrt(Hz)", "no Q quantisation"];
    folder.run("noise still.csv --json noise.json").with(0).printing(&parts);
    let json = json(&folder, "noise.json");
    assert_eq!(json["format"], "imucal-noise/1");
    assert_eq!((&json["name"], &json["serial"]), (&"board".into(), &"7".into()));
    let axis = &json["gyr"]["axes"][0];
    let truth = 1e-3 / 50f64.sqrt();
    let ends = &axis["white"]["interval"];
    assert!(ends[0].as_f64().unwrap() < 1.01 * truth && 0.99 * truth < ends[1].as_f64().unwrap(), "{axis}");
    assert!((axis["mean"].as_f64().unwrap() - 0.01).abs() < 1e-3);
    assert!(axis["random_walk"]["value"].is_number(), "{}", axis["random_walk"]);
    let hidden = &axis["quantisation"];
    assert!(
        hidden["value"].is_null() && hidden["reason"].as_str().unwrap().contains("standard errors from zero")
    );
    assert_eq!(axis["allan"][0]["samples"], 1);
    assert!(folder.run("noise still.csv --json noise.json").with(2).err.contains("--force"));
    folder.run("noise still.csv --json noise.json --force").with(0);
}

#[test]
fn a_recording_that_moved_is_refused_with_its_time() {
    let folder = Folder::new();
    still(&folder, 30_000, |time, _, w| {
        if (200.0..202.0).contains(&time) {
            w.z += 0.8;
        }
        true
    });
    let refused = folder.run("noise still.csv --json noise.json").with(1);
    let refused = refused.telling(&["refused", "blocks of a second moved", "record the sensor untouched"]);
    assert!(refused.err.contains("at 200.0 s") || refused.err.contains("at 199."), "{}", refused.err);
    let json = json(&folder, "noise.json");
    assert_eq!((&json["gyr"]["reason"], &json["acc"]["reason"]), (&"not-still".into(), &"moved-with".into()));
}

#[test]
fn a_short_recording_is_refused_and_a_longer_one_leaves_the_slow_noise_open() {
    let folder = Folder::new();
    still(&folder, 200, |_, _, _| true);
    folder.run("noise still.csv").with(1).telling(&[
        "found 200 samples",
        "expected at least 256",
        "record longer",
    ]);
    still(&folder, 1500, |_, _, _| true);
    folder.run("noise still.csv --json noise.json").with(0);
    let axis = &json(&folder, "noise.json")["gyr"]["axes"][1];
    assert!(axis["white"]["value"].is_number() && axis["random_walk"]["value"].is_null(), "{axis}");
    assert!(axis["correlation_time"]["value"].is_null() && axis["correlation_time"]["reason"].is_string());
}

#[test]
fn gaps_and_lost_samples_are_bridged_with_a_warning() {
    let folder = Folder::new();
    still(&folder, 40_000, |time, _, _| {
        !(300.0..340.0).contains(&time) && (time * 50.0).round() as u32 % 997 != 500
    });
    let warned = folder.run("noise still.csv --json noise.json").with(0);
    warned.telling(&["samples are missing from", "bridged by straight lines, 1 longer gaps (up to 40."]);
    let json = json(&folder, "noise.json");
    let density = json["gyr"]["axes"][2]["white"]["value"].as_f64().unwrap();
    assert!((density / (1e-3 / 50f64.sqrt()) - 1.0).abs() < 0.03, "{density}");
    assert!(
        json["warnings"].as_array().unwrap().iter().any(|text| text.as_str().unwrap().contains("missing"))
    );
    still(&folder, 20_000, |time, _, _| (time * 50.0).round() as u32 % 10 != 3);
    folder.run("noise still.csv").with(1).telling(&["samples are missing, expected at most 5 %"]);
}

#[test]
fn a_filter_and_repeated_values_leave_the_density_as_it_is() {
    use std::cell::Cell;
    let folder = Folder::new();
    let density = |name: &str| -> f64 {
        let axis = &json(&folder, name)["gyr"]["axes"][1];
        axis["white"]["value"].as_f64().unwrap_or_else(|| panic!("{axis}"))
    };
    let truth = 1e-3 / 50f64.sqrt();
    let filtered = Cell::new(Vector3::zeros());
    still(&folder, 60_000, |_, _, w| {
        filtered.set(filtered.get() + (*w - filtered.get()) * 0.6);
        *w = filtered.get();
        true
    });
    let warned = folder.run("noise still.csv --json filtered.json").with(0);
    warned.telling(&["gyr, axis y: averages below", "as after a filter"]);
    assert!((density("filtered.json") / truth - 1.0).abs() < 0.06, "{}", density("filtered.json"));
    // Read four times before it changes: the same values at a quarter of the rate.
    let (count, held) = (Cell::new(0), Cell::new(Vector3::zeros()));
    still(&folder, 60_000, |_, _, w| {
        if count.get() % 4 == 0 {
            held.set(*w);
        }
        count.set(count.get() + 1);
        *w = held.get();
        true
    });
    let warned = folder.run("noise still.csv --json repeated.json").with(0);
    warned.telling(&["gyr: each value is read 4.0 times on average"]);
    // What is held smooths averages of four repetitions by a sixteenth.
    assert!((density("repeated.json") / (2.0 * truth) - 1.0).abs() < 0.1, "{}", density("repeated.json"));
}

#[test]
fn an_axis_that_rounding_stills_has_no_coefficients() {
    let folder = Folder::new();
    still(&folder, 2000, |_, f, _| {
        f.x = 0.125;
        true
    });
    folder.run("noise still.csv --json noise.json").with(0).telling(&["acc, axis x: all samples are 0.125"]);
    let json = json(&folder, "noise.json");
    assert!(json["acc"]["axes"][0].is_null() && json["acc"]["axes"][1].is_object());
}

#[test]
fn kalibr_and_gazebo_have_the_same_density_each_in_its_own_convention() {
    let folder = Folder::new();
    still(&folder, 60_000, |_, _, _| true);
    let yaml = folder.run("noise still.csv --to kalibr").with(0).out;
    let of = |key: &str| -> f64 {
        let line = yaml.lines().find(|line| line.starts_with(key)).unwrap_or_else(|| panic!("{yaml}"));
        line.split_whitespace().nth(1).and_then(|value| value.parse().ok()).expect("a number")
    };
    let density = of("gyroscope_noise_density:");
    assert!((density / (1e-3 / 50f64.sqrt()) - 1.0).abs() < 0.02 && of("update_rate:").round() == 50.0);
    let sdf = folder.run("noise still.csv --to sdf").with(0).out;
    let deviations: Vec<f64> =
        sdf.split("<stddev>").skip(1).map(|part| part.split('<').next().unwrap().parse().unwrap()).collect();
    assert_eq!(deviations.len(), 6);
    // A sample's, not a density: white noise of 1e-3 was drawn.
    assert!(deviations[3..].iter().all(|deviation| (deviation / 1e-3 - 1.0).abs() < 0.02), "{sdf}");
    assert!(sdf.contains("<bias_mean>0</bias_mean>"));
    folder.run("noise still.csv --to json").with(0).printing(&["imucal-noise/1"]);
}

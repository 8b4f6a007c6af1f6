//! `imucal export` and `imucal corrupt`: other programs' files, and what a unit would have read.

use std::process::Command;

use imucal_tests::program::available;
use serde_json::Value;

use super::{Folder, estimating_noise::still, imucal};

/// Targets that take raw values in any unit, and those that take no counts.
const ANY: [&str; 5] = ["kalibr", "sdf", "python", "c-header", "csv"];
const SI: [&str; 3] = ["ros", "px4", "ardupilot"];

#[test]
fn every_target_is_written_with_what_it_cannot_say() {
    let folder = Folder::with_calibration();
    still(&folder, 30_000, |_, _, _| true);
    folder.run("noise still.csv --json noise.json").with(0);
    for target in ANY {
        let name = format!("{target}.out");
        let noise = if target == "c-header" { "" } else { "--noise noise.json" };
        let written = folder.run(&format!("export cal.toml {noise} --to {target} --out {name}")).with(0);
        let said = written.out.lines().filter(|line| line.starts_with("  - ")).count();
        let text = folder.text(&name);
        assert!(said > 0 && text.contains("What this file cannot say:"), "{target}: {text}");
        folder
            .run(&format!("export cal.toml {noise} --to {target} --out {name}"))
            .with(2)
            .telling(&["--force"]);
    }
    for target in SI {
        let refused = folder.run(&format!("export cal.toml --to {target} --out {target}.out")).with(1);
        refused.telling(&["takes counts", "calibrate a recording in m/s^2"]);
        assert!(!folder.path(&format!("{target}.out")).exists());
    }
    // The record is the same calibration; only the digits of f32 are left.
    folder
        .run("export cal.bin --to c-header")
        .with(0)
        .printing(&["static const imucal_triad imucal_acc", "-ffp-contract=off"]);
}

#[test]
fn a_target_without_what_it_needs_is_a_refusal() {
    let folder = Folder::with_calibration();
    folder.run("export cal.toml --to kalibr").with(1).telling(&["kalibr: found no noise", "add --noise"]);
    folder.run("export cal.toml --to matlab").with(2);
    folder.write("noise.json", "{\"format\": \"imucal-calibration/1\"}");
    folder.run("export cal.toml --noise noise.json --to sdf").with(2).telling(&["expected `imucal-noise/1`"]);
    still(&folder, 6_000, |_, _, _| true);
    folder.run("noise still.csv --json still.json").with(0);
    folder
        .run("export cal.toml --noise still.json --to px4")
        .with(2)
        .telling(&["--noise: found another target", "no place for noise"]);
    folder.write("diagnosis.json", "{}");
    folder
        .run("export cal.toml --diagnosis diagnosis.json --to csv")
        .with(2)
        .telling(&["imucal-diagnosis/1"]);
}

/// Draws units and prints the standard deviations of all entries, and the covariance of those that were estimated together.
const DRAW: &str = "import json, sys, numpy as np, unit
kind, count = sys.argv[1], int(sys.argv[2])
rng = np.random.default_rng(1)
drawn = [unit.sample_unit(rng)[kind] for _ in range(count)]
all = np.array([np.concatenate([np.ravel(t['gain']), t['bias']]) for t in drawn])
print(json.dumps([all.std(axis=0).tolist(), np.cov(all[:, unit.UNIT[kind]['entries']].T).tolist()]))";

#[test]
fn units_that_are_drawn_vary_together_as_the_errors_do() {
    let python = std::env::var("IMUCAL_PYTHON").unwrap_or_else(|_| "python3".into());
    if !available(&python, &["-c", "import numpy"], "Python with numpy (IMUCAL_PYTHON names one)", false) {
        return;
    }
    let folder = Folder::with_recording();
    folder.run("calibrate small.csv --out cal.toml --json cal.json").with(0);
    folder.run("export cal.toml --covariance cal.json --to python --out unit.py").with(0);
    let found: Value = serde_json::from_str(&folder.text("cal.json")).expect("JSON");
    for kind in ["acc", "gyr"] {
        let drawn = Command::new(&python)
            .current_dir(folder.path("."))
            .args(["-c", DRAW, kind, "4000"])
            .output()
            .expect("it runs");
        assert!(drawn.status.success(), "{}", String::from_utf8_lossy(&drawn.stderr));
        let [stds, drawn]: [Value; 2] = serde_json::from_slice(&drawn.stdout).expect("JSON");
        // A gyroscope's bias is of its rests, and not among the entries of its covariance.
        let (gain, bias) = (&found["sensors"][kind]["gain_std"], &found["sensors"][kind]["bias_std"]);
        for entry in 0..12 {
            let std = if entry < 9 { &gain[entry / 3][entry % 3] } else { &bias[entry - 9] };
            let (drawn, stated) = (stds[entry].as_f64().expect("a number"), std.as_f64().expect("a number"));
            assert!((drawn - stated).abs() <= 0.05 * stated, "{kind} {entry}: {drawn} of {stated}");
        }
        let stated = &found["sensors"][kind]["covariance"];
        let entry = |of: &Value, i: usize, j: usize| of[i][j].as_f64().expect("a number");
        let count = stated.as_array().expect("rows").len();
        assert!(count >= 9);
        for (i, j) in (0..count).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            // 4000 units know a correlation, and a variance over itself, to 0.02.
            let size = (entry(stated, i, i) * entry(stated, j, j)).sqrt();
            let off = (entry(&drawn, i, j) - entry(stated, i, j)) / size;
            assert!(off.abs() < 0.1, "{kind} {i} {j}: {off}");
        }
    }
    // Some errors are far from independent, so that a draw of each by itself would not pass.
    let acc = &found["sensors"]["acc"]["covariance"];
    let entry = |i: usize, j: usize| acc[i][j].as_f64().expect("a number");
    let correlation = |(i, j): (usize, usize)| entry(i, j) / (entry(i, i) * entry(j, j)).sqrt();
    let pairs = (0..9).flat_map(|i| (0..i).map(move |j| (i, j)));
    assert!(pairs.map(|pair| correlation(pair).abs()).fold(0.0, f64::max) > 0.2);
}

#[test]
fn covariances_of_another_calibration_or_for_another_target_are_refused() {
    let folder = Folder::with_recording();
    folder.run("calibrate small.csv --out cal.toml --json cal.json").with(0);
    let given = "--covariance cal.json";
    folder.run(&format!("export cal.toml {given} --to csv")).with(2).telling(&["expected `python`"]);
    folder.replace("cal.toml", "bias = [", "bias = [1");
    folder.run(&format!("export cal.toml {given} --to python")).with(2).telling(&["another bias of acc"]);
    folder.write("cal.json", "{\"format\": \"imucal-noise/1\", \"sensors\": {}}");
    folder.run(&format!("export cal.toml {given} --to python")).with(2).telling(&["imucal-calibration/1"]);
}

#[test]
fn a_covariance_that_is_none_is_refused_with_its_fault() {
    /// Damages a sensor's part of the file.
    type Damage = fn(&mut Value);
    let faults: [(Damage, &str); 7] = [
        (|acc| acc["covariance_of"][1] = "gain_99".into(), "an unknown entry `gain_99`"),
        (|acc| acc["covariance_of"][1] = acc["covariance_of"][0].clone(), "twice"),
        (|acc| acc["covariance"][2] = serde_json::json!([1.0]), "a row of 1 numbers for 9 entries"),
        (|acc| drop(acc["covariance"].as_array_mut().and_then(Vec::pop)), "8 rows for 9 entries"),
        (|acc| acc["covariance"][4][4] = Value::Null, "null in place of a number"),
        (|acc| acc["covariance_of"] = Value::Null, "no covariance_of"),
        (|acc| acc["gain"] = Value::Null, "no gain"),
    ];
    let folder = Folder::with_recording();
    folder.run("calibrate small.csv --out cal.toml --json cal.json").with(0);
    let whole: Value = serde_json::from_str(&folder.text("cal.json")).expect("JSON");
    for (damage, fault) in faults {
        let mut damaged = whole.clone();
        damage(&mut damaged["sensors"]["acc"]);
        folder.write("cal.json", damaged.to_string());
        let run = folder.run("export cal.toml --covariance cal.json --to python").with(2);
        run.telling(&["cal.json", fault, "covariance of acc", "a square matrix of numbers"]);
    }
}

#[test]
fn what_a_diagnosis_found_is_listed_with_its_sizes() {
    let folder = Folder::with_calibration();
    let rig = folder.path("rig.csv");
    let words = ["simulate", "--effect", "mag.bias_step=5", "--out"];
    imucal(&[&words.map(str::as_ref)[..], &[rig.as_os_str()]].concat()).with(0);
    folder.run("diagnose rig.csv --json gap.json");
    let found: Value = serde_json::from_str(&folder.text("gap.json")).expect("JSON");
    let causes = found["causes"].as_array().expect("a list");
    assert!(causes.iter().any(|cause| cause["effect"] == "mag.bias_step"), "{found:#}");
    let mut written = folder.run("export cal.toml --diagnosis gap.json --to csv --out cal.csv").with(0);
    let text = folder.text("cal.csv");
    for cause in causes {
        let effect = cause["effect"].as_str().expect("text");
        let amounts = cause["parameters"].as_array().into_iter().flatten();
        let sizes = amounts.filter_map(|amount| amount["value"].as_f64()).map(|value| format!("{value:.4e}"));
        for said in sizes.chain([format!("what the diagnosis found: {effect}")]) {
            assert!(text.contains(&said), "{said}: {text}");
        }
        written = written.printing(&[effect]);
    }
}

#[test]
fn the_rate_of_a_target_is_that_of_its_samples() {
    let folder = Folder::with_calibration();
    still(&folder, 30_000, |_, _, _| true);
    folder.run("noise still.csv --json noise.json").with(0);
    let deviation = |rate: &str| -> f64 {
        let line = format!("export cal.toml --noise noise.json --to sdf{rate}");
        let text = folder.run(&line).with(0).out;
        text.split("<stddev>").nth(1).and_then(|part| part.split('<').next()?.parse().ok()).expect("a number")
    };
    let ratio = deviation(" --rate 200") / deviation("");
    assert!((ratio - 2.0).abs() < 1e-3, "{ratio}");
    folder.run("export cal.toml --noise noise.json --to sdf --rate -5").with(2);
    folder.run("export cal.toml --noise noise.json --to sdf --rate 0").with(1).telling(&["--rate: found 0"]);
    folder.run("export cal.toml --to c-header --rate 50").with(2).telling(&["--rate: found another target"]);
}

#[test]
fn a_header_of_a_unit_without_a_name_says_that_it_is_unknown() {
    let folder = Folder::with_calibration();
    let named = folder.text("cal.toml");
    let unnamed = |line: &str| match line.split_once(" = ") {
        Some((key @ ("name" | "serial"), _)) => format!("{key} = \"\""),
        _ => line.to_owned(),
    };
    let text: Vec<String> = named.lines().map(unnamed).collect();
    folder.write("unnamed.toml", text.join("\n") + "\n");
    folder
        .run("export unnamed.toml --to c-header")
        .with(0)
        .printing(&["Sensor unknown, serial unknown, calibrated on"]);
}

#[test]
fn what_is_corrupted_and_applied_is_the_ideal_stream() {
    let folder = Folder::with_calibration();
    folder.run("apply small.csv --calibration cal.bin --out ideal.csv").with(0);
    folder
        .run("corrupt ideal.csv --calibration cal.bin --out as-read.csv")
        .with(0)
        .printing(&["rows corrupted into"]);
    folder.run("apply as-read.csv --calibration cal.bin --out back.csv").with(0);
    let rows = |name: &str| -> Vec<Vec<f64>> {
        let text = folder.text(name);
        text.lines()
            .skip(1)
            .map(|line| line.split(',').filter_map(|field| field.parse().ok()).collect())
            .collect()
    };
    let (ideal, back) = (rows("ideal.csv"), rows("back.csv"));
    assert!(ideal.len() > 1000 && ideal.len() == back.len());
    for (one, other) in ideal.iter().zip(&back) {
        let near = |(a, b): (&f64, &f64)| (a - b).abs() < 2e-5 * a.abs().max(1.0);
        assert!(one.len() == other.len() && one.iter().zip(other).all(near), "{one:?} {other:?}");
    }
    assert!(!folder.text("as-read.toml").contains("[calibrated]"));
    folder.run("corrupt small.csv --calibration cal.bin --out twice.csv").with(1).telling(&[
        "refused",
        "small.csv",
        "acc is in counts",
        "imucal apply",
    ]);
    folder.run("corrupt ideal.csv --calibration cal.bin --out as-read.csv").with(2).telling(&["--force"]);
    folder.run("corrupt ideal.csv --calibration cal.bin --out other.csv --seed 3").with(2);
}

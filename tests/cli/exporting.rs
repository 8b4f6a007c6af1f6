//! `imucal export` and `imucal corrupt`: other programs' files, and what a unit would have read.

use super::{Folder, estimating_noise::still};

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
        let written =
            folder.run(&format!("export cal.toml --noise noise.json --to {target} --out {name}")).with(0);
        let said = written.out.lines().filter(|line| line.starts_with("  - ")).count();
        let text = folder.text(&name);
        assert!(said > 0 && text.contains("What this file cannot say:"), "{target}: {text}");
        folder
            .run(&format!("export cal.toml --noise noise.json --to {target} --out {name}"))
            .with(2)
            .telling(&["--force"]);
    }
    for target in SI {
        let refused = folder
            .run(&format!("export cal.toml --noise noise.json --to {target} --out {target}.out"))
            .with(1);
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
    folder.write("diagnosis.json", "{}");
    folder
        .run("export cal.toml --diagnosis diagnosis.json --to csv")
        .with(2)
        .telling(&["imucal-diagnosis/1"]);
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
    folder.run("corrupt ideal.csv --calibration cal.bin --out as-read.csv").with(2).telling(&["--force"]);
    folder.run("corrupt ideal.csv --calibration cal.bin --out other.csv --seed 3").with(2);
}

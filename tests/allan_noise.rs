//! Noise of a recording at rest: against AllanTools, by the coverage of its intervals, and in memory that does not grow.

use imucal_host::allan::{
    cascade::Cascade,
    coefficients::{Coefficient, Estimator, Sums},
    covariance::Products,
    drawn::{Drawn, cascade},
    process::Kind,
};
use imucal_tests::golden::{golden, number};
use nalgebra::{DVector, Vector3};
use rayon::prelude::*;

/// The oracle's numbers: `tests/oracle/allan_deviation.py`.
fn numbers(count: usize, seed: u64) -> Vec<f64> {
    let mut state = seed;
    let next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 48) as f64 / 65_536.0 - 0.5
    };
    std::iter::repeat_with(next).take(count).collect()
}

#[test]
fn overlapping_allan_deviations_are_those_of_allantools() {
    let golden = golden("allan_deviation");
    let count = number(&golden["count"]) as usize;
    let white = numbers(count, 1);
    let walk: Vec<f64> = numbers(count, 2)
        .into_iter()
        .scan(0.0, |sum, step| {
            *sum += step;
            Some(*sum / 64.0)
        })
        .collect();
    let mut cascade = Cascade::default();
    for (white, walk) in white.iter().zip(&walk) {
        cascade.push(&Vector3::new(*white, *walk, white + walk));
    }
    let points = cascade.points();
    for (axis, case) in ["white", "walk", "both"].into_iter().enumerate() {
        let expected = golden["cases"][case].as_array().expect("a list");
        assert!(expected.len() > 25);
        for expected in expected {
            let point = points.iter().find(|point| Some(point.samples) == expected["samples"].as_u64());
            let point = point.unwrap_or_else(|| panic!("no {expected}"));
            let (found, oracle) = (point.variance[axis].sqrt(), number(&expected["deviation"]));
            assert!((found / oracle - 1.0).abs() < 1e-9, "{case} {}: {found} for {oracle}", point.samples);
            assert_eq!(Some(point.terms), expected["terms"].as_u64());
        }
    }
}

#[test]
fn degrees_of_freedom_are_those_that_allantools_has() {
    let golden = golden("allan_deviation");
    for case in golden["degrees"].as_array().expect("a list") {
        let kind = match case["kind"].as_str() {
            Some("quantisation") => Kind::Quantisation,
            Some("white") => Kind::White,
            Some("flicker") => Kind::Flicker,
            _ => Kind::Walk,
        };
        let (m, of) = (number(&case["samples"]), number(&case["of"]));
        let products = Products::new(vec![kind], vec![(m, of + 1.0 - 2.0 * m)]);
        let (found, expected) = (products.freedoms(&DVector::from_element(1, 1.0))[0], number(&case["edf"]));
        // They approximate flicker and walk of short averages by long ones, and white noise by a formula.
        assert!((found / expected - 1.0).abs() < 0.03, "{case}: {found}");
    }
}

/// How often the interval of a coefficient holds the truth, over hours at 10 Hz; all must be seen but for `unseen`.
fn covered(
    drawn: Drawn,
    hours: u64,
    of: impl Fn(&imucal_host::allan::coefficients::Axis) -> (&Coefficient, f64) + Sync,
) -> f64 {
    const ROWS: usize = 36_000;
    let sums = Sums::new(&cascade(ROWS, drawn, 0).points(), ROWS as u64);
    let judged: Vec<bool> = (0..hours)
        .into_par_iter()
        .flat_map_iter(|hour| {
            let points = cascade(ROWS, drawn, 1000 + hour).points();
            let estimator = Estimator::new(&points, &sums, ROWS as u64, 0.1);
            let axes: Vec<bool> = (0..3)
                .map(|axis| {
                    let found = estimator.axis(axis, 0.0, 1.0);
                    let (coefficient, truth) = of(&found);
                    let Coefficient::Known(known) = coefficient else { return false };
                    known.interval.0 <= truth && truth <= known.interval.1
                })
                .collect();
            axes
        })
        .collect();
    judged.iter().filter(|held| **held).count() as f64 / judged.len() as f64
}

const HOURS: u64 = 200;

/// From samples to seconds at 10 Hz.
const STEP: f64 = 0.1;

fn within_bounds(what: &str, share: f64) {
    println!("{what}: {:.1} % of 600 axis-hours", 100.0 * share);
    assert!((0.93..=0.97).contains(&share), "{what}: {share}");
}

#[test]
fn intervals_of_white_noise_hold_the_truth_in_95_of_100_hours() {
    let drawn = Drawn { white: 1.0, flicker: 0.1, walk: 0.01, ..Drawn::default() };
    within_bounds("N", covered(drawn, HOURS, |axis| (&axis.white, STEP.sqrt())));
}

#[test]
fn intervals_of_bias_instability_hold_the_truth_in_95_of_100_hours() {
    let drawn = Drawn { white: 1.0, flicker: 0.2, ..Drawn::default() };
    within_bounds("B", covered(drawn, HOURS, |axis| (&axis.bias_instability, 0.2)));
}

#[test]
fn intervals_of_a_random_walk_hold_the_truth_in_95_of_100_hours() {
    let drawn = Drawn { white: 1.0, walk: 0.01, ..Drawn::default() };
    within_bounds("K", covered(drawn, HOURS, |axis| (&axis.random_walk, 0.01 / STEP.sqrt())));
}

#[test]
fn intervals_of_a_correlation_time_hold_the_truth_in_95_of_100_hours() {
    let drawn = Drawn { white: 1.0, markov: Some((0.5, 200.0)), ..Drawn::default() };
    within_bounds("T", covered(drawn, HOURS, |axis| (&axis.correlation_time, 20.0)));
}

#[cfg(target_os = "linux")]
mod streamed {
    use std::fs::{self, File};
    use std::io::{BufWriter, Write};
    use std::path::Path;
    use std::process::{Command, Stdio};

    /// Memory that a process has had at most, KiB.
    fn peak(process: u32) -> u64 {
        let status = fs::read_to_string(format!("/proc/{process}/status")).expect("it runs");
        let line = status.lines().find(|line| line.starts_with("VmHWM:")).expect("Linux says so");
        line.split_whitespace().nth(1).and_then(|kib| kib.parse().ok()).expect("a number")
    }

    /// Writes so many rows of a gyroscope into the pipe, and gives the memory of who reads them, shortly before the end.
    fn write(pipe: &Path, rows: u64, process: u32) -> u64 {
        let mut out = BufWriter::new(File::create(pipe).expect("a pipe"));
        writeln!(out, "t,gyr_x,gyr_y,gyr_z").expect("it reads");
        // SplitMix64 of the row and axis is noise enough, and quick.
        let noise = |row: u64, axis: u64| {
            let mut hash = (row * 3 + axis + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            hash = (hash ^ (hash >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            hash = (hash ^ (hash >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            (hash >> 44) as i64 - (1 << 19)
        };
        let mut most = 0;
        for row in 0..rows {
            let (seconds, rest) = (row / 2000, row % 2000 * 5);
            writeln!(
                out,
                "{seconds}.{rest:04},{}e-9,{}e-9,{}e-9",
                noise(row, 0),
                noise(row, 1),
                noise(row, 2)
            )
            .expect("it reads");
            if row + 1 == rows {
                most = peak(process);
            }
        }
        out.flush().expect("it reads");
        most
    }

    /// Peak memory, MiB, of estimating the noise of so many rows.
    fn memory(rows: u64) -> f64 {
        let folder = tempfile::tempdir().expect("there is room");
        let pipe = folder.path().join("still.csv");
        assert!(Command::new("mkfifo").arg(&pipe).status().expect("coreutils").success());
        let units = "format = \"imucal-recording/1\"\n[units]\nt = \"s\"\ngyr = \"rad/s\"\n";
        fs::write(folder.path().join("still.toml"), units).expect("it takes files");
        let mut child = Command::new(env!("CARGO_BIN_EXE_imucal-under-test"))
            .args(["noise".as_ref(), pipe.as_os_str(), "--to".as_ref(), "json".as_ref()])
            .stdout(Stdio::piped())
            .spawn()
            .expect("it starts");
        let most = write(&pipe, rows, child.id());
        let out = std::io::read_to_string(child.stdout.take().expect("piped")).expect("text");
        assert!(child.wait().expect("it ends").success(), "{out}");
        let json: serde_json::Value = serde_json::from_str(&out).expect("JSON");
        assert_eq!(json["gyr"]["samples"].as_u64(), Some(rows));
        let density = json["gyr"]["axes"][0]["white"]["value"].as_f64().expect("white noise");
        // Uniform over 2²⁰ nrad/s at 2 kHz.
        let expected = (1 << 20) as f64 * 1e-9 / 12f64.sqrt() / 2000f64.sqrt();
        assert!((density / expected - 1.0).abs() < 0.02, "{density} {expected}");
        most as f64 / 1024.0
    }

    #[test]
    fn a_long_recording_takes_no_more_memory_than_a_short_one() {
        let (short, long) = (memory(200_000), memory(3_000_000));
        println!("200 000 rows: {short:.0} MiB; 3 000 000 rows: {long:.0} MiB");
        assert!(long <= 64.0 && long < short + 16.0, "{short} {long}");
    }

    #[test]
    #[ignore = "takes minutes: a day at 2 kHz"]
    fn a_day_at_2_khz_takes_less_than_64_mib() {
        let most = memory(170_000_000);
        println!("170 000 000 rows: {most:.0} MiB");
        assert!(most <= 64.0, "{most}");
    }
}

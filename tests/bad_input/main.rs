//! Recordings that are wrong in some way end in a message that says where and what to do, or in a calibration that
//! tells what it left out. Never in a panic, a hang or a confident wrong answer.

use std::fs;
use std::path::PathBuf;

use imucal_tests::program::{self, Ended};
use imucal_tests::simulated;
use serde_json::Value;
use tempfile::TempDir;

mod axes;
mod columns_and_units;
mod containers;
mod manifests;
mod motions;
mod mutations;
mod poses;
mod rigs;
mod samples;
#[cfg(unix)]
mod sizes;
mod streams;
mod times;

/// A small recording as text, to be spoilt.
struct Bad {
    /// The header, then rows.
    rows: Vec<Vec<String>>,
    toml: String,
    folder: TempDir,
}

/// Columns of the small recording: t, acc, gyr, mag.
const TIME: usize = 0;
const ACC: usize = 1;
const GYR: usize = 4;
const MAG: usize = 7;

impl Bad {
    fn of(recording: &imucal_host::recording::Recording) -> Self {
        let folder = tempfile::tempdir().expect("there is room for a folder");
        let path = folder.path().join("small.csv");
        recording.write(&path).expect("the folder takes files");
        let text = fs::read_to_string(&path).expect("text");
        let rows = text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect();
        let toml = fs::read_to_string(folder.path().join("small.toml")).expect("text");
        Self { rows, toml, folder }
    }

    fn new() -> Self {
        Self::of(&simulated::small())
    }

    /// Row of a line of the file, from 1; the header is line 1.
    fn line(&mut self, line: usize) -> &mut Vec<String> {
        &mut self.rows[line - 1]
    }

    /// Changes one column's numbers.
    fn map(&mut self, column: usize, change: impl Fn(f64) -> f64) {
        for row in &mut self.rows[1..] {
            row[column] = change(row[column].parse().expect("a number")).to_string();
        }
    }

    /// Replaces in the manifest what must be there.
    fn manifest(&mut self, from: &str, to: &str) {
        assert!(self.toml.contains(from), "no {from} in {}", self.toml);
        self.toml = self.toml.replace(from, to);
    }

    fn text(&self) -> String {
        self.rows.iter().map(|row| row.join(",") + "\n").collect()
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Calibrates what it has become.
    fn calibrate(&self) -> Ended {
        self.calibrate_bytes("small.csv", self.text().as_bytes())
    }

    /// Calibrates these bytes instead.
    fn calibrate_bytes(&self, name: &str, samples: &[u8]) -> Ended {
        fs::write(self.path(name), samples).expect("the folder takes files");
        fs::write(self.path("small.toml"), &self.toml).expect("the folder takes files");
        self.calibrate_file(name)
    }

    fn calibrate_file(&self, name: &str) -> Ended {
        let arguments = [PathBuf::from("calibrate"), self.path(name), "--json".into(), self.path("cal.json")];
        let ended = program::run(env!("CARGO_BIN_EXE_imucal-under-test"), &[], &arguments);
        assert!(!ended.err.contains("panicked") && ended.status >= 0, "{ended:#?}");
        ended
    }

    /// Diagnoses what was last calibrated.
    fn diagnose(&self) -> Ended {
        program::run(
            env!("CARGO_BIN_EXE_imucal-under-test"),
            &[],
            &[PathBuf::from("diagnose"), self.path("small.csv")],
        )
    }

    fn json(&self) -> Value {
        serde_json::from_str(&fs::read_to_string(self.path("cal.json")).expect("written")).expect("JSON")
    }
}

/// Asserts that every accepted sensor's calibration lies within errors of the clean recording's.
fn assert_as_clean(bad: &Bad, kinds: &[&str]) {
    let clean = Bad::new();
    clean.calibrate().with(0);
    let (clean, found) = (clean.json(), bad.json());
    for kind in kinds {
        let (clean, found) = (&clean["sensors"][kind], &found["sensors"][kind]);
        assert_eq!(found["status"], "accepted", "{kind}: {found}");
        let number = |value: &Value| value.as_f64().expect("a number");
        for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
            let change = number(&found["gain"][row][column]) - number(&clean["gain"][row][column]);
            let std = number(&found["gain_std"][row][column]);
            assert!(change.abs() <= 3.0 * std, "{kind} gain {row}{column}: {change:e} of {std:e}");
        }
        for axis in 0..3 {
            let change = number(&found["bias"][axis]) - number(&clean["bias"][axis]);
            let std = number(&found["bias_std"][axis]);
            assert!(change.abs() <= 3.0 * std, "{kind} bias {axis}: {change:e} of {std:e}");
        }
    }
}

const ALL: [&str; 3] = ["acc", "gyr", "mag"];

#[test]
fn the_recording_that_the_others_are_made_of_is_good() {
    let bad = Bad::new();
    let ended = bad.calibrate().with(0);
    assert_eq!(ended.err, "");
    assert_as_clean(&bad, &ALL);
}

//! `imucal diagnose` as its users meet it: the contract of its JSON, exit status, and recordings that cannot answer.

use std::fs;
use std::path::PathBuf;

use imucal_host::{
    effect,
    recording::Recording,
    simulator::{Programme, Simulation, SimulationError},
};
use imucal_tests::program::{self, Ended};
use serde_json::Value;
use tempfile::TempDir;

mod bad_recordings;
mod contract;
mod formulas;
mod printing;
mod user_effects;

/// Takes a rig's angles away, and its axes.
fn without_rig(recording: &mut Recording) {
    recording.gimbal = None;
    recording.manifest.rig = None;
}

/// A short run of rates at 50 Hz: 150 s.
fn rates(seed: u64) -> Simulation {
    Simulation {
        programme: Programme::Rates,
        rate: 50.0,
        duration: Some(150.0),
        seed,
        ..Simulation::default()
    }
}

/// With an effect of a size.
fn afflicted(mut simulation: Simulation, id: &str, size: f64) -> Simulation {
    let effect = effect::find(id).expect("an effect of the catalogue");
    simulation.add(effect, size).expect("a run that can be simulated");
    simulation
}

/// A folder of a test with `run.csv`, gone when dropped.
struct Folder(TempDir);

impl Folder {
    fn of(recording: Result<Recording, SimulationError>) -> Self {
        let folder = Self(tempfile::tempdir().expect("there is room for a folder"));
        recording
            .expect("a run that can be simulated")
            .write(&folder.path("run.csv"))
            .expect("it takes files");
        folder
    }

    fn with(simulation: &Simulation, alter: impl FnOnce(&mut Recording)) -> Self {
        Self::of(simulation.record("run.csv").map(|mut recording| {
            alter(&mut recording);
            recording
        }))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn text(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap_or_else(|cause| panic!("{name}: {cause}"))
    }

    /// Arguments between blanks; those that end in `.csv`, `.toml` or `.json` name files of this folder.
    fn run(&self, line: &str) -> Ended {
        let is_file = |word: &str| [".csv", ".toml", ".json"].iter().any(|ending| word.ends_with(ending));
        let argument = |word: &str| if is_file(word) { self.path(word) } else { word.into() };
        let arguments: Vec<PathBuf> = line.split_whitespace().map(argument).collect();
        program::run(env!("CARGO_BIN_EXE_imucal-under-test"), &[], &arguments)
    }

    /// The diagnosis of `run.csv`, which must end with this status.
    fn diagnosed(&self, status: i32) -> Value {
        let ended = self.run("diagnose run.csv --json -").with(status);
        serde_json::from_str(&ended.out).unwrap_or_else(|cause| panic!("{cause}: {ended:#?}"))
    }
}

/// Ids of the effects that are asserted.
fn causes(diagnosis: &Value) -> Vec<&str> {
    let causes = diagnosis["causes"].as_array().expect("a list");
    causes.iter().map(|cause| cause["effect"].as_str().expect("an id")).collect()
}

/// All remarks in one text.
fn remarks(diagnosis: &Value) -> String {
    let remarks = diagnosis["remarks"].as_array().expect("a list");
    remarks.iter().filter_map(Value::as_str).collect::<Vec<_>>().join("\n")
}

//! Simulated recordings, which are written by parts.

use imucal_host::{
    effect,
    simulator::{Programme, Simulation},
};

use super::{Folder, imucal};

/// At 100 Hz some seconds more than a part has, s.
const DURATION: f64 = 700.0;

/// The recording as the library simulates it, whole.
fn simulation(effects: &[&str]) -> Simulation {
    let mut simulation =
        Simulation { programme: Programme::Mixed, duration: Some(DURATION), ..Simulation::default() };
    for id in effects {
        simulation.add(effect::find(id).expect("an effect"), 1.0).expect("it is simulated");
    }
    simulation
}

#[test]
fn a_recording_of_several_parts_is_the_file_of_the_whole() {
    let folder = Folder::new();
    for (at, effects) in [&[][..], &["acc.lever_arm"]].into_iter().enumerate() {
        let whole = simulation(effects).record("whole.csv").expect("it is simulated");
        whole.write(&folder.path("whole.csv")).expect("room");
        let name = format!("parts-{at}");
        let out = folder.path(&format!("{name}.csv")).display().to_string();
        let duration = DURATION.to_string();
        let mut words = vec!["simulate", "--programme", "mixed", "--duration", &duration, "--out", &out];
        effects.iter().for_each(|id| words.extend(["--effect", id]));
        imucal(&words).with(0).printing(&["70000 rows, 700 s of the programme mixed"]);
        assert!(folder.bytes(&format!("{name}.csv")) == folder.bytes("whole.csv"), "{effects:?}");
        assert_eq!(folder.text(&format!("{name}.toml")), folder.text("whole.toml"), "{effects:?}");
    }
}

#[test]
fn parts_that_cannot_be_written_are_named_and_leave_nothing_behind() {
    let folder = Folder::new();
    let line = format!("simulate --programme mixed --duration {DURATION} --out missing.d/parts.csv");
    folder.run(&line).with(2).telling(&["missing.d", "cannot be written"]);
    assert_eq!(folder.names(), [""; 0]);
}

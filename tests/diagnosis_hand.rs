//! A healthy unit whose rests alone give its attitude: turns of any length between them, and swings about the vertical, are no gap.

use imucal_host::{
    diagnosis::{Options, Verdict, diagnose},
    recording::{Recording, manifest::Manifest},
    simulator::{Programme, Simulation},
};
use rayon::prelude::*;

/// What a rig moves, as if no encoder had been read: accelerometer and gyroscope, and gravity.
fn without_encoders(programme: Programme, seed: u64) -> Recording {
    let mut recording = Simulation { programme, seed, ..Simulation::default() }
        .record("hand.csv")
        .expect("a possible recording");
    (recording.gimbal, recording.mag, recording.temperature) = (None, None, None);
    let mut manifest = Manifest { rig: None, ..recording.manifest };
    (manifest.site.field_ned_ut, manifest.site.latitude_deg) = (None, None);
    Recording { manifest, ..recording }
}

/// Seeds of which a healthy unit seems to have a gap.
fn alarms(programme: Programme, seeds: std::ops::Range<u64>) -> Vec<u64> {
    let seems = |seed: &u64| {
        let diagnosis = diagnose(&without_encoders(programme, *seed), &Options::default(), &|_| ());
        diagnosis.verdict != Verdict::None
    };
    seeds.into_par_iter().filter(seems).collect()
}

#[test]
fn long_turns_and_swings_about_the_vertical_are_no_gap() {
    let [full, mixed] = [alarms(Programme::Full, 101..113), alarms(Programme::Mixed, 1..9)];
    println!("of 12 and 8 healthy units seem to have a gap: {full:?} {mixed:?}");
    assert!(full.len() + mixed.len() <= 2, "{full:?} {mixed:?}");
}

/// For docs/diagnosis.md.
#[test]
#[ignore = "minutes"]
fn how_often_a_healthy_unit_without_encoders_seems_to_have_a_gap() {
    for (name, programme) in
        [("multi-position", Programme::MultiPosition), ("mixed", Programme::Mixed), ("full", Programme::Full)]
    {
        let found = alarms(programme, 1001..1101).len();
        println!("{name}: of 100 healthy units {found} seem to have a gap");
    }
}

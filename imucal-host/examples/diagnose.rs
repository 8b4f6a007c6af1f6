//! Says which effect a simulator lacks that disagrees with a recording; here the recording is simulated too, with an
//! effect that the baseline lacks.
//!
//! `cargo run -p imucal-host --example diagnose [REC.csv.gz]`

use std::{env, error::Error};

use imucal_host::{
    diagnosis::{Options, diagnose},
    effect,
    recording::Recording,
    report,
    simulator::{Programme, Simulation},
};

/// The effect, and its size in multiples of its usual one.
const WITHHELD: (&str, f64) = ("acc.scale_cubic", 3.0);

fn main() -> Result<(), Box<dyn Error>> {
    let recording = match env::args_os().nth(1) {
        Some(path) => Recording::read(path.as_ref())?,
        None => simulated()?,
    };
    let diagnosis = diagnose(&recording, &Options::default(), &|stage| eprintln!("{stage}"));
    println!("{}", report::diagnosis::page(&diagnosis));
    for cause in &diagnosis.causes {
        println!("{}: probability {:.2}", cause.effect, cause.probability);
    }
    Ok(())
}

/// A unit on a three-gimbal rig, with the effect.
fn simulated() -> Result<Recording, Box<dyn Error>> {
    let mut simulation =
        Simulation { programme: Programme::MultiPosition, rate: 50.0, ..Simulation::default() };
    simulation.add(effect::find(WITHHELD.0).ok_or("no such effect")?, WITHHELD.1)?;
    Ok(simulation.record("simulated.csv")?)
}

//! Calibrates a recording, or a simulated one, and prints what was found.
//!
//! `cargo run -p imucal-host --example calibrate [REC.csv.gz]`

use std::{env, error::Error};

use imucal_host::{
    calibrate::{Options, calibrate},
    recording::Recording,
    report,
    simulator::{Programme, Simulation},
};

fn main() -> Result<(), Box<dyn Error>> {
    let recording = match env::args_os().nth(1) {
        Some(path) => Recording::read(path.as_ref())?,
        None => simulated()?,
    };
    let calibration = calibrate(&recording, &Options::default(), &|stage| eprintln!("{stage}"));
    println!("{}", report::table::table(&calibration));
    for sensor in &calibration.sensors {
        match (&sensor.verdict, sensor.accepted()) {
            (Err(refused), _) => println!("{}: {}", sensor.kind, refused.advice),
            (_, None) => println!("{}: suspect, {:?}", sensor.kind, sensor.suspicions),
            (_, Some(fit)) => {
                println!("{}: raw zero at {:?}", sensor.kind, fit.raw_triad().bias.as_slice());
            }
        }
    }
    Ok(())
}

/// A unit on a three-gimbal rig, in many attitudes.
fn simulated() -> Result<Recording, Box<dyn Error>> {
    let simulation = Simulation { programme: Programme::MultiPosition, rate: 50.0, ..Simulation::default() };
    Ok(simulation.record("simulated.csv")?)
}

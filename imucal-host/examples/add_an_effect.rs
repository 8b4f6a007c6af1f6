//! An effect of one's own: how it is defined, simulated, and what a diagnosis says of it.
//!
//! The simulator takes any effect. The diagnosis looks for those of [`CATALOGUE`] and of
//! `diagnosis::Options::effects`. To have it look for a new one:
//!
//! 1. Write `imucal-host/src/effect/NAME.rs` like `scale_cubic.rs`: a function `effect`, which says what the effect is,
//!    and a function `alter`, which does it. It sees one row at a time; an effect that looks at other rows is an
//!    `Act::Memory`, as in `hysteresis.rs`.
//! 2. In `imucal-host/src/effect/mod.rs`, add the line `mod NAME;`, and `NAME::effect` to the list in [`CATALOGUE`], at
//!    its place in the chain. With `for family in […]` it is there for each sensor.
//!
//! The effect here is one that the catalogue has, `acc.scale_cubic`, written a second time. So both can be seen: what a
//! diagnosis says before the catalogue has it, by withholding the entry, and what it says after.
//!
//! `cargo run -p imucal-host --example add_an_effect`

use std::{error::Error, sync::LazyLock};

use imucal_host::{
    diagnosis::{self, Diagnosis, diagnose},
    effect::{Act, CATALOGUE, Effect, Needs, Parameter, Part, Role, SensorRows, Words},
    recording::{Recording, SensorKind},
    simulator::{Programme, Simulation},
};
use nalgebra::Vector3;

/// The entry of the catalogue that does the same.
const ALIKE: &str = "acc.scale_cubic";

/// The effect.
static OWN: LazyLock<Effect> = LazyLock::new(|| Effect {
    id: "acc.own_cubic".to_owned(),
    act: Act::Sensor(SensorKind::Acc, alter),
    sensors: &[SensorKind::Acc],
    parameters: ["x", "y", "z"].map(amplitude).into(),
    words: Words {
        cause: "The sensitivity falls off or grows towards both ends of the range.",
        remedy: "Add a cubic term per axis to the calibration.",
        needs: "Each axis at levels between zero and the largest, of both signs.",
    },
    confusables: Vec::new(),
    part: Part::Candidate,
    needs: Needs::NOTHING,
    absorbed: false,
    changes: None,
});

/// A parameter that the effect is linear in.
fn amplitude(axis: &str) -> Parameter {
    let usual = 5e-6;
    Parameter {
        name: axis.to_owned(),
        unit: "1/(m/s^2)^2".to_owned(),
        role: Role::Amplitude,
        prior_scale: usual,
        range: (-30.0 * usual, 30.0 * usual),
        is_bounded: false,
        material: 0.2 * usual,
    }
}

/// What it does to the accelerometer's output: `y += c x³`.
fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let c = Vector3::from_column_slice(values);
    run.add(|_, sensed| c.component_mul(&sensed.map(|x| x * x * x)));
}

fn main() -> Result<(), Box<dyn Error>> {
    println!("the catalogue has {} effects", CATALOGUE.len());
    let recording = simulated()?;
    say("before the catalogue has it", &diagnosed(&recording, &[ALIKE]));
    say("after", &diagnosed(&recording, &[]));
    Ok(())
}

/// A unit on a three-gimbal rig, with the effect at three times its usual size.
fn simulated() -> Result<Recording, Box<dyn Error>> {
    let mut simulation =
        Simulation { programme: Programme::MultiPosition, rate: 50.0, ..Simulation::default() };
    simulation.add(&OWN, 3.0)?;
    Ok(simulation.record("simulated.csv")?)
}

/// The diagnosis, with entries of the catalogue withheld.
fn diagnosed(recording: &Recording, without: &[&str]) -> Diagnosis {
    let without = without.iter().map(ToString::to_string).collect();
    diagnose(recording, &diagnosis::Options { without, ..Default::default() }, &|_| {})
}

fn say(when: &str, diagnosis: &Diagnosis) {
    let causes: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.effect.as_str()).collect();
    println!("{when}: {:?}, causes {causes:?}", diagnosis.verdict);
}

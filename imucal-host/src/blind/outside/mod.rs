//! Mechanisms that no catalogue of ours has: what a diagnosis must call unknown.
//!
//! They are put into the simulator's chain as effects are, but [`CATALOGUE`](crate::effect::CATALOGUE) does not list
//! them and the diagnosis does not see them. Within their stage they come before the catalogue's own.

use std::sync::LazyLock;

use nalgebra::Vector3;

use crate::{
    effect::{Act, Effect, Needs, Parameter, Part, Role, Words},
    recording::SensorKind,
};

mod angle_harmonic;
mod cross_cubic;
mod crosstalk;
mod dead_zone;
mod ladder;
mod motion_heat;
mod ripple;
mod temp_cross;
mod temp_rate;

/// All of them.
pub static OUTSIDE: LazyLock<Vec<Effect>> = LazyLock::new(|| {
    let mut list = angle_harmonic::effects();
    for family in [
        cross_cubic::effect,
        crosstalk::effect,
        dead_zone::effect,
        ladder::effect,
        motion_heat::effect,
        ripple::effect,
        temp_cross::effect,
        temp_rate::effect,
    ] {
        list.extend(SensorKind::ALL.map(family));
    }
    list
});

/// Families that no formula of a proposal says.
pub const BEYOND_FORMULAS: [&str; 2] = ["ladder", "ripple"];

/// A formula of a proposal says what a mechanism does.
pub fn is_spoken(id: &str) -> bool {
    id.rsplit_once('.').is_some_and(|(_, name)| !BEYOND_FORMULAS.contains(&name))
}

/// The mechanism of an id.
pub fn find(id: &str) -> Option<&'static Effect> {
    OUTSIDE.iter().find(|effect| effect.id == id)
}

pub(super) fn mechanism(
    kind: SensorKind,
    name: &str,
    act: Act,
    parameters: Vec<Parameter>,
    cause: &'static str,
) -> Effect {
    let sensors: &'static [SensorKind] = match kind {
        SensorKind::Acc => &[SensorKind::Acc],
        SensorKind::Gyr => &[SensorKind::Gyr],
        SensorKind::Mag => &[SensorKind::Mag],
    };
    let words = Words { cause, remedy: "", needs: "" };
    Effect {
        id: format!("outside.{kind}.{name}"),
        act,
        sensors,
        parameters,
        words,
        confusables: Vec::new(),
        part: Part::Candidate,
        needs: Needs::NOTHING,
        absorbed: false,
        changes: None,
    }
}

/// Amplitudes that a size of one makes this large; none is implausible.
pub(super) fn amplitudes(names: &[&str], scale: f64) -> Vec<Parameter> {
    let amplitude = |name: &&str| Parameter {
        name: (*name).to_owned(),
        unit: "SI".to_owned(),
        role: Role::Amplitude,
        prior_scale: scale,
        range: (-1e4 * scale, 1e4 * scale),
        is_bounded: false,
        material: 0.0,
    };
    names.iter().map(amplitude).collect()
}

pub(super) fn shape(name: &str, usual: f64) -> Parameter {
    Parameter {
        name: name.to_owned(),
        unit: "SI".to_owned(),
        role: Role::Shape { usual },
        prior_scale: usual,
        range: (0.1 * usual, 10.0 * usual),
        is_bounded: false,
        material: 0.0,
    }
}

pub(super) const XYZ: [&str; 3] = ["x", "y", "z"];

pub(super) fn vector(values: &[f64], at: usize) -> Vector3<f64> {
    Vector3::from_fn(|k, _| values.get(at + k).copied().unwrap_or(0.0))
}

/// y, z, x of x, y, z: what the neighbouring axis has.
pub(super) fn neighbour(v: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(v.y, v.z, v.x)
}

/// One of three, by sensor.
pub(super) fn of(kind: SensorKind, acc: f64, gyr: f64, mag: f64) -> f64 {
    match kind {
        SensorKind::Acc => acc,
        SensorKind::Gyr => gyr,
        SensorKind::Mag => mag,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        effect::CATALOGUE,
        simulator::{Dose, Programme, Simulation},
    };

    #[test]
    fn each_alters_its_sensor_and_no_other_and_is_not_in_the_catalogue() {
        let quiet = Simulation {
            programme: Programme::Mixed,
            rate: 20.0,
            noise: false,
            counts: false,
            duration: Some(120.0),
            ..Simulation::default()
        };
        let healthy = quiet.record("healthy.csv").unwrap();
        for mechanism in OUTSIDE.iter() {
            assert!(CATALOGUE.iter().all(|effect| effect.id != mechanism.id));
            let doses = vec![Dose::sized(mechanism, 1.0, 5, 120.0)];
            let altered = Simulation { doses, ..quiet.clone() }.record("altered.csv").unwrap();
            for kind in SensorKind::ALL {
                let same = altered.sensor(kind) == healthy.sensor(kind);
                assert_eq!(same, !mechanism.sensors.contains(&kind), "{} {kind}", mechanism.id);
            }
            assert_eq!(altered.gimbal, healthy.gimbal);
        }
    }
}

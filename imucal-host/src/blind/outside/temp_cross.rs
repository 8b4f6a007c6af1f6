//! An axis leans towards its neighbour as it warms: `y += c (T − 25 °C) x'`.

use super::{XYZ, amplitudes, mechanism, neighbour, of, vector};
use crate::{
    effect::{Act, Effect, SensorRows},
    recording::SensorKind,
};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let parameters = amplitudes(&XYZ, of(kind, 5e-5, 2e-4, 1e-4));
    mechanism(kind, "temp_cross", Act::Sensor(kind, alter), parameters, "The package bends as it warms.")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let c = vector(values, 0);
    run.add(|input, x| c.component_mul(&neighbour(x)) * (input.temperature - 25.0));
}

//! Integral non-linearity of a converter that repeats over its range: `y += c sin(2π x / X)`.

use std::f64::consts::TAU;

use super::{XYZ, amplitudes, mechanism, of, shape, vector};
use crate::{
    effect::{Act, Effect, SensorRows},
    recording::SensorKind,
};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let mut parameters = amplitudes(&XYZ, of(kind, 2e-3, 1e-3, 0.05));
    parameters.push(shape("period", of(kind, 4.0, 0.5, 15.0)));
    mechanism(kind, "ladder", Act::Sensor(kind, alter), parameters, "Steps of the converter are not alike.")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let (c, period) = (vector(values, 0), values.get(3).copied().unwrap_or(1.0));
    run.add(|_, x| c.component_mul(&x.map(|x| libm::sin(TAU * x / period))));
}

//! A slow beat in time, of a chopper or of the air conditioning: `y += c cos 2πt/P + s sin 2πt/P`.

use std::f64::consts::TAU;

use super::{amplitudes, mechanism, of, shape, vector};
use crate::{
    effect::{Act, Effect, SensorRows},
    recording::SensorKind,
};

const NAMES: [&str; 6] = ["x_c", "y_c", "z_c", "x_s", "y_s", "z_s"];

pub(super) fn effect(kind: SensorKind) -> Effect {
    let mut parameters = amplitudes(&NAMES, of(kind, 2e-3, 2e-4, 0.03));
    parameters.push(shape("period", 25.0));
    mechanism(kind, "ripple", Act::Sensor(kind, alter), parameters, "Something beats slowly.")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let period = values.get(6).copied().unwrap_or(1.0);
    run.add(|input, _| {
        let (sin, cos) = libm::sincos(TAU * input.time / period);
        vector(values, 0) * cos + vector(values, 3) * sin
    });
}

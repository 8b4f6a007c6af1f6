//! Beyond a knee the response is steeper: `y += c max(x − k, 0)`.

use crate::{
    blind::outside::{XYZ, amplitudes, mechanism, of, shape, vector},
    effect::{Act, Effect, SensorRows},
    recording::SensorKind,
};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let mut parameters = amplitudes(&XYZ, of(kind, 1e-2, 2e-2, 1e-2));
    parameters.push(shape("knee", of(kind, 0.5, 0.2, 8.0)));
    mechanism(kind, "knee", Act::Sensor(kind, alter), parameters, "A second stage takes over.")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let (c, knee) = (vector(values, 0), values.get(3).copied().unwrap_or(0.0));
    run.add(|_, x| c.component_mul(&x.map(|x| (x - knee).max(0.0))));
}

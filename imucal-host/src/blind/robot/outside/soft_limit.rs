//! A stage that gives way softly: `y += c tanh(x / s)`.

use crate::{
    blind::outside::{XYZ, amplitudes, mechanism, of, shape, vector},
    effect::{Act, Effect, SensorRows},
    recording::SensorKind,
};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let mut parameters = amplitudes(&XYZ, of(kind, 2e-2, 5e-3, 0.2));
    parameters.push(shape("s", of(kind, 0.5, 0.2, 6.0)));
    mechanism(kind, "soft_limit", Act::Sensor(kind, alter), parameters, "A stage saturates softly.")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let (c, s) = (vector(values, 0), values.get(3).copied().unwrap_or(1.0));
    run.add(|_, x| c.component_mul(&x.map(|x| libm::tanh(x / s))));
}

//! Small inputs get through weakened: `y −= c clamp(x, ±d)`.

use super::{XYZ, amplitudes, mechanism, of, shape, vector};
use crate::{
    effect::{Act, Effect, SensorRows},
    recording::SensorKind,
};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let mut parameters = amplitudes(&XYZ, of(kind, 2e-3, 2e-2, 5e-3));
    parameters.push(shape("d", of(kind, 1.0, 0.1, 6.0)));
    mechanism(kind, "dead_zone", Act::Sensor(kind, alter), parameters, "The loop is slack about zero.")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let (c, d) = (vector(values, 0), values.get(3).copied().unwrap_or(0.0).abs());
    run.add(|_, x| -c.component_mul(&x.map(|x| x.clamp(-d, d))));
}

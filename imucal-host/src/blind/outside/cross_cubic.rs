//! The cube of what a neighbouring axis senses: `y += c x'³`.

use super::{XYZ, amplitudes, mechanism, neighbour, of, vector};
use crate::{
    effect::{Act, Effect, SensorRows},
    recording::SensorKind,
};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let parameters = amplitudes(&XYZ, of(kind, 5e-6, 5e-4, 4e-7));
    mechanism(
        kind,
        "cross_cubic",
        Act::Sensor(kind, alter),
        parameters,
        "An axis bends with its neighbour's input.",
    )
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let c = vector(values, 0);
    run.add(|_, x| c.component_mul(&neighbour(x).map(|x| x * x * x)));
}

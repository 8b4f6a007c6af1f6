//! Another triad's input: the magnetic field in accelerometer and gyroscope, specific force in the magnetometer.
//!
//! ```text
//! y += c u'      u': of the neighbouring axis
//! ```

use super::{XYZ, amplitudes, mechanism, neighbour, of, vector};
use crate::{
    effect::{Act, Effect, SensorRows},
    recording::SensorKind,
};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let act = match kind {
        SensorKind::Acc | SensorKind::Gyr => Act::Sensor(kind, of_field),
        SensorKind::Mag => Act::Sensor(kind, of_force),
    };
    let parameters = amplitudes(&XYZ, of(kind, 5e-5, 5e-6, 5e-3));
    mechanism(kind, "crosstalk", act, parameters, "Lines of another triad couple into this one.")
}

fn of_field(values: &[f64], run: &mut SensorRows<'_>) {
    let c = vector(values, 0);
    run.add(|input, _| c.component_mul(&neighbour(&input.b_q)));
}

fn of_force(values: &[f64], run: &mut SensorRows<'_>) {
    let c = vector(values, 0);
    run.add(|input, _| c.component_mul(&neighbour(&input.f_q)));
}

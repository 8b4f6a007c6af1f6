//! One input turned on by another: `y += c f' w'`, each of the neighbouring axis; of the magnetometer `y += c f' f`.

use crate::{
    blind::outside::{XYZ, amplitudes, mechanism, neighbour, of, vector},
    effect::{Act, Effect, SensorRows},
    recording::SensorKind,
};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let act = match kind {
        SensorKind::Acc | SensorKind::Gyr => Act::Sensor(kind, of_rate),
        SensorKind::Mag => Act::Sensor(kind, of_force),
    };
    let parameters = amplitudes(&XYZ, of(kind, 5e-3, 5e-4, 5e-3));
    mechanism(kind, "product", act, parameters, "One drive modulates another.")
}

fn of_rate(values: &[f64], run: &mut SensorRows<'_>) {
    let c = vector(values, 0);
    run.add(|input, _| c.component_mul(&neighbour(&input.f_q)).component_mul(&neighbour(&input.w_iq_q)));
}

fn of_force(values: &[f64], run: &mut SensorRows<'_>) {
    let c = vector(values, 0);
    run.add(|input, _| c.component_mul(&neighbour(&input.f_q)).component_mul(&input.f_q));
}

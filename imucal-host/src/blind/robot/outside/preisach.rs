//! Domains that switch late: a few relays after Preisach, each with thresholds of its own.
//!
//! ```text
//! y += c Σ_k s_k / n      s_k: 1 once x > u_k X, −1 once x < d_k X, else what it was
//! ```

use nalgebra::Vector3;

use crate::{
    blind::outside::{XYZ, amplitudes, mechanism, of, shape, vector},
    effect::{Act, Effect, SensorRun},
    recording::SensorKind,
};

/// u, d: wide apart, so that the memory is long.
const RELAYS: [(f64, f64); 4] = [(0.3, -0.9), (0.9, 0.1), (-0.1, -0.7), (0.6, -0.4)];

pub(super) fn effect(kind: SensorKind) -> Effect {
    let mut parameters = amplitudes(&XYZ, of(kind, 5e-3, 1e-3, 0.1));
    parameters.push(shape("x", of(kind, 0.7, 0.2, 12.0)));
    mechanism(kind, "preisach", Act::Memory(kind, alter), parameters, "Domains switch late.")
}

fn alter(values: &[f64], run: &mut SensorRun<'_>) {
    let (c, scale) = (vector(values, 0), values.get(3).copied().unwrap_or(1.0));
    let mut relays = [Vector3::repeat(-1.0); RELAYS.len()];
    for (output, sensed) in run.output.iter_mut().zip(run.sensed) {
        for (relay, (up, down)) in relays.iter_mut().zip(RELAYS) {
            *relay = relay.zip_map(sensed, |state, x| match x / scale {
                x if x > up => 1.0,
                x if x < down => -1.0,
                _ => state,
            });
        }
        let sum: Vector3<f64> = relays.iter().sum();
        *output += c.component_mul(&sum) / RELAYS.len() as f64;
    }
}

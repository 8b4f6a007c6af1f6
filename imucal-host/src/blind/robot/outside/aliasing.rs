//! A tone above half the sampling rate, folded down: of a switching supply whose frequency wanders with temperature.
//!
//! ```text
//! y += c sin 2π ∫ f dt,   f = f₀ (1 + k (T − 25 °C))      f₀: hundreds of Hz
//! ```

use std::f64::consts::TAU;

use crate::{
    blind::outside::{XYZ, amplitudes, mechanism, of, shape, vector},
    effect::{Act, Effect, SensorRun},
    recording::SensorKind,
};

/// Of the frequency, 1/K.
const WARMTH: f64 = 2e-4;

pub(super) fn effect(kind: SensorKind) -> Effect {
    let mut parameters = amplitudes(&XYZ, of(kind, 5e-3, 1e-3, 0.1));
    parameters.push(shape("frequency", 401.3));
    mechanism(kind, "aliasing", Act::Memory(kind, alter), parameters, "A switching supply is near.")
}

fn alter(values: &[f64], run: &mut SensorRun<'_>) {
    let (c, frequency) = (vector(values, 0), values.get(3).copied().unwrap_or(1.0));
    let mut phase = 0.0;
    for row in 0..run.output.len() {
        let warm = 1.0 + WARMTH * (run.input[row].temperature - 25.0);
        phase += frequency * warm * run.since_before(row);
        run.output[row] += c * libm::sin(TAU * phase);
    }
}

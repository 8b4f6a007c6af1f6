//! A supply that sags as its battery is spent: gain falls late and suddenly, and recovers a little at rest.
//!
//! ```text
//! y += c x (1 − exp(−(Q/Q₀)³)),   Q: what motion has drawn so far, of which a part comes back within a minute
//! ```

use crate::{
    blind::outside::{XYZ, amplitudes, mechanism, of, shape, vector},
    effect::{Act, Effect, SensorRun},
    recording::SensorKind,
};

/// What the rest draws, and what motion draws a (rad/s)² and a (m/s²)².
const DRAWN: [f64; 3] = [0.1, 1.0, 0.3];
/// Share of the charge that comes back, and within which time, s.
const RETURNS: (f64, f64) = (0.2, 60.0);
/// Specific force at rest, m/s².
const REST: f64 = 9.81;

pub(super) fn effect(kind: SensorKind) -> Effect {
    let mut parameters = amplitudes(&XYZ, of(kind, 2e-3, 5e-3, 2e-3));
    parameters.push(shape("charge", 40.0));
    mechanism(kind, "battery", Act::Memory(kind, alter), parameters, "The battery is spent.")
}

fn alter(values: &[f64], run: &mut SensorRun<'_>) {
    let (c, charge) = (vector(values, 0), values.get(3).copied().unwrap_or(1.0));
    let (mut spent, mut returning) = (0.0f64, 0.0f64);
    for row in 0..run.output.len() {
        let (input, since) = (&run.input[row], run.since_before(row));
        let shaken = input.f_q.norm() - REST;
        let power = DRAWN[0] + DRAWN[1] * input.w_iq_q.norm_squared() + DRAWN[2] * shaken * shaken;
        spent += (1.0 - RETURNS.0) * power * since;
        returning = returning * libm::exp(-since / RETURNS.1) + RETURNS.0 * power * since;
        let share = (spent + returning) / charge;
        let sag = 1.0 - libm::exp(-share * share * share);
        run.output[row] += c.component_mul(&run.sensed[row]) * sag;
    }
}

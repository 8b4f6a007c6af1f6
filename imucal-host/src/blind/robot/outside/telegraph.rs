//! A loose contact: a bias that jumps between two values, at a knock and by chance.
//!
//! ```text
//! y += c s      s flips with probability ½ where | |f| − g | > k, at most once in 0.3 s
//! ```

use crate::{
    blind::outside::{XYZ, amplitudes, mechanism, of, shape, vector},
    effect::{Act, Effect, SensorRun},
    recording::SensorKind,
    simulator::random::{Purpose, Random},
};

/// Least time between two flips, s.
const APART: f64 = 0.3;
/// Specific force at rest, m/s².
const REST: f64 = 9.81;

pub(super) fn effect(kind: SensorKind) -> Effect {
    let mut parameters = amplitudes(&XYZ, of(kind, 5e-3, 1e-3, 0.1));
    parameters.extend([shape("k", 0.5), shape("draw", 1.0)]);
    mechanism(kind, "telegraph", Act::Memory(kind, alter), parameters, "A contact is loose.")
}

fn alter(values: &[f64], run: &mut SensorRun<'_>) {
    let [_, _, _, knock, draw] = *values else { return };
    let (c, mut random) = (vector(values, 0), Random::new(draw.to_bits(), Purpose::Effect));
    let (mut state, mut last) = (0.0, f64::NEG_INFINITY);
    for (output, input) in run.output.iter_mut().zip(run.input) {
        if input.time - last > APART && (input.f_q.norm() - REST).abs() > knock {
            last = input.time;
            if random.share() < 0.5 {
                state = 1.0 - state;
            }
        }
        *output += c * state;
    }
}

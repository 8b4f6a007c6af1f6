//! Drives warm the unit while they work, within seconds and unseen by the thermometer: a bias after brisk motion.
//!
//! ```text
//! y += c p,   τ ṗ = |w|² − p
//! ```

use super::{XYZ, amplitudes, mechanism, of, shape, vector};
use crate::{
    effect::{Act, Effect, SensorRun},
    recording::SensorKind,
};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let mut parameters = amplitudes(&XYZ, of(kind, 5e-3, 1e-3, 0.1));
    parameters.push(shape("tau", 8.0));
    mechanism(
        kind,
        "motion_heat",
        Act::Memory(kind, alter),
        parameters,
        "Drives warm the unit while they work.",
    )
}

fn alter(values: &[f64], run: &mut SensorRun<'_>) {
    let (c, tau) = (vector(values, 0), values.get(3).copied().unwrap_or(1.0));
    let power = run.squared_rate_within(tau);
    run.output.iter_mut().zip(power).for_each(|(output, power)| *output += c * power);
}

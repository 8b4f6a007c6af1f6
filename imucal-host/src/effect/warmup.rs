//! Bias that settles after power-on: `P.warmup`.
//!
//! ```text
//! y += c exp(−t/τ)
//! ```

use super::{Act, Effect, Parameter, SensorKind, SensorRows, Words, XYZ, member_id, of, si, vector};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "The unit warms itself after power-on, and its bias settles.",
        remedy: "Wait ten minutes before recording, or model the decay.",
        needs: "The same attitude at the beginning and several times later.",
    };
    let unit = si(kind);
    let scale = of(kind, 0.02, 2e-3, 0.2);
    let mut parameters = Parameter::amplitudes(&XYZ, &unit, scale);
    parameters.push(Parameter::shape("tau", "s", 150.0));
    Effect::member(kind, "warmup", Act::Sensor(kind, alter), parameters, words)
        .like(&member_id(kind, "bias_drift"), "a long rest at the end")
        .like(&member_id(kind, "temp_bias"), "a cooling ramp, then the first attitude again")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let [_, _, _, tau] = *values else { return };
    let c = vector(values, 0);
    run.add(|input, _| c * libm::exp(-input.time / tau));
}

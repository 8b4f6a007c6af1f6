//! Bias that drifts with time: `P.bias_drift`.
//!
//! ```text
//! y += c t
//! ```

use super::{Act, Effect, Parameter, SensorKind, SensorRows, Words, XYZ, member_id, of, si, vector};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "The bias changes steadily: slow leakage, a draught, a supply that sags.",
        remedy: "Recalibrate the bias at every rest; record a rest at both ends.",
        needs: "The same attitude at the beginning and at the end.",
    };
    let unit = format!("{}/s", si(kind));
    let scale = of(kind, 3e-5, 3e-6, 3e-4);
    Effect::member(
        kind,
        "bias_drift",
        Act::Sensor(kind, alter),
        Parameter::amplitudes(&XYZ, &unit, scale),
        words,
    )
    .like(&member_id(kind, "temp_bias"), "heating and then cooling")
    .like(&member_id(kind, "warmup"), "a long rest at the end")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let c = vector(values, 0);
    run.add(|input, _| c * input.time);
}

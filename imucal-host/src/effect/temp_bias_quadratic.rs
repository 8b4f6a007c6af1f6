//! Bias that bends with temperature: `P.temp_bias_quadratic`.
//!
//! ```text
//! y += c (T − 25 °C)²
//! ```

use super::{Act, Effect, Needs, Parameter, SensorKind, SensorRows, Words, XYZ, member_id, of, si, vector};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "The bias is not a straight line of temperature.",
        remedy: "Add a second-order temperature term, or a table.",
        needs: "Three or more temperatures, not in the order of time.",
    };
    let unit = format!("{}/K^2", si(kind));
    let scale = of(kind, 1e-4, 2e-5, 1e-3);
    Effect::member(
        kind,
        "temp_bias_quadratic",
        Act::Sensor(kind, alter),
        Parameter::amplitudes(&XYZ, &unit, scale),
        words,
    )
    .needing(Needs::THERMOMETER)
    .like(&member_id(kind, "temp_bias"), "three or more temperatures")
    .like(&member_id(kind, "bias_drift"), "heating and then cooling")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let c = vector(values, 0);
    run.add(|input, _| {
        let change = input.temperature - super::temp_bias::REFERENCE;
        c * (change * change)
    });
}

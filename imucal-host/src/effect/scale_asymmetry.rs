//! Another sensitivity for each sign: `P.scale_asymmetry`.
//!
//! ```text
//! y += c |x|
//! ```

use super::{Act, Effect, Parameter, SensorKind, SensorRows, Words, XYZ, member_id, of, vector};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "An axis is more sensitive to one sign of input than to the other.",
        remedy: "Calibrate one scale for each sign.",
        needs: "Each axis at intermediate levels of both signs.",
    };
    let unit = "-".to_owned();
    let scale = of(kind, 1e-3, 1e-3, 1e-3);
    Effect::member(
        kind,
        "scale_asymmetry",
        Act::Sensor(kind, alter),
        Parameter::amplitudes(&XYZ, &unit, scale),
        words,
    )
    .like(&member_id(kind, "scale_quadratic"), "inputs at half and at full level of both signs")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let c = vector(values, 0);
    run.add(|_, x| c.component_mul(&x.abs()));
}

//! Bias that jumps, for good or for a while: `P.bias_step`.
//!
//! ```text
//! y += c from t_start to t_end
//! ```

use nalgebra::Vector3;

use super::{Act, Effect, Parameter, SensorKind, SensorRows, Words, XYZ, member_id, of, si, vector};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "A shock, a change of supply, or a magnet brought near and taken away.",
        remedy: "Split the recording there; find what happened at those times.",
        needs: "The same attitudes before, within and after.",
    };
    let unit = si(kind);
    let scale = of(kind, 0.02, 2e-3, 0.3);
    let mut parameters = Parameter::amplitudes(&XYZ, &unit, scale);
    parameters.extend([Parameter::instant("t_start", 0.35), Parameter::instant("t_end", 0.75)]);
    Effect::member(kind, "bias_step", Act::Sensor(kind, alter), parameters, words)
        .like(&member_id(kind, "bias_drift"), "the same attitude several times")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let [_, _, _, start, end] = *values else { return };
    let c = vector(values, 0);
    run.add(|input, _| if (start..end).contains(&input.time) { c } else { Vector3::zeros() });
}

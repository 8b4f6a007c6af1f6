//! Axes taken for one another: `P.axis_swap`.

use nalgebra::Vector3;

use super::{Act, DataRun, Effect, Parameter, SensorKind, Words, member_id};

/// Orders of the axes; the first changes nothing.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "Columns or axes are in another order or of another sign: code = 8 order + signs, 0 to 47.",
        remedy: "Correct the wiring, the driver or the import; look the axes up in the data sheet.",
        needs: "Input along two axes.",
    };
    Effect::member(kind, "axis_swap", Act::Data(kind, alter), vec![Parameter::choice("code", 47.0)], words)
        .like(&member_id(kind, "misalignment"), "its size: a swap is a right angle or more")
}

fn alter(values: &[f64], run: &mut DataRun<'_>) {
    let code = values.first().map_or(0, |code| code.round().clamp(0.0, 47.0) as usize);
    let (Some(order), signs) = (ORDERS.get(code / 8), code % 8) else { return };
    let sign = Vector3::from_fn(|axis, _| if signs >> axis & 1 == 1 { -1.0 } else { 1.0 });
    for sample in run.samples.iter_mut() {
        *sample = Vector3::from_fn(|axis, _| sample[order[axis]]).component_mul(&sign);
    }
}

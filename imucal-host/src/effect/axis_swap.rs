//! Axes taken for one another: `P.axis_swap`.

use nalgebra::Matrix3;

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

/// How many codes there are.
pub const CODES: usize = 8 * ORDERS.len();

/// The signed permutation of a code: from the axes as they are to the axes as they are recorded. `None` from [`CODES`].
pub fn signed_permutation(code: usize) -> Option<Matrix3<f64>> {
    let order = ORDERS.get(code / 8)?;
    let sign = |axis: usize| if (code % 8) >> axis & 1 == 1 { -1.0 } else { 1.0 };
    Some(Matrix3::from_fn(|axis, from| if order[axis] == from { sign(axis) } else { 0.0 }))
}

fn alter(values: &[f64], run: &mut DataRun<'_>) {
    let code = values.first().map_or(0, |code| code.round().clamp(0.0, (CODES - 1) as f64) as usize);
    let Some(swap) = signed_permutation(code) else { return };
    run.samples.iter_mut().for_each(|sample| *sample = swap * *sample);
}

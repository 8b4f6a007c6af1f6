//! The accelerometer is off the centre of rotation: `acc.lever_arm`.
//!
//! ```text
//! f = f₀ + ẇ × r + w × (w × r)
//! ```

use super::{Act, Effect, Needs, Parameter, SensorKind, Truth, Words, XYZ, vector};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "The accelerometer sits at r from the point whose movement is known: where the gimbal axes meet, the tracked body, or the simulator's sensor.",
        remedy: "Measure r, or estimate it from motion, and subtract what it adds.",
        needs: "Rates above 1 rad/s about two axes, or brisk sinusoids.",
    };
    Effect::new("acc.lever_arm", Act::Field(alter), Parameter::amplitudes(&XYZ, "m", 0.02), words)
        .needing(Needs::POSITION)
        .on(SensorKind::Acc)
        .like("acc.inner_lever_arm", "constant rates about all three axes of the table")
        .like("acc.vibration_rectification", "the same rate about another axis")
}

fn alter(values: &[f64], row: &mut Truth) {
    let arm = vector(values, 0);
    row.f_t += row.dw_it_t.cross(&arm) + row.w_it_t.cross(&row.w_it_t.cross(&arm));
}

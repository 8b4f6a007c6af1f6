//! Something magnetic passes by: `mag.transient`.
//!
//! ```text
//! B += d exp(−((t − t₀) / w)² / 2)      d in the base
//! ```

use super::{Act, Effect, Parameter, SensorKind, Truth, Words, XYZ, vector};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "A lift, a car or a trolley passes and takes its field along.",
        remedy: "Leave that stretch out; keep iron away while recording.",
        needs: "A rest while it passes, and the same attitude at another time.",
    };
    let mut parameters = Parameter::amplitudes(&XYZ, "uT", 1.0);
    parameters.extend([Parameter::instant("t_middle", 0.5), Parameter::shape("width", "s", 8.0)]);
    Effect::new("mag.transient", Act::Field(alter), parameters, words)
        .on(SensorKind::Mag)
        .like("mag.bias_step", "another magnetometer in the room: it sees what passes")
}

fn alter(values: &[f64], row: &mut Truth) {
    let [_, _, _, middle, width] = values else { return };
    let peak_p = vector(values, 0);
    let off = (row.time - middle) / width;
    let c_t_p = row.c_t_p;
    row.add_field(&c_t_p, &(peak_p * libm::exp(-0.5 * off * off)));
}

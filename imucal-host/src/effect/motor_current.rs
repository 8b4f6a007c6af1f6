//! The gimbals' motors make a field while they turn: `mag.motor_current`.
//!
//! ```text
//! B += Σ_k C_k_t d_k α̇_k      k: the frame of the motor's stator, p for outer, o for middle, m for inner
//! ```

use super::{Act, Effect, Needs, Parameter, SensorKind, Truth, Words, vector};

const NAMES: [&str; 9] =
    ["outer_x", "outer_y", "outer_z", "middle_x", "middle_y", "middle_z", "inner_x", "inner_y", "inner_z"];

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "The current that drives a gimbal grows with its rate, and its field with it.",
        remedy: "Use rests only, twist and shield the leads, or estimate the vectors from motion.",
        needs: "Each gimbal at several rates of both signs.",
    };
    Effect::new(
        "mag.motor_current",
        Act::Field(alter),
        Parameter::amplitudes(&NAMES, "uT/(rad/s)", 0.2),
        words,
    )
    .needing(Needs::GIMBALS)
    .on(SensorKind::Mag)
    .like(
        "mag.eddy_current",
        "motor current without rotation; in a steady field eddy currents lie inside this",
    )
    .like("mag.bandwidth", "motor current without rotation, or a coil step at rest")
}

fn alter(values: &[f64], row: &mut Truth) {
    let stators = [row.c_t_p, row.c_t_o, row.c_t_m];
    let rates = row.gimbals.map(|gimbal| gimbal.rate);
    for (k, (c_t_k, rate)) in stators.iter().zip(rates).enumerate() {
        row.add_field(c_t_k, &(vector(values, 3 * k) * rate));
    }
}

//! A magnet on a gimbal: `mag.gimbal_hard_iron_outer` and `mag.gimbal_hard_iron_middle`.
//!
//! ```text
//! B += C_g_t d      d constant in the gimbal's frame
//! ```

use nalgebra::Matrix3;

use super::{Act, Effect, Needs, Parameter, SensorKind, Truth, Words, XYZ, vector};

pub(super) fn outer() -> Effect {
    effect("outer", Act::Field(|values, row| alter(values, row, |row| row.c_t_o)))
        .like(
            "mag.gimbal_soft_iron_outer",
            "a coil that changes the field in the room: only soft iron follows it",
        )
        .like("mag.gimbal_hard_iron_middle", "turns of the outer gimbal alone")
}

pub(super) fn middle() -> Effect {
    effect("middle", Act::Field(|values, row| alter(values, row, |row| row.c_t_m)))
        .like(
            "mag.gimbal_hard_iron_outer",
            "turns of the middle gimbal alone; along its axis the two are the same",
        )
        .like("mag.bias", "turns of the inner gimbal; along its axis the two are the same")
}

fn effect(gimbal: &str, act: Act) -> Effect {
    let words = Words {
        cause: "A motor's magnet or magnetised steel on that gimbal turns with it.",
        remedy: "Demagnetise or shield it; estimate its vector in the gimbal's frame.",
        needs: "Rests over the full range of that gimbal with those inside it at several angles.",
    };
    let id = format!("mag.gimbal_hard_iron_{gimbal}");
    Effect::new(&id, act, Parameter::amplitudes(&XYZ, "uT", 0.5), words)
        .needing(Needs::GIMBALS)
        .on(SensorKind::Mag)
}

fn alter(values: &[f64], row: &mut Truth, frame: impl Fn(&Truth) -> Matrix3<f64>) {
    let d_g = vector(values, 0);
    let c_t_g = frame(row);
    row.add_field(&c_t_g, &d_g);
}

//! Soft iron on a gimbal: `mag.gimbal_soft_iron_outer` and `mag.gimbal_soft_iron_middle`.
//!
//! ```text
//! B += C_g_t S C_t_g B      S symmetric, in the gimbal's frame
//! ```

use nalgebra::Matrix3;

use super::{Act, Effect, Needs, Parameter, SYMMETRIC, SensorKind, Truth, Words, symmetric};

pub(super) fn outer() -> Effect {
    effect("outer", Act::Field(|values, row| alter(values, row, |row| row.c_t_o)))
        .like(
            "mag.gimbal_hard_iron_outer",
            "a coil that changes the field in the room: only soft iron follows it",
        )
        .like("mag.gimbal_soft_iron_middle", "turns of the outer gimbal alone")
}

pub(super) fn middle() -> Effect {
    effect("middle", Act::Field(|values, row| alter(values, row, |row| row.c_t_m)))
        .like(
            "mag.gimbal_hard_iron_middle",
            "a coil that changes the field in the room: only soft iron follows it",
        )
        .like("mag.gimbal_soft_iron_outer", "turns of the middle gimbal alone")
        .like("mag.soft_iron", "turns of the inner gimbal alone")
}

fn effect(gimbal: &str, act: Act) -> Effect {
    let words = Words {
        cause: "Unmagnetised steel on that gimbal is magnetised by the field in the room and adds its own.",
        remedy: "Replace the steel, or lengthen the mast; estimate its matrix in the gimbal's frame.",
        needs: "Rests over the full range of that gimbal with those inside it at several angles.",
    };
    let id = format!("mag.gimbal_soft_iron_{gimbal}");
    Effect::new(&id, act, Parameter::amplitudes(&SYMMETRIC, "-", 5e-3), words)
        .needing(Needs::GIMBALS)
        .on(SensorKind::Mag)
}

fn alter(values: &[f64], row: &mut Truth, frame: impl Fn(&Truth) -> Matrix3<f64>) {
    let induced = symmetric(values);
    let c_t_g = frame(row);
    let b_g = c_t_g * row.b_t;
    row.add_field(&c_t_g, &(induced * b_g));
}

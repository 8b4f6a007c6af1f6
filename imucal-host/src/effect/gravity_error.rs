//! Local gravity is not that of the model: `acc.gravity_error`.
//!
//! ```text
//! f_t → f_t − s C_n_t g_n      s the share, g_n the site's gravity
//! ```
//!
//! Where the sensor is not accelerated, it cannot be distinguished from a common scale of the accelerometer's axes.

use nalgebra::Vector3;

use super::{Act, Effect, Needs, Parameter, SensorKind, Truth, Words};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "Gravity at the site is larger than the model's, by this share.",
        remedy: "Enter the site's measured gravity, or its latitude and height.",
        needs: "Known specific force other than gravity, as of a centrifuge; rests alone cannot show it.",
    };
    // On Earth it differs by half a per cent, and a simulator may have 10 m/s².
    let share = Parameter::bounded("share", "-", 5e-4, (-0.03, 0.03));
    Effect::new("acc.gravity_error", Act::Field(alter), vec![share], words)
        .absorbed()
        .needing(Needs::EXACT_FORCE)
        .on(SensorKind::Acc)
        .like("acc.scale", "a known centripetal acceleration; not data with 1 g alone")
}

fn alter(values: &[f64], row: &mut Truth) {
    let share = values.first().copied().unwrap_or(0.0);
    let up_n = Vector3::new(0.0, 0.0, -row.gravity);
    row.f_t += (row.c_p_n * row.c_t_p).tr_mul(&(up_n * share));
}

//! Turning metal in the field: `mag.eddy_current`.
//!
//! ```text
//! B += τ w × B      since dB/dt in the table is −w × B, and eddy currents oppose it
//! ```

use super::{Act, Effect, Parameter, SensorKind, Truth, Words};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "The field induces currents in metal that turns with the sensor, and they hold it back by a time.",
        remedy: "Use rests only, replace solid metal near the sensor, or estimate the time constant.",
        needs: "Rates above 1 rad/s about several axes.",
    };
    Effect::new(
        "mag.eddy_current",
        Act::Field(alter),
        vec![Parameter::magnitude("tau", "s", 2e-3, 0.05)],
        words,
    )
    .on(SensorKind::Mag)
    .like("mag.bandwidth", "a coil step at rest; in a steady field the two are the same to first order")
    .like("mag.motor_current", "motor current without rotation")
}

fn alter(values: &[f64], row: &mut Truth) {
    let tau = values.first().copied().unwrap_or(0.0);
    row.b_t += row.w_pt_t.cross(&row.b_t) * tau;
}

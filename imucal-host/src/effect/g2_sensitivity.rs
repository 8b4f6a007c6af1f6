//! Rate that the square of specific force feigns: `gyr.g2_sensitivity`.

use super::{Act, Effect, MATRIX, Parameter, SensorKind, SensorRows, Words, matrix};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "Specific force bends the gyroscope's springs: w += G (f_x^2, f_y^2, f_z^2).",
        remedy: "Add these terms to the calibration where the unit will be accelerated.",
        needs: "Rests in oblique attitudes; at 1 g the sum over the three squares is a bias.",
    };
    let act = Act::Sensor(SensorKind::Gyr, alter);
    Effect::new("gyr.g2_sensitivity", act, Parameter::amplitudes(&MATRIX, "(rad/s)/(m/s^2)^2", 2e-5), words)
        .like("gyr.g_sensitivity", "opposite attitudes")
        .like("gyr.bias", "oblique attitudes")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let g = matrix(values);
    run.add(|input, _| g * input.f_q.component_mul(&input.f_q));
}

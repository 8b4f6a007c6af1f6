//! Rate that specific force feigns: `gyr.g_sensitivity`.

use super::{Act, Effect, MATRIX, Parameter, SensorKind, SensorRows, Words, matrix};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "Specific force deflects the gyroscope's vibrating mass: w += G f.",
        remedy: "Add the nine terms of G to the gyroscope's calibration.",
        needs: "Long rests in six or more attitudes.",
    };
    let act = Act::Sensor(SensorKind::Gyr, alter);
    Effect::new("gyr.g_sensitivity", act, Parameter::amplitudes(&MATRIX, "(rad/s)/(m/s^2)", 1e-4), words)
        .like("gyr.earth_rate", "rests at several headings")
        .like("gyr.bias_drift", "attitudes in another order")
        .like("gyr.g2_sensitivity", "opposite attitudes")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let g = matrix(values);
    run.add(|input, _| g * input.f_q);
}

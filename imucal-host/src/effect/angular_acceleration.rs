//! Rate that angular acceleration feigns: `gyr.angular_acceleration`.

use super::{Act, Effect, Needs, Parameter, SensorKind, SensorRows, Words, XYZ, vector};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "The gyroscope's mass lags or leads as the turn quickens: w_i += c_i dw_i/dt.",
        remedy: "Add the three terms, or find the delay that they stand for.",
        needs: "Sinusoids or slews about each axis.",
    };
    let act = Act::Sensor(SensorKind::Gyr, alter);
    Effect::new("gyr.angular_acceleration", act, Parameter::amplitudes(&XYZ, "s", 2e-3), words)
        .needing(Needs::READ_TOGETHER)
        .like("gyr.bandwidth", "none at low frequency: a common delay is the same")
        .like("clk.time_offset", "the accelerometer: it is late only where the clock is")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let c = vector(values, 0);
    run.add(|input, _| c.component_mul(&input.dw_iq_q));
}

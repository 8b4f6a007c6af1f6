//! A magnet fixed to the sensor: `mag.hard_iron`.

use super::{Act, Effect, Needs, Parameter, SensorKind, SensorRows, TriadEntries, Words, XYZ, vector};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "Something magnetised near the sensor, which was not there when it was calibrated.",
        remedy: "Calibrate where the sensor is used, or take the magnet away.",
        needs: "A calibration made elsewhere, and rests in three or more attitudes.",
    };
    Effect::new(
        "mag.hard_iron",
        Act::Sensor(SensorKind::Mag, alter),
        Parameter::amplitudes(&XYZ, "uT", 2.0),
        words,
    )
    .needing(Needs::OTHER_CALIBRATION)
    .absorbed()
    .changing(TriadEntries::Bias)
    .like("mag.bias", "none: the two are the same")
    .like("mag.gimbal_hard_iron_middle", "turns of the inner gimbal; along its axis the two are the same")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let d = vector(values, 0);
    run.add(|_, _| d);
}

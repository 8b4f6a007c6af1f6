//! Soft iron fixed to the sensor: `mag.soft_iron`.

use super::{
    Act, Effect, Needs, Parameter, SYMMETRIC, SensorKind, SensorRows, TriadEntries, Words, symmetric,
};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "Steel near the sensor, which was not there when it was calibrated, bends the field.",
        remedy: "Calibrate where the sensor is used, or take the steel away.",
        needs: "A calibration made elsewhere, and rests in nine or more attitudes.",
    };
    let act = Act::Sensor(SensorKind::Mag, alter);
    Effect::new("mag.soft_iron", act, Parameter::amplitudes(&SYMMETRIC, "-", 0.01), words)
        .needing(Needs::OTHER_CALIBRATION)
        .absorbed()
        .changing(TriadEntries::Symmetric)
        .like("mag.scale", "none: it is part of this")
        .like("mag.misalignment", "none: its symmetric part is the same")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let s = symmetric(values);
    run.add(|_, sensed| s * sensed);
}

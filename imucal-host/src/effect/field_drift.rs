//! The field in the room drifts: `mag.field_drift`.

use super::{Act, Effect, Parameter, SensorKind, Truth, Words, XYZ, vector};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "The field in the room changes steadily: daily variation, machines that warm up.",
        remedy: "Record a second magnetometer at rest in the room and subtract its changes.",
        needs: "The same attitude at the beginning and at the end.",
    };
    Effect::new("mag.field_drift", Act::Field(alter), Parameter::amplitudes(&XYZ, "uT/s", 5e-4), words)
        .on(SensorKind::Mag)
        .like("mag.bias_drift", "several attitudes, each early and late: one stays with the room")
        .like("mag.temp_bias", "several attitudes at each of two temperatures")
}

fn alter(values: &[f64], row: &mut Truth) {
    let slope_p = vector(values, 0);
    let c_t_p = row.c_t_p;
    row.add_field(&c_t_p, &(slope_p * row.time));
}

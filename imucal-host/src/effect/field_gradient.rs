//! The field is not uniform over the sensor's path: `mag.field_gradient`.
//!
//! ```text
//! B^p += G C_t_p r      G symmetric without trace (no currents, no sources between)
//! ```

use nalgebra::Matrix3;

use super::{Act, Effect, Parameter, SensorKind, Truth, Words, vector};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "Iron or magnets near the rig bend the field, and the sensor travels through it off the centre.",
        remedy: "Move the iron away or the magnetometer into the centre of rotation.",
        needs: "Rests that carry the sensor to all sides of the centre.",
    };
    let mut parameters = Parameter::amplitudes(&["xx", "yy", "xy", "xz", "yz"], "uT/m", 3.0);
    parameters.extend(["r_x", "r_y", "r_z"].map(|name| {
        // An arm may point either way.
        Parameter { range: (-0.3, 0.3), ..Parameter::shape(name, "m", 0.05) }
    }));
    Effect::new("mag.field_gradient", Act::Field(alter), parameters, words)
        .on(SensorKind::Mag)
        .like("mag.gimbal_hard_iron_outer", "the unit remounted on the other side of the centre")
        .like("mag.gimbal_soft_iron_outer", "the unit remounted on the other side of the centre")
}

fn alter(values: &[f64], row: &mut Truth) {
    let [xx, yy, xy, xz, yz, ..] = *values else { return };
    let gradient = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, -xx - yy);
    let arm_t = vector(values, 5);
    let c_t_p = row.c_t_p;
    row.add_field(&c_t_p, &(gradient * (c_t_p * arm_t)));
}

//! The field in the room is steeper than given: `mag.field_dip`, a term of recordings whose site does not give the field.

use imucal_core::rotation;
use nalgebra::Vector3;

use super::{Act, Effect, Free, Parameter, Part, SensorKind, Truth, Words};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "The field points further down, in its own vertical plane, than the model says.",
        remedy: "Give the site's field in the manifest.",
        needs: "A magnetometer in three or more attitudes, and the vertical.",
    };
    Effect::new("mag.field_dip", Act::Field(alter), vec![Parameter::amplitude("dip", "rad", 0.03)], words)
        .part(Part::Nuisance(Free::FieldUnknown))
        .on(SensorKind::Mag)
}

fn alter(values: &[f64], row: &mut Truth) {
    let angle = values.first().copied().unwrap_or(0.0);
    let c_t_n = row.c_p_n * row.c_t_p;
    let b_n = c_t_n * row.b_t;
    row.add_field(&c_t_n, &(dipped(&b_n, angle) - b_n));
}

/// A field with components in n that points further down by an angle, rad: turned about the horizontal axis across it. A
/// vertical field has no such axis, and stays.
pub(super) fn dipped(b_n: &Vector3<f64>, angle: f64) -> Vector3<f64> {
    let across = b_n.cross(&Vector3::z()).try_normalize(0.0);
    across.map_or(*b_n, |across| rotation::exp(&(across * angle)) * b_n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::{Motion, Tumble};

    #[test]
    fn the_field_keeps_its_length_and_heading_and_points_further_down() {
        let plain = Tumble::new(4, 2).truth(12.0, &|_| ());
        let mut row = plain;
        alter(&[0.1], &mut row);
        let of = |truth: &Truth| truth.c_p_n * truth.c_t_p * truth.b_t;
        let (before, after) = (of(&plain), of(&row));
        assert!((after.norm() - before.norm()).abs() < 1e-12);
        assert!((after.y.atan2(after.x) - before.y.atan2(before.x)).abs() < 1e-12);
        let dip = |b: &Vector3<f64>| b.z.atan2(b.xy().norm());
        assert!((dip(&after) - dip(&before) - 0.1).abs() < 1e-12);
    }
}

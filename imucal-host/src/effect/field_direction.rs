//! A simulator's field points elsewhere than the site's: `mag.field_direction`.
//!
//! ```text
//! b_n → Exp(δ e_a) Exp(ψ e_z) b_n      e_z down, e_a horizontal, across the field
//! ```
//!
//! | symbol | parameter |
//! | --- | --- |
//! | ψ | `declination`: the field is turned about the vertical, from north to east |
//! | δ | `dip`: it points further down |
//!
//! It turns the stream's own field about the vertical of the stream: a heading that drifts with the stream's rate changes
//! nothing. Not modelled: another strength, which the magnetometer's scale takes up. Angles of half a radian are found to half a
//! milliradian, which is more than the errors that are stated (`tests/diagnosis_world.rs`).

use imucal_core::rotation;
use nalgebra::Vector3;

use super::{Act, Effect, Needs, Parameter, SensorKind, Truth, Words, field_dip::dipped};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "The simulator's field points elsewhere than the site's: it has another declination or another dip.",
        remedy: "Enter the site's field in the simulator, as of a model of Earth's field (WMM or IGRF), or turn its field by these angles.",
        needs: "A simulator's stream with a field, a magnetometer, and attitudes that differ by more than a turn about one axis.",
    };
    let parameters = Parameter::amplitudes(&["declination", "dip"], "rad", 0.1);
    Effect::new("mag.field_direction", Act::Field(alter), parameters, words)
        .on(SensorKind::Mag)
        .needing(Needs::STREAM)
        .like(
            "mag.misalignment",
            "attitudes turned about horizontal axes: the field's direction stays with the room",
        )
        .like("mag.transient", "a longer recording: the one passes")
}

fn alter(values: &[f64], row: &mut Truth) {
    let [declination, dip] = *values else { return };
    let c_t_n = row.c_p_n * row.c_t_p;
    let b_n = c_t_n * row.b_t;
    let turned = dipped(&(rotation::exp(&(Vector3::z() * declination)) * b_n), dip);
    row.add_field(&c_t_n, &(turned - b_n));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::{Motion, Tumble};

    #[test]
    fn the_field_keeps_its_length_and_has_another_declination_and_dip() {
        let plain = Tumble::new(4, 2).truth(12.0, &|_| ());
        let mut row = plain;
        alter(&[0.2, -0.1], &mut row);
        let of = |truth: &Truth| truth.c_p_n * truth.c_t_p * truth.b_t;
        let (before, after) = (of(&plain), of(&row));
        assert!((after.norm() - before.norm()).abs() < 1e-12);
        assert!((after.y.atan2(after.x) - before.y.atan2(before.x) - 0.2).abs() < 1e-12);
        let dip = |b: &Vector3<f64>| b.z.atan2(b.xy().norm());
        assert!((dip(&after) - dip(&before) + 0.1).abs() < 1e-12);
    }
}

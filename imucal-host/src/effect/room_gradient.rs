//! The field of a room changes from place to place: `mag.room_gradient`, a term of recordings with a position.
//!
//! ```text
//! b_p += G (p − p̄)      G symmetric, without trace
//! ```
//!
//! Source: J. D. Jackson, Classical Electrodynamics (3rd ed.), ch. 5: without currents and sources the field has neither curl
//! nor divergence. Not modelled: a gradient that changes from place to place itself, as next to iron.

use nalgebra::Matrix3;

use super::{Act, Effect, Free, Parameter, Part, SensorKind, Truth, Words};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "Iron in the building bends the field, and the sensor is carried through it.",
        remedy: "None is needed: it is the room's. Stay in one place, or far from iron.",
        needs: "Positions that differ along all three axes.",
    };
    let parameters = Parameter::amplitudes(&["xx", "yy", "xy", "xz", "yz"], "uT/m", 3.0);
    Effect::new("mag.room_gradient", Act::Field(alter), parameters, words)
        .part(Part::Nuisance(Free::Placed))
        .on(SensorKind::Mag)
}

fn alter(values: &[f64], row: &mut Truth) {
    let [xx, yy, xy, xz, yz] = *values else { return };
    let gradient = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, -xx - yy);
    let c_t_p = row.c_t_p;
    row.add_field(&c_t_p, &(gradient * row.p_p));
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::simulator::{Motion, Tumble};

    #[test]
    fn the_field_changes_with_the_place_and_not_with_the_attitude() {
        for time in [3.0, 14.0, 22.0] {
            let mut row = Tumble::new(5, 3).truth(time, &|_| ());
            row.p_p = Vector3::new(0.5, -0.2, 1.0);
            let before = row.c_t_p * row.b_t;
            alter(&[1.0, 2.0, 0.5, -1.0, 0.3], &mut row);
            let change = row.c_t_p * row.b_t - before;
            let expected = Vector3::new(0.5 - 0.1 - 1.0, 0.25 - 0.4 + 0.3, -0.5 - 0.06 - 3.0);
            assert!((change - expected).norm() < 1e-12, "{change}");
        }
    }
}

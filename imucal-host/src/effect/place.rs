//! The field where the sensor lies is not that where a hand turns it: `mag.place`, a term of recordings without a rig.
//!
//! ```text
//! b += C_p^t d      where nothing turns for a while
//! ```

use super::{Act, Effect, Parameter, SensorKind, Truth, Words, XYZ, vector};

/// It lies where it does not turn by more than this rate, rad/s, for so long to either side, s.
const STILL: f64 = 0.05;
const AROUND: f64 = 1.0;

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "Steel in the table bends the field where the sensor lies, and less where a hand turns it.",
        remedy: "Begin and end on wood, away from steel.",
        needs: "A rest, and turns elsewhere.",
    };
    let parameters = Parameter::amplitudes(&XYZ, "uT", 1.0);
    Effect::new("mag.place", Act::Field(alter), parameters, words).on(SensorKind::Mag)
}

fn alter(values: &[f64], rows: &mut [Truth]) {
    let field_p = vector(values, 0);
    let turns: Vec<f64> = rows.iter().filter(|row| row.w_pt_t.norm() > STILL).map(|row| row.time).collect();
    for row in rows {
        let next = turns.partition_point(|time| *time < row.time - AROUND);
        if turns.get(next).is_none_or(|time| *time > row.time + AROUND) {
            let c_t_p = row.c_t_p;
            row.add_field(&c_t_p, &field_p);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::{Motion, Tumble};
    use nalgebra::Vector3;

    #[test]
    fn the_field_differs_where_it_lies_and_not_where_it_is_turned() {
        let tumble = Tumble::new(4, 2);
        let plain: Vec<Truth> = (0..1200).map(|k| tumble.truth(0.0125 * f64::from(k), &|_| ())).collect();
        let mut rows = plain.clone();
        alter(&[0.5, 0.0, -1.0], &mut rows);
        let differs = |time: f64| {
            let row = (time / 0.0125) as usize;
            plain[row].c_t_p * (rows[row].b_t - plain[row].b_t)
        };
        assert!((differs(5.0) - Vector3::new(0.5, 0.0, -1.0)).norm() < 1e-12);
        assert!(plain[880].w_pt_t.norm() > STILL && differs(11.0).norm() == 0.0);
    }
}

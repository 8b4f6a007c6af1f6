//! What the reference is fixed to slips against the sensor: `ref.mount_slip`.
//!
//! ```text
//! C_t_n → C_t_n Exp(θ)      f_t → Exp(θ)ᵀ f_t,  w_t → Exp(θ)ᵀ w_t,  b_t → Exp(θ)ᵀ b_t      from t_start to t_end
//! ```
//!
//! All sensors see the same turn at once. A slip that nobody mends has no end. Not modelled: the slip itself, which is over
//! within a block or two, and one that goes on creeping.

use imucal_core::rotation::exp;

use super::{Act, Effect, Needs, Parameter, Truth, Words, vector};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "From an instant on the sensor is turned against what the reference follows: markers or the sensor have \
                slipped in their mount.",
        remedy: "Fasten markers and sensor to one rigid body; split the recording there.",
        needs: "A reference attitude or a simulator's stream, and movement before and after.",
    };
    let mut parameters = Parameter::amplitudes(&["turn_x", "turn_y", "turn_z"], "rad", 0.02);
    parameters.extend([Parameter::instant("t_start", 0.4), Parameter::instant("t_end", 0.8)]);
    Effect::new("ref.mount_slip", Act::Field(alter), parameters, words)
        .needing(Needs::OUTSIDE)
        .like("P.bias_step", "the other sensors: a slip turns all of them at once")
        .like("ref.motion_mismatch", "its end: a slip stays")
}

fn alter(values: &[f64], row: &mut Truth) {
    let [.., start, end] = *values else { return };
    if !(start..end).contains(&row.time) {
        return;
    }
    let turn = exp(&vector(values, 0));
    for value in [&mut row.f_t, &mut row.b_t, &mut row.w_it_t, &mut row.dw_it_t, &mut row.w_pt_t] {
        *value = turn.tr_mul(value);
    }
    row.c_t_p *= turn;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::{Motion, Tumble};

    #[test]
    fn all_that_is_sensed_turns_from_the_slip_on_and_nothing_before() {
        let values = [0.02, -0.01, 0.03, 15.0, f64::INFINITY];
        let slipped = |time: f64| {
            let plain = Tumble::new(5, 3).truth(time, &|_| ());
            let mut row = Truth { time, ..plain };
            alter(&values, &mut row);
            (plain, row)
        };
        let (before, same) = slipped(14.9);
        assert_eq!((before.f_t, before.w_it_t, before.b_t), (same.f_t, same.w_it_t, same.b_t));
        let (plain, row) = slipped(16.0);
        // What is sensed is the same in the room.
        for (own, other) in [(row.f_t, plain.f_t), (row.b_t, plain.b_t), (row.w_it_t, plain.w_it_t)] {
            assert!((row.c_t_p * own - plain.c_t_p * other).norm() < 1e-12);
            assert!((own - other).norm() > 1e-4);
        }
    }
}

//! The real machine moved otherwise than the simulator's: `ref.motion_mismatch`.
//!
//! ```text
//! C_q_t = Exp(θ s(t))      p_t = d s(t)      s = sin⁴(π (t − t_start) / (t_end − t_start)) from t_start to t_end, else 0
//! f_q = C_t_q (f + d s̈)      w_q = C_t_q w + θ ṡ      b_q = C_t_q b
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | θ | turn, rad, in the table's axes |
//! | d | way, m, in the table's axes |
//!
//! All sensors see it at once and agree. Not modelled: turns so large that their order counts, and that the way turns with the table.

use std::f64::consts::PI;

use imucal_core::rotation::exp;
use nalgebra::Vector3;

use super::{Act, Effect, Parameter, Part, Spoils, Truth, Words, vector};

/// Its id.
pub const ID: &str = "ref.motion_mismatch";

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "For a while the real machine moved otherwise than the simulator's: a slip, another gait, a contact that \
                the simulator lacks. All sensors disagree with it and agree with one another.",
        remedy: "Correct the simulator's contact and motion there; no sensor is to blame.",
        needs: "Two sensors that see the movement, and stretches in which the simulator is right.",
    };
    let mut parameters = Parameter::amplitudes(&["turn_x", "turn_y", "turn_z"], "rad", 0.03);
    parameters.extend(Parameter::amplitudes(&["way_x", "way_y", "way_z"], "m", 0.03));
    parameters.extend([Parameter::instant("t_start", 0.4), Parameter::instant("t_end", 0.45)]);
    Effect::new(ID, Act::Field(alter), parameters, words)
        .part(Part::Fault(Spoils::Passage))
        .like("clk.time_offset", "a delay is there whenever the movement is as brisk")
        .like("P.bias_step", "the other sensors: a fault of one of them is seen by no other")
}

fn alter(values: &[f64], row: &mut Truth) {
    let [.., start, end] = *values else { return };
    let length = end - start;
    let x = PI * (row.time - start) / length;
    if !(0.0..=PI).contains(&x) {
        return;
    }
    let (theta, way) = (vector(values, 0), vector(values, 3));
    let (sine, cosine, pace) = (libm::sin(x), libm::cos(x), PI / length);
    let cube = sine * sine * sine;
    let (share, first) = (cube * sine, 4.0 * cube * cosine * pace);
    let second = 4.0 * sine * sine * (3.0 * cosine * cosine - sine * sine) * pace * pace;
    let into = |v: &Vector3<f64>| exp(&(theta * share)).tr_mul(v);
    row.f_t = into(&(row.f_t + way * second));
    row.b_t = into(&row.b_t);
    let (w, dw) = (into(&row.w_it_t), into(&row.dw_it_t));
    row.dw_it_t = dw + w.cross(&theta) * first + theta * second;
    row.w_it_t = w + theta * first;
    row.w_pt_t = into(&row.w_pt_t) + theta * first;
    row.c_t_p *= exp(&(theta * share));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::{Motion, Tumble};

    /// A hand that turns, otherwise than it should from 14 to 17 s.
    fn truth(time: f64) -> (Truth, Truth) {
        let plain = Tumble::new(5, 3).truth(time, &|_| ());
        let mut row = Truth { time, ..plain };
        alter(&[0.04, -0.02, 0.03, 0.01, 0.02, -0.03, 14.0, 17.0], &mut row);
        (plain, row)
    }

    #[test]
    fn the_rate_is_that_of_the_attitude_and_nothing_is_altered_outside() {
        const STEP: f64 = 1e-4;
        for time in [14.4, 15.3, 16.1] {
            let turn = truth(time - STEP).1.c_t_p.tr_mul(&truth(time + STEP).1.c_t_p);
            let rate = imucal_core::rotation::log(&turn) / (2.0 * STEP);
            let own = truth(time).1;
            assert!((own.w_pt_t - rate).norm() < 1e-6, "{time}: {} {rate}", own.w_pt_t);
            let change = (truth(time + STEP).1.w_it_t - truth(time - STEP).1.w_it_t) / (2.0 * STEP);
            assert!((own.dw_it_t - change).norm() < 1e-4, "{time}: {} {change}", own.dw_it_t);
        }
        for time in [13.9, 17.1] {
            let (plain, row) = truth(time);
            assert_eq!(Truth { time, ..plain }, row);
        }
    }

    #[test]
    fn the_way_is_felt_as_its_acceleration() {
        const STEP: f64 = 1e-3;
        let share = |time: f64| libm::pow(libm::sin(PI * (time - 14.0) / 3.0), 4.0);
        let time = 15.2;
        let second = (share(time + STEP) - 2.0 * share(time) + share(time - STEP)) / (STEP * STEP);
        let mut row = Tumble::new(5, 3).truth(time, &|_| ());
        let plain = row.f_t;
        row.time = time;
        alter(&[0.0, 0.0, 0.0, 0.01, 0.02, -0.03, 14.0, 17.0], &mut row);
        assert!((row.f_t - plain - Vector3::new(0.01, 0.02, -0.03) * second).norm() < 1e-6);
    }
}

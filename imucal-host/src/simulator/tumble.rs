//! A hand that tumbles a sensor: rests in random attitudes, and turns between them.
//!
//! Between rests the attitude follows the shortest turn about one axis, its angle a raised cosine of time, so that
//! rate and angle are exact functions of time. Truth knows no sensor: attitude, rate, specific force and field only.
//! Not modelled: linear acceleration of the hand, tremor at rest.

use std::f64::consts::PI;

use nalgebra::{Unit, UnitQuaternion, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, UnitSphere};

use super::{
    place::Place,
    recent::Recent,
    truth::{Motion, in_the_open},
};
use crate::{
    effect::{Machine, Truth},
    recording::manifest::{Rig, RigKind},
};

/// A programme of rests and turns.
#[derive(Clone, Debug)]
pub struct Tumble {
    /// Attitudes `C_q_n` of the rests.
    attitudes: Vec<UnitQuaternion<f64>>,
    /// First rest, other rests and turns, s.
    durations: (f64, f64, f64),
    /// Where.
    place: Place,
}

/// Where the programme is.
enum Phase {
    Rest(usize),
    /// From a rest to the next, at this share of the time.
    Turn(usize, f64),
}

impl Tumble {
    /// Rests in `rests` attitudes drawn from a seed, each turned from the last by 40° to 160° about a random axis.
    pub fn new(rests: usize, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut attitudes = vec![UnitQuaternion::identity()];
        while attitudes.len() < rests {
            let axis = Unit::new_normalize(Vector3::from(UnitSphere.sample(&mut rng)));
            let angle = 40.0 + 120.0 * (rng.next_u32() as f64 / f64::from(u32::MAX));
            let turned =
                attitudes[attitudes.len() - 1] * UnitQuaternion::from_axis_angle(&axis, angle.to_radians());
            attitudes.push(turned);
        }
        Self::through(attitudes, (10.0, 3.0, 2.0))
    }

    /// Rests in the attitudes given, `C_q_n`, at least one; durations of the first rest, of the others and of turns, s.
    pub fn through(attitudes: Vec<UnitQuaternion<f64>>, durations: (f64, f64, f64)) -> Self {
        debug_assert!(!attitudes.is_empty());
        Self { attitudes, durations, place: Place::ankara() }
    }

    fn phase(&self, time: f64) -> Phase {
        let (first, rest, turn) = self.durations;
        if time < first {
            return Phase::Rest(0);
        }
        let since = time - first;
        let index = (since / (rest + turn)).floor() as usize;
        let within = since - index as f64 * (rest + turn);
        if index + 1 >= self.attitudes.len() || within >= turn {
            return Phase::Rest((index + 1).min(self.attitudes.len() - 1));
        }
        Phase::Turn(index, within / turn)
    }
}

impl Motion for Tumble {
    fn duration(&self) -> f64 {
        let (first, rest, turn) = self.durations;
        first + (self.attitudes.len() - 1) as f64 * (rest + turn)
    }

    /// No rig turns it: the table is the enclosure.
    fn truth_among(&self, time: f64, _: &dyn Fn(&mut Machine), recent: &mut Recent) -> Truth {
        let (attitude, rate, acceleration) = match self.phase(time) {
            Phase::Rest(k) => (self.attitudes[k], Vector3::zeros(), Vector3::zeros()),
            Phase::Turn(k, share) => {
                let turn = (self.attitudes[k].inverse() * self.attitudes[k + 1]).scaled_axis();
                let (sin, cos) = libm::sincos(PI * share);
                let pace = PI / self.durations.2;
                let here = self.attitudes[k] * UnitQuaternion::from_scaled_axis(turn * (0.5 * (1.0 - cos)));
                (here, turn * (0.5 * pace * sin), turn * (0.5 * pace * pace * cos))
            }
        };
        let c_t_n = attitude.to_rotation_matrix();
        in_the_open(time, c_t_n.matrix(), rate, acceleration, &self.place, recent)
    }

    fn rig(&self) -> Rig {
        Rig { kind: RigKind::Hand, axes: None }
    }

    fn place(&self) -> Place {
        self.place
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_is_the_derivative_of_the_attitude() {
        let tumble = Tumble::new(6, 1);
        let h = 1e-5;
        for k in 0..200 {
            let t = 9.0 + f64::from(k) * 0.1;
            let at = |t| tumble.truth(t, &|_| ());
            let (before, here, after) = (at(t - h), at(t), at(t + h));
            // A direction fixed in n turns the other way in t: df/dt = −w × f.
            let numeric = (after.f_t - before.f_t) / (2.0 * h);
            assert!((numeric + here.w_it_t.cross(&here.f_t)).norm() < 2e-3, "at {t} s");
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_motion() {
        let at = |seed| Tumble::new(9, seed).truth(33.3, &|_| ());
        assert_eq!(at(4), at(4));
        assert_ne!(at(4), at(5));
    }
}

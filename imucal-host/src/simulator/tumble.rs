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

/// Earth's rotation, rad/s (IERS conventions 2010).
const EARTH_RATE: f64 = 7.292_115e-5;

/// What is true at one time, in the enclosure's frame `q`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// Specific force, m/s².
    pub f_q: Vector3<f64>,
    /// Rate against inertial space, rad/s.
    pub w_iq_q: Vector3<f64>,
    /// Magnetic field, µT.
    pub b_q: Vector3<f64>,
}

/// A programme of rests and turns.
#[derive(Clone, Debug)]
pub struct Tumble {
    /// Attitudes `C_q_n` of the rests.
    attitudes: Vec<UnitQuaternion<f64>>,
    /// First rest, other rests and turns, s.
    durations: (f64, f64, f64),
    /// Local gravity, m/s².
    pub gravity: f64,
    /// Latitude, rad.
    pub latitude: f64,
    /// Earth's field in n, µT.
    pub field_n: Vector3<f64>,
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
        Self {
            attitudes,
            durations,
            gravity: 9.7997,
            latitude: 39.87f64.to_radians(),
            field_n: Vector3::new(25.3, 2.6, 40.1),
        }
    }

    /// Length of the programme, s.
    pub fn duration(&self) -> f64 {
        let (first, rest, turn) = self.durations;
        first + (self.attitudes.len() - 1) as f64 * (rest + turn)
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

    /// The truth at a time from 0 to [`duration`](Self::duration), s.
    pub fn truth(&self, time: f64) -> Truth {
        let (attitude, rate) = match self.phase(time) {
            Phase::Rest(k) => (self.attitudes[k], Vector3::zeros()),
            Phase::Turn(k, share) => {
                let turn = (self.attitudes[k].inverse() * self.attitudes[k + 1]).scaled_axis();
                let progress = 0.5 * (1.0 - (PI * share).cos());
                let speed = 0.5 * PI * (PI * share).sin() / self.durations.2;
                (self.attitudes[k] * UnitQuaternion::from_scaled_axis(turn * progress), turn * speed)
            }
        };
        let earth_n = Vector3::new(self.latitude.cos(), 0.0, -self.latitude.sin()) * EARTH_RATE;
        let to_q = attitude.inverse();
        Truth {
            f_q: to_q * Vector3::new(0.0, 0.0, -self.gravity),
            w_iq_q: rate + to_q * earth_n,
            b_q: to_q * self.field_n,
        }
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
            let (before, here, after) = (tumble.truth(t - h), tumble.truth(t), tumble.truth(t + h));
            // A direction fixed in n turns the other way in q: df/dt = −w × f.
            let numeric = (after.f_q - before.f_q) / (2.0 * h);
            assert!((numeric + here.w_iq_q.cross(&here.f_q)).norm() < 2e-3, "at {t} s");
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_motion() {
        assert_eq!(Tumble::new(9, 4).truth(33.3), Tumble::new(9, 4).truth(33.3));
        assert_ne!(Tumble::new(9, 4).truth(33.3), Tumble::new(9, 5).truth(33.3));
    }
}

//! What rows of a run have in common, computed once: most stand on the base of the one before them.

use nalgebra::{Matrix3, Vector3};

use super::{gimbal::base, place::Place};
use crate::effect::Machine;

/// What the last row was asked for, and what it was answered.
#[derive(Clone, Copy, Debug, Default)]
pub struct Recent {
    base: Last<(f64, [f64; 2]), Matrix3<f64>>,
    earth_rate: Last<f64, Vector3<f64>>,
}

impl Recent {
    /// C_p_n of a rig's base.
    pub fn base(&mut self, machine: &Machine) -> Matrix3<f64> {
        self.base.get((machine.heading, machine.tilt), |(heading, tilt)| base(heading, tilt))
    }

    /// Earth's rotation in n, rad/s.
    pub fn earth_rate_n(&mut self, place: &Place) -> Vector3<f64> {
        self.earth_rate.get(place.latitude_deg, |_| place.earth_rate_n())
    }
}

/// The last answer, and what was asked.
#[derive(Clone, Copy, Debug, Default)]
struct Last<K, V>(Option<(K, V)>);

impl<K: PartialEq + Copy, V: Copy> Last<K, V> {
    fn get(&mut self, asked: K, answer: impl FnOnce(K) -> V) -> V {
        match self.0 {
            Some((last, value)) if last == asked => value,
            _ => self.0.insert((asked, answer(asked))).1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_base_and_another_place_are_not_taken_for_the_last() {
        let mut recent = Recent::default();
        let mut machine = Machine::exact([Vector3::z(), Vector3::y(), Vector3::x()]);
        let mut place = Place::ankara();
        for k in 0..6 {
            // Each is asked for twice.
            let angle = 0.1 * f64::from(k / 2);
            (machine.heading, machine.tilt, place.latitude_deg) = (angle, [0.0, 0.3 * angle], 100.0 * angle);
            assert_eq!(recent.base(&machine), base(machine.heading, machine.tilt));
            assert_eq!(recent.earth_rate_n(&place), place.earth_rate_n());
        }
    }
}

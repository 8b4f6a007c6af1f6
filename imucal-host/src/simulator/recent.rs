//! What rows of a run have in common, computed once: most stand on the base of the one before them.

use nalgebra::{Matrix3, Vector3};

use super::{gimbal::base, place::Place};
use crate::effect::Machine;

/// What the last row was asked for, and what it was answered.
#[derive(Clone, Copy, Debug, Default)]
pub struct Recent {
    base: Last<(f64, [f64; 2]), Matrix3<f64>>,
    earth_rate: Last<f64, Vector3<f64>>,
    /// The first row that is not before the time asked for last.
    row: usize,
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

    /// The row nearest to a time, s: as a rule soon after the last one.
    pub fn nearest(&mut self, times: &[f64], time: f64) -> usize {
        // Most often the row behind the last one.
        if times.get(self.row).is_some_and(|t| *t < time) && times.get(self.row + 1) == Some(&time) {
            self.row += 1;
            return self.row;
        }
        let begins_before =
            self.row.checked_sub(1).is_none_or(|row| times.get(row).is_some_and(|t| *t < time));
        let from = if begins_before { self.row.min(times.len()) } else { 0 };
        // Many come soon after the one before: steps from there, each twice the last, end behind it.
        let (mut low, mut high, mut step) = (from, from, 1);
        while times.get(high).is_some_and(|t| *t < time) {
            (low, high) = (high + 1, high + step);
            step *= 2;
        }
        let high = high.min(times.len());
        self.row = low + times[low..high].partition_point(|t| *t < time);
        let after = self.row.min(times.len().saturating_sub(1));
        let before = after.saturating_sub(1);
        match (times.get(before), times.get(after)) {
            (Some(b), Some(a)) if time - b < a - time => before,
            _ => after,
        }
    }
}

/// The row nearest to a time, s.
pub fn nearest(times: &[f64], time: f64) -> usize {
    Recent::default().nearest(times, time)
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
    fn the_nearest_row_does_not_depend_on_what_was_asked_before() {
        let times: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k) + 0.003 * f64::from(k % 3)).collect();
        let asked = (0..300).map(|k| 0.009 * f64::from(k * 7 % 300) - 0.2);
        let in_order = (0..300).map(|k| 0.0081 * f64::from(k) - 0.2);
        let mut recent = Recent::default();
        for time in asked.chain(in_order).chain([times[4], times[4], times[5], times[6], times[6], f64::NAN])
        {
            let found = recent.nearest(&times, time);
            assert_eq!(found, nearest(&times, time), "{time}");
            let apart = |row: usize| (times[row] - time).abs();
            assert!(time.is_nan() || (0..200).all(|row| apart(found) <= apart(row)), "{time}");
        }
        assert_eq!(recent.nearest(&[], 1.0), 0);
    }

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

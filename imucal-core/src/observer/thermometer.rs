//! Whether a thermometer's readings are those of a sensor that warms and cools, as they come.
//!
//! | fault | criterion |
//! | --- | --- |
//! | it jumps | one reading differs from the one before by more than [`LEAP`] and [`FASTEST`] times the time between them |
//! | it is stuck | one reading is repeated for longer than [`LONG`] and [`LONGER`] times as long as any other, and it is left by a leap of [`STEPS`] of its steps, or not at all |
//!
//! A sensor has a thermal mass: a package of a few grams warms by some tenths of a kelvin a second. A soak at a constant
//! temperature is not stuck where the thermometer's last digit moves, or where it goes on by single steps. Source: ours.
//! Not seen: a thermometer that is stuck from beginning to end, which is a constant temperature; a coarse one that
//! rests on one digit until the end counts as stuck.

use crate::scalar::Scalar;

/// The least jump, K.
pub const LEAP: f64 = 3.0;
/// How fast a sensor warms at most, K/s.
pub const FASTEST: f64 = 1.0;
/// The shortest repetition that is looked at, µs.
pub const LONG: u64 = 30_000_000;
/// See the table.
pub const LONGER: u64 = 10;
/// See the table.
pub const STEPS: f64 = 4.0;
/// A leap of less is a step like others, K.
const LEAST_LEAP: f64 = 0.5;

/// What is wrong with a thermometer; times in µs on the clock of the readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ThermometerFault<T> {
    /// It jumps as no sensor warms.
    Jump {
        /// When.
        at: u64,
        /// By how much, K.
        by: T,
    },
    /// It repeats one reading while it ought to change.
    Stuck {
        /// From when.
        from: u64,
        /// For how long.
        duration: u64,
        /// The longest other repetition.
        usual: u64,
    },
}

/// A repetition of one reading, and the size of the step that ended it, K.
#[derive(Clone, Copy, Debug)]
struct Run<T> {
    from: u64,
    duration: u64,
    left_by: Option<T>,
}

/// Follows a thermometer's readings, of which it keeps none but the last.
#[derive(Clone, Copy, Debug)]
pub struct ThermometerObserver<T: Scalar> {
    last: Option<(u64, T)>,
    /// When the reading began that goes on.
    from: u64,
    runs: u32,
    /// Smallest step, K.
    step: T,
    longest: Run<T>,
    usual: u64,
    jump: Option<(u64, T)>,
}

impl<T: Scalar> Default for ThermometerObserver<T> {
    fn default() -> Self {
        let none = Run { from: 0, duration: 0, left_by: None };
        Self { last: None, from: 0, runs: 0, step: T::LARGEST, longest: none, usual: 0, jump: None }
    }
}

impl<T: Scalar> ThermometerObserver<T> {
    /// Takes a reading, °C, of a time, µs; one that is not finite is left out.
    #[inline]
    pub fn push(&mut self, time: u64, reading: T) {
        match &mut self.last {
            Some((last, value)) if value.same(reading) => *last = time,
            _ => self.change(time, reading),
        }
    }

    /// Another reading than before.
    #[inline(never)]
    fn change(&mut self, time: u64, reading: T) {
        if !reading.finite() {
            return;
        }
        if let Some((last, value)) = self.last {
            let by = reading - value;
            let size = if by < T::zero() { -by } else { by };
            let since = time.saturating_sub(last);
            let seconds = T::whole(u32::try_from(since).unwrap_or(u32::MAX)) * T::of(1e-6);
            if self.jump.is_none() && size > T::of(LEAP) + T::of(FASTEST) * seconds {
                self.jump = Some((time, by));
            }
            if size < self.step {
                self.step = size;
            }
            self.end(Some(size));
        }
        (self.last, self.from) = (Some((time, reading)), time);
        self.runs = self.runs.saturating_add(1);
    }

    fn end(&mut self, left_by: Option<T>) {
        let until = self.last.map_or(0, |(last, _)| last);
        let run = Run { from: self.from, duration: until.saturating_sub(self.from), left_by };
        if run.duration >= self.longest.duration {
            (self.usual, self.longest) = (self.longest.duration, run);
        } else if run.duration > self.usual {
            self.usual = run.duration;
        }
    }

    /// What is wrong with the readings so far.
    pub fn fault(&self) -> Option<ThermometerFault<T>> {
        if let Some((at, by)) = self.jump {
            return Some(ThermometerFault::Jump { at, by });
        }
        let mut all = *self;
        all.end(None);
        let Run { from, duration, left_by } = all.longest;
        let (steps, least) = (all.step * T::of(STEPS), T::of(LEAST_LEAP));
        let leaps = left_by.is_none_or(|size| size > steps && size > least);
        let long = duration > LONG && duration > all.usual.saturating_mul(LONGER);
        (all.runs > 2 && long && leaps).then_some(ThermometerFault::Stuck {
            from,
            duration,
            usual: all.usual,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An hour at 1 Hz: up by 30 K and down again, in steps of 0.05 K that flicker; readings changed by time.
    fn ramp(change: impl Fn(usize, f32) -> f32) -> Option<ThermometerFault<f32>> {
        let mut observer = ThermometerObserver::default();
        for at in 0..3600usize {
            let t = at as f64;
            let truth = 20.0 + 30.0 * (1.0 - (t / 1800.0 - 1.0).abs()) + 0.04 * (7.1 * t).sin();
            observer.push(at as u64 * 1_000_000, change(at, ((truth / 0.05).round() * 0.05) as f32));
        }
        observer.fault()
    }

    #[test]
    fn a_ramp_up_and_down_is_a_thermometer_s() {
        assert_eq!(ramp(|_, value| value), None);
    }

    #[test]
    fn a_reading_that_stays_while_the_ramp_goes_on_is_stuck() {
        let to_the_end = ramp(|at, value| if at >= 2400 { 40.05 } else { value });
        assert!(matches!(to_the_end, Some(ThermometerFault::Stuck { .. })), "{to_the_end:?}");
        let left = ramp(|at, value| if (600..900).contains(&at) { 30.0 } else { value });
        assert!(left.is_some(), "{left:?}");
    }

    #[test]
    fn one_wild_reading_is_a_jump() {
        let wild = ramp(|at, value| if at == 1000 { -45.0 } else { value });
        assert!(
            matches!(wild, Some(ThermometerFault::Jump { at: 1_000_000_000, by }) if by < -60.0),
            "{wild:?}"
        );
    }

    #[test]
    fn a_soak_that_a_coarse_thermometer_leaves_by_single_steps_is_not_stuck() {
        assert_eq!(ramp(|_, value| (value.min(40.0) / 0.5).round() * 0.5), None);
    }

    #[test]
    fn a_reading_that_is_no_number_is_left_out() {
        assert_eq!(ramp(|at, value| if at % 7 == 0 { f32::NAN } else { value }), None);
        assert_eq!(ramp(|at, value| if at % 7 == 0 { f32::INFINITY } else { value }), None);
    }

    #[test]
    fn a_constant_reading_is_no_fault() {
        assert_eq!(ramp(|_, _| 25.0), None);
        assert_eq!(ThermometerObserver::<f32>::default().fault(), None);
    }
}

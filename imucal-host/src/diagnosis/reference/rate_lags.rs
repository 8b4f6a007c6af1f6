//! By how much later than a clock says a simulator's stream is, by windows of the rate.
//!
//! ```text
//! w_real(t) = c + g K w_sim(s(t) + lag)      within a window
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | K | gain and turn of the mount, by least squares over the whole recording |
//! | c, g | what a window adds and by how much it is stronger |
//! | s(t) | the stream's time of a row by the clock, s |
//!
//! Rates do not depend on an arm; accelerometer and magnetometer are taken the same way where they are to confirm what the rates show.
//! Where the clock is so far off that K means nothing, it is that of windows at the lags at which the sizes agree. Not modelled: a clock
//! that changes within a window.

use std::ops::Range;

use nalgebra::{Matrix2, Vector2, Vector3};
use rayon::prelude::*;

use super::{binned::Binned, moments::Moments};
use crate::simulator::StreamClock;

/// Length of a window, s, and the way to the next one.
pub(super) const WINDOW: f64 = 5.0;
const HOP: f64 = 2.5;
/// How far about the clock a window that does not agree with it is looked for, and in which steps, s.
const REACH: f64 = 2.0;
const SEARCH: f64 = 0.02;
/// Least correlation of a window with the stream at its lag, and of their sizes.
const AGREES: f64 = 0.95;
const ALIKE: f64 = 0.8;
/// Least part of the stream's size that a window repeats.
const REPEATED: f64 = 0.5;
/// What a window leaves counts as so many times fewer rows.
const TOGETHER: f64 = 4.0;
/// Rounds of fitting a lag; one that changes by less is found, s.
const ROUNDS: usize = 6;
const SETTLED: f64 = 1e-6;
/// A window whose lag is known less closely shows nothing, s.
const CLOSE: f64 = 3e-3;
/// A unit turns briskly whose rate scatters by this within a window, rad/s.
const BRISK: f64 = 0.1;
/// By a clock that explains a smaller share of the rates K is not known.
const FOLLOWED: f64 = 0.7;

/// The lag of a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lag {
    /// Mean time of the window on the recording's clock, s, each row by how fast the rate changes.
    pub time: f64,
    /// The stream's time there, less what the clock says, s.
    pub value: f64,
    /// Standard error, s.
    pub error: f64,
}

/// Recorded and simulated rates.
#[derive(Clone, Debug)]
pub(super) struct Rates {
    /// Recorded.
    pub real: Binned,
    /// Simulated.
    pub ideal: Binned,
}

impl Rates {
    /// The stream's rates in the recording's axes, where a clock is near enough for these to be known. `None` where nothing of
    /// the one lies beside the other.
    pub fn aligned(&self, clock: &StreamClock) -> Option<Self> {
        let by_clock = Moments::of(&self.pairs(0..self.real.time.len(), |time| clock.stream_time(time)));
        let is_followed = by_clock.unexplained() < 1.0 - FOLLOWED;
        let moments = if is_followed { by_clock } else { Moments::of(&self.by_sizes(clock)) };
        let k = moments.sensitivity();
        let mut aligned = self.clone();
        aligned.ideal.values.iter_mut().for_each(|rate| *rate = k * *rate);
        (moments.output > 0.0).then_some(aligned)
    }

    /// Recorded and simulated rates of rows, where both are given.
    fn pairs(&self, rows: Range<usize>, shown: impl Fn(f64) -> f64) -> Vec<(Vector3<f64>, Vector3<f64>)> {
        let pair = |row: usize| Some((self.real.values[row], self.ideal.at(shown(self.real.time[row]))?));
        rows.filter_map(pair).collect()
    }

    /// Of windows at the lags at which the rates' sizes agree.
    fn by_sizes(&self, clock: &StreamClock) -> Vec<(Vector3<f64>, Vector3<f64>)> {
        let of_window = |window: Range<f64>| {
            let rows = self.real.within(&window);
            let agreement = |lag: f64| {
                let pairs = self.pairs(rows.clone(), |time| clock.stream_time(time) + lag);
                let (real, ideal): (Vec<_>, Vec<_>) =
                    pairs.iter().map(|(y, x)| (Vector3::x() * y.norm(), Vector3::x() * x.norm())).unzip();
                (correlation(&real, &ideal), lag)
            };
            let best = searched().map(agreement).max_by(|a, b| a.0.total_cmp(&b.0));
            let (_, lag) = best.filter(|(most, _)| *most > ALIKE)?;
            Some(self.pairs(rows, |time| clock.stream_time(time) + lag))
        };
        let found: Vec<Option<Vec<_>>> = self.windows().into_par_iter().map(of_window).collect();
        found.into_iter().flatten().flatten().collect()
    }

    fn windows(&self) -> Vec<Range<f64>> {
        let (Some(first), Some(last)) = (self.real.time.first(), self.real.time.last()) else {
            return Vec::new();
        };
        let count = ((last - first - WINDOW) / HOP).max(0.0) as usize;
        (0..count).map(|at| first + HOP * at as f64).map(|start| start..start + WINDOW).collect()
    }

    /// Lags of the windows in which the stream is followed closely, in the order of their times.
    pub fn lags(&self, clock: &StreamClock) -> Vec<Lag> {
        let found: Vec<Option<Lag>> =
            self.windows().into_par_iter().map(|window| self.lag(clock, &window)).collect();
        let mut lags: Vec<Lag> = found.into_iter().flatten().collect();
        lags.sort_by(|a, b| a.time.total_cmp(&b.time));
        lags
    }

    /// Windows in which the recorded rate changes by enough to show a lag.
    pub fn brisk_windows(&self) -> usize {
        let is_brisk = |window: &Range<f64>| {
            let rates = &self.real.values[self.real.within(window)];
            let mean = rates.iter().sum::<Vector3<f64>>() / rates.len().max(1) as f64;
            rates.iter().map(|rate| (rate - mean).norm_squared()).sum::<f64>()
                > BRISK * BRISK * rates.len() as f64
        };
        self.windows().iter().filter(|window| is_brisk(window)).count()
    }

    /// Lag of one window: near the clock's own, or wherever the stream agrees best with it.
    fn lag(&self, clock: &StreamClock, window: &Range<f64>) -> Option<Lag> {
        let rows = self.real.within(window);
        let agreement = |lag: f64| {
            let of_row = |row: usize| self.ideal.at(clock.stream_time(self.real.time[row]) + lag);
            let ideal: Option<Vec<Vector3<f64>>> = rows.clone().map(of_row).collect();
            Some(correlation(&self.real.values[rows.clone()], &ideal?))
        };
        let agreeing = |lag: f64| {
            let lag = self.refined(clock, rows.clone(), lag)?;
            (agreement(lag.value)? > AGREES).then_some(lag)
        };
        let elsewhere = || {
            let tried = searched().filter_map(|lag| Some((agreement(lag)?, lag)));
            tried.max_by(|a, b| a.0.total_cmp(&b.0)).and_then(|(_, lag)| agreeing(lag))
        };
        agreeing(0.0).or_else(elsewhere).filter(|lag| lag.error < CLOSE)
    }

    /// The lag next to a first one.
    fn refined(&self, clock: &StreamClock, rows: Range<usize>, first: f64) -> Option<Lag> {
        let mut lag = Lag { time: 0.0, value: first, error: f64::INFINITY };
        for _ in 0..ROUNDS {
            let shift = self.shift(clock, rows.clone(), lag.value)?;
            lag = Lag { value: lag.value + shift.value, ..shift };
            if shift.value.abs() < SETTLED {
                break;
            }
        }
        Some(lag)
    }

    /// By how much a lag is too small.
    fn shift(&self, clock: &StreamClock, rows: Range<usize>, lag: f64) -> Option<Lag> {
        let step = self.ideal.step;
        let of_row = |row: usize| {
            let of = |lag: f64| self.ideal.at(clock.stream_time(self.real.time[row]) + lag);
            Some((self.real.values[row], of(lag)?, (of(lag + step)? - of(lag - step)?) / (2.0 * step)))
        };
        let of: Vec<(Vector3<f64>, Vector3<f64>, Vector3<f64>)> =
            rows.clone().map(of_row).collect::<Option<_>>()?;
        let n = of.len() as f64;
        let zero = Vector3::zeros();
        let (y, x, d) =
            of.iter().fold((zero, zero, zero), |(y, x, d), row| (y + row.0, x + row.1, d + row.2));
        let (y, x, d) = (y / n, x / n, d / n);
        let (mut normal, mut right, mut squares) = (Matrix2::zeros(), Vector2::zeros(), 0.0);
        // The lag is that of the time at which the rate changes most.
        let (mut weighted, mut weight) = (0.0, 0.0);
        for (row, (own_y, own_x, own_d)) in rows.zip(&of) {
            let (y, x, d) = (own_y - y, own_x - x, own_d - d);
            normal += Matrix2::new(x.dot(&x), x.dot(&d), x.dot(&d), d.dot(&d));
            right += Vector2::new(x.dot(&y), d.dot(&y));
            squares += y.dot(&y);
            weighted += d.dot(&d) * self.real.time[row];
            weight += d.dot(&d);
        }
        let inverse = normal.try_inverse()?;
        let solution = inverse * right;
        let variance = (squares - right.dot(&solution)).max(0.0) / (3.0 * n);
        let gain = solution.x;
        // What a window leaves is alike for some rows.
        let error = (TOGETHER * variance * inverse.m22).sqrt() / gain;
        (gain > REPEATED).then_some(Lag { time: weighted / weight, value: solution.y / gain, error })
    }
}

/// Lags at which a window is looked for, s.
fn searched() -> impl Iterator<Item = f64> {
    let steps = (REACH / SEARCH) as i32;
    (-steps..=steps).map(|k| f64::from(k) * SEARCH)
}

/// Of two vectors over time, all axes together; zero where one of them does not vary.
fn correlation(one: &[Vector3<f64>], other: &[Vector3<f64>]) -> f64 {
    let n = one.len() as f64;
    let mean = |of: &[Vector3<f64>]| of.iter().sum::<Vector3<f64>>() / n;
    let (y, x) = (mean(one), mean(other));
    let (mut yy, mut xx, mut xy) = (0.0, 0.0, 0.0);
    for (own_y, own_x) in one.iter().zip(other) {
        let (y, x) = (own_y - y, own_x - x);
        (yy, xx, xy) = (yy + y.dot(&y), xx + x.dot(&x), xy + x.dot(&y));
    }
    if yy * xx > 0.0 { xy / (yy * xx).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::*;

    const STEP: f64 = 0.01;

    fn turning(time: f64) -> Vector3<f64> {
        Vector3::new((1.3 * time).sin(), 0.6 * (2.9 * time + 1.0).cos(), 0.8 * (4.1 * time).sin())
    }

    /// Of a unit that lies still in its second minute, in another frame than the stream's, which is `late`.
    fn rates(late: f64) -> Rates {
        let mount = Rotation3::from_euler_angles(0.4, 0.1, -0.7);
        let moving = |time: f64| (((time - 90.0).abs() - 30.0) / 5.0).clamp(0.0, 1.0);
        let times = || (0..18_000).map(|k| STEP * f64::from(k));
        let rate = |time: f64| turning(time) * moving(time);
        Rates {
            real: Binned::new(times().map(|time| (time, mount * rate(time))), STEP),
            ideal: Binned::new(times().map(|time| (time, rate(time - late))), STEP),
        }
    }

    #[test]
    fn windows_in_motion_show_the_lag_in_whatever_frame_and_rests_show_none() {
        let clock = StreamClock::even(0.0, 0.0);
        // By the second clock the frame is known from the rates' sizes alone.
        for late in [0.0137, -0.35] {
            let rates = rates(late).aligned(&clock).unwrap();
            let lags = rates.lags(&clock);
            assert!(lags.len() >= 40 && lags.len() <= rates.brisk_windows(), "{}", lags.len());
            for lag in lags {
                assert!((lag.value - late).abs() < 2e-3, "{late}: {lag:?}");
                assert!(lag.time < 61.0 || lag.time > 119.0, "{lag:?}");
            }
        }
    }

    #[test]
    fn rates_of_a_unit_that_never_moves_have_no_frame_and_no_lags() {
        let clock = StreamClock::even(0.0, 0.0);
        let still = || Binned::new((0..6000).map(|k| (STEP * f64::from(k), Vector3::zeros())), STEP);
        let rates = Rates { real: still(), ideal: still() };
        assert!(rates.aligned(&clock).is_none() && rates.lags(&clock).is_empty());
        assert_eq!(rates.brisk_windows(), 0);
    }
}

//! Whether another sensor shows the unevenness of a clock that the rates show, or a fault of the gyroscope looks like one.
//!
//! ```text
//! lag(t) = a + b t + β u(t)
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | lag | of windows of another sensor (`rate_lags`), s |
//! | a, b | a line: how that sensor stands to an even clock |
//! | u | what the clock is off by according to the rates, s |
//! | β | one where the clock runs unevenly, zero where the gyroscope alone says so |
//!
//! A gyroscope that is filtered or whose output depends on the acceleration lags by what it measures, window by window; a clock is that
//! of all sensors. Not modelled: clocks of single sensors.

use nalgebra::{Matrix3, Vector3};

use super::{
    clock_steadiness::Steadiness,
    lag_steps::{FAR, FEWEST, StepFit},
    rate_lags::{Lag, Rates},
};
use crate::simulator::StreamClock;

/// A clock contradicts where β is less than one half by so many standard errors, and confirms where it is more.
const SURE: f64 = 3.0;
/// Windows of a sensor overlap by half, so that so many of them count as one.
const OVERLAP: f64 = 2.0;
/// Lags that scatter by less than this about a line, s, are those of an even clock where the rates cannot be followed at all,
const STEADY: f64 = 1e-3;
/// if so many of the windows in which the unit turns briskly have one that is no further off than [`FAR`] times as much.
const FOUND: f64 = 0.8;

/// What was judged by the rates, unless another sensor's lags contradict it: then an even clock by that sensor.
///
/// # Errors
///
/// That of the rates, where no other sensor shows that the clock is even.
pub(super) fn confirmed(
    by_rates: Result<Steadiness, String>,
    rates: &Rates,
    others: impl Iterator<Item = Rates>,
    coarse: &StreamClock,
) -> Result<Steadiness, String> {
    if by_rates.as_ref().is_ok_and(Steadiness::is_even) {
        return by_rates;
    }
    let lags: Vec<Vec<Lag>> = others.filter_map(|other| lags(&other, coarse)).collect();
    let even = match &by_rates {
        Ok(uneven) => {
            let shares: Vec<Option<Share>> =
                lags.iter().map(|lags| Share::of(lags, coarse, uneven)).collect();
            let is_seen = shares.iter().flatten().any(|share| share.is_seen());
            lags.iter()
                .zip(&shares)
                .find(|(_, share)| !is_seen && share.is_some_and(|share| share.is_absent()))
                .map(|(lags, _)| lags)
        }
        Err(_) => {
            let least = FOUND * rates.brisk_windows() as f64;
            lags.iter().find(|lags| is_steady(lags, least))
        }
    };
    match even.and_then(|lags| StepFit::of(lags, &[])) {
        Some(line) => Ok(Steadiness::even(line.clock(coarse))),
        None => by_rates,
    }
}

/// By how much later than a clock says a sensor's stream is. They are found again by the clock that they lead to: by one that is far off
/// neither the frame nor what comes next to a movement is right.
fn lags(of: &Rates, coarse: &StreamClock) -> Option<Vec<Lag>> {
    let line = StepFit::of(&of.aligned(coarse)?.lags(coarse), &[])?;
    let clock = line.clock(coarse);
    let against_coarse = |lag: Lag| {
        let value = lag.value + clock.stream_time(lag.time) - coarse.stream_time(lag.time);
        Lag { value, ..lag }
    };
    Some(of.aligned(&clock)?.lags(&clock).into_iter().map(against_coarse).collect())
}

/// Lags that lie on a line, so many of them at least: a clock that loses rows late has most of them on one as well.
fn is_steady(lags: &[Lag], least: f64) -> bool {
    let Some(line) = StepFit::of(lags, &[]).filter(|_| lags.len() >= 2 * FEWEST) else { return false };
    let off = |lag: &Lag| lag.value - line.coefficients[0] - line.coefficients[1] * lag.time;
    let near = lags.iter().filter(|lag| off(lag).abs() < FAR * STEADY).count();
    line.left < STEADY && near as f64 >= least
}

/// How much of an unevenness a sensor's lags show.
#[derive(Clone, Copy, Debug)]
struct Share {
    /// β.
    value: f64,
    /// Standard error.
    error: f64,
}

impl Share {
    /// By least squares; `None` where the lags are too few.
    fn of(lags: &[Lag], coarse: &StreamClock, uneven: &Steadiness) -> Option<Self> {
        let row = |lag: &Lag| {
            let off = uneven.clock.stream_time(lag.time) - coarse.stream_time(lag.time);
            Vector3::new(1.0, lag.time, off) / lag.deviation()
        };
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for lag in lags {
            normal += row(lag) * row(lag).transpose();
            right += row(lag) * (lag.value / lag.deviation());
        }
        let inverse = normal.try_inverse()?;
        let solution = inverse * right;
        let squares: f64 =
            lags.iter().map(|lag| (lag.value / lag.deviation() - row(lag).dot(&solution)).powi(2)).sum();
        let freedom = lags.len().checked_sub(3).filter(|_| lags.len() >= 2 * FEWEST)? as f64;
        let error = (OVERLAP * squares / freedom * inverse.m33).sqrt();
        Some(Self { value: solution.z, error })
    }

    fn is_seen(self) -> bool {
        self.value - SURE * self.error > 0.5
    }

    fn is_absent(self) -> bool {
        self.value + SURE * self.error < 0.5
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::reference::binned::Binned;

    const STEP: f64 = 0.01;

    fn moving(time: f64) -> Vector3<f64> {
        Vector3::new((1.3 * time).sin(), 0.6 * (2.9 * time + 1.0).cos(), 0.8 * (4.1 * time).sin())
    }

    fn wander(time: f64) -> f64 {
        4e-3 * (0.1 * time).sin()
    }

    /// A sensor whose stream is late by a function of time, and that has this noise.
    fn sensor(late: impl Fn(f64) -> f64, noise: f64) -> Rates {
        let times = || (0..12_000).map(|k| STEP * f64::from(k));
        let rough = |time: f64| {
            Vector3::new((977.0 * time).sin(), (1213.0 * time).sin(), (1511.0 * time).cos()) * noise
        };
        Rates {
            real: Binned::new(times().map(|time| (time, moving(time + late(time)) + rough(time))), STEP),
            ideal: Binned::new(times().map(|time| (time, moving(time))), STEP),
        }
    }

    fn uneven() -> Steadiness {
        let corrections = (0..120).map(|k| (f64::from(k), wander(f64::from(k)))).collect();
        let clock = StreamClock { corrections, ..StreamClock::even(0.0, 0.0) };
        Steadiness { wander: Some(3e-3), ..Steadiness::even(clock) }
    }

    fn confirmed_by(by_rates: Result<Steadiness, String>, other: Rates) -> Result<Steadiness, String> {
        let rates = sensor(wander, 0.0);
        confirmed(by_rates, &rates, std::iter::once(other), &StreamClock::even(0.0, 0.0))
    }

    #[test]
    fn a_wander_that_another_sensor_shows_is_the_clock_s() {
        assert_eq!(confirmed_by(Ok(uneven()), sensor(wander, 0.0)), Ok(uneven()));
    }

    #[test]
    fn a_wander_that_another_sensor_does_not_show_is_not_the_clock_s() {
        let found = confirmed_by(Ok(uneven()), sensor(|_| 0.012, 0.0)).unwrap();
        assert!(found.is_even() && (found.clock.offset - 0.012).abs() < 1e-4, "{found:?}");
    }

    #[test]
    fn a_sensor_that_hardly_shows_lags_says_nothing_of_a_wander() {
        assert_eq!(confirmed_by(Ok(uneven()), sensor(|_| 0.0, 0.25)), Ok(uneven()));
        assert_eq!(confirmed_by(Ok(uneven()), sensor(|_| 0.0, 3.0)), Ok(uneven()));
    }

    #[test]
    fn rows_are_not_lost_where_another_sensor_s_lags_lie_on_a_line() {
        let lost = || Err("rows seem to be lost".to_owned());
        let found = confirmed_by(lost(), sensor(|time| 0.09 + 2e-5 * time, 0.0)).unwrap();
        assert!(found.is_even() && (found.clock.offset - 0.09).abs() < 1e-4, "{found:?}");
        assert_eq!(confirmed_by(lost(), sensor(wander, 0.0)), lost());
        // Rows that are lost in the last quarter leave most lags on a line.
        let late = |time: f64| 0.08 * (time - 85.0).max(0.0);
        assert_eq!(confirmed_by(lost(), sensor(late, 0.0)), lost());
    }
}

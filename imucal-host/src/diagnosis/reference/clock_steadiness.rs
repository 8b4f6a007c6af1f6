//! Whether a recording's clock runs evenly against that of a simulator's stream, and where it does not: rows are lost and the
//! rest is numbered as if none were, a clock is set, or it is slewed while it runs.
//!
//! ```text
//! lag(t) = a + b t + Σ J_k [t ≥ t_k]
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | lag | what the coarse clock is off by, s, by windows of the rate (`rate_lags`) |
//! | a, b | its offset and rate |
//! | J_k, t_k | a jump, and when it comes |
//!
//! Lags that no line with a few jumps describes are followed as they are. Not modelled: a clock that changes within a window by
//! more than some milliseconds; such a recording is refused.

use std::ops::Range;

use super::{
    lag_steps::{FAR, FEWEST, SCATTER, StepFit, Stepped},
    rate_lags::{Lag, Rates, WINDOW},
};
use crate::{recording::median, simulator::StreamClock};

/// Passes of finding lags at most.
const PASSES: usize = 4;
/// Before the last pass, jumps that leave so many times less scatter than a line are taken for all there is: by a clock that is far
/// off, lags scatter.
const STEPPED: f64 = 10.0;
/// Windows that overlap know a jump by so many times less than windows that do not.
const OVERLAP: f64 = std::f64::consts::SQRT_2;
/// A jump is known no better than this, s: the rates are taken for straight lines between samples, and how brisk a movement is changes
/// for longer than a window.
const BEST: f64 = 3e-5;
/// A clock whose lags scatter about line and jumps by so many times what they should wanders,
const WANDERS: f64 = 2.0;
/// and, where a lag is further from the line through its neighbours than this, s, too fast to be followed.
const LOST: f64 = 2e-3;
/// A jump may be wherever the sum of squares is larger by so many variances at most than where it is least.
const PLACED: f64 = 12.0;
/// A wander is followed where so many of the windows in which the unit turns briskly have a lag.
const FOUND: f64 = 0.6;
/// Why a recording is refused whose times are of no use.
const LOST_ROWS: &str = "the times of the recording's rows wander against the simulator's too fast to be followed: rows seem to be lost and \
                         the rest numbered as if none were; record each sample's own time";
/// Rows so close to where a jump may be are not used, s.
const MARGIN: f64 = 0.1;

/// A jump of the clock.
#[derive(Clone, Debug, PartialEq)]
pub struct Jump {
    /// Where it may be, s.
    pub within: Range<f64>,
    /// The stream's time is later by this afterwards, s.
    pub by: f64,
    /// Standard error, s.
    pub error: f64,
}

/// A clock, and how unevenly it runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Steadiness {
    /// The clock.
    pub clock: StreamClock,
    /// Its jumps, in their order.
    pub jumps: Vec<Jump>,
    /// Root mean square of its wander, s; `None` where it runs evenly but for jumps.
    pub wander: Option<f64>,
    /// Upper bound of the probability that a clock which runs evenly looks as uneven.
    pub p_value: f64,
}

impl Steadiness {
    /// Of a clock that runs evenly.
    pub fn even(clock: StreamClock) -> Self {
        Self { clock, jumps: Vec::new(), wander: None, p_value: 1.0 }
    }

    /// Without jumps or wander.
    pub fn is_even(&self) -> bool {
        self.jumps.is_empty() && self.wander.is_none()
    }

    /// As many jumps at the same times, each by the same but for its error; a wander is like any other.
    fn is_alike(&self, other: &Self) -> bool {
        let mut jumps = self.jumps.iter().zip(&other.jumps);
        self.jumps.len() == other.jumps.len()
            && self.wander.is_some() == other.wander.is_some()
            && jumps.all(|(a, b)| a.within == b.within && (a.by - b.by).abs() <= a.error)
    }
}

/// How evenly a coarse clock runs. Lags are found again by the clock that a first round leads to, which does not change within a window
/// by as much. Without windows that show it, evenly.
///
/// # Errors
///
/// Why the recording's times are of no use, for a reader.
pub(super) fn steadiness(rates: &Rates, coarse: &StreamClock) -> Result<Steadiness, String> {
    let mut steadiness = Steadiness::even(coarse.clone());
    for pass in 1..=PASSES {
        let Some(rates) = rates.aligned(&steadiness.clock) else { break };
        let against_coarse = |lag: Lag| {
            let value = lag.value + steadiness.clock.stream_time(lag.time) - coarse.stream_time(lag.time);
            Lag { value, ..lag }
        };
        let lags: Vec<Lag> = rates.lags(&steadiness.clock).into_iter().map(against_coarse).collect();
        let judged = judged(&rates, coarse, &lags, pass == PASSES)?;
        if judged.wander.is_some() && (lags.len() as f64) < FOUND * rates.brisk_windows() as f64 {
            return Err(LOST_ROWS.to_owned());
        }
        let before = std::mem::replace(&mut steadiness, judged);
        let is_as_before = pass > 1 && before.is_alike(&steadiness);
        if is_as_before || steadiness.is_even() {
            break;
        }
    }
    Ok(steadiness)
}

/// The coarse clock with jumps.
fn jumping(coarse: &StreamClock, fit: &StepFit, jumps: &[Jump]) -> StreamClock {
    let StreamClock { offset, error, .. } = fit.clock(coarse);
    let slope = 1.0 / (1.0 + error);
    let mut corrections = Vec::new();
    let mut sum = 0.0;
    for jump in jumps {
        let middle = 0.5 * (jump.within.start + jump.within.end);
        corrections.push((middle, sum));
        sum += jump.by / slope;
        corrections.push((middle, sum));
    }
    let unknown = jumps.iter().map(|jump| jump.within.start - MARGIN..jump.within.end + MARGIN).collect();
    StreamClock { offset, error, corrections, unknown }
}

/// A clock that follows the lags, between them on a line, but for those that are far from their neighbours.
fn wandering(coarse: &StreamClock, lags: &[Lag], p_value: f64) -> Result<Steadiness, String> {
    let Some(line) = StepFit::of(lags, &[]) else { return Err(LOST_ROWS.to_owned()) };
    let bends: Vec<f64> = (0..lags.len()).map(|at| bend(lags, at)).collect();
    let usual = median(bends.clone()).unwrap_or(0.0);
    if usual > LOST {
        return Err(LOST_ROWS.to_owned());
    }
    let even = line.clock(coarse);
    let near =
        lags.iter().zip(&bends).filter(|(_, bend)| **bend <= FAR * (usual + SCATTER)).map(|(lag, _)| lag);
    let off = |lag: &Lag| {
        let value = lag.value + coarse.stream_time(lag.time) - even.stream_time(lag.time);
        (lag.time, value * (1.0 + even.error))
    };
    let mut corrections: Vec<(f64, f64)> = near.map(off).collect();
    let squares: f64 = corrections.iter().map(|(_, off)| off * off).sum();
    let wander = Some((squares / corrections.len() as f64).sqrt());
    let (last, first) = (beyond(corrections.iter().rev()), beyond(corrections.iter()));
    corrections.extend(last);
    corrections.splice(0..0, first);
    let clock = StreamClock { corrections, ..even };
    Ok(Steadiness { clock, jumps: Vec::new(), wander, p_value })
}

/// The correction a window further on than the first of some, on a line; `None` where they do not span one.
fn beyond<'c>(mut corrections: impl Iterator<Item = &'c (f64, f64)>) -> Option<(f64, f64)> {
    let (end, value) = corrections.next()?;
    let (inside, other) = corrections.find(|(time, _)| (time - end).abs() >= 0.5 * WINDOW)?;
    let further = WINDOW * (end - inside).signum();
    Some((end + further, value + (value - other) / (end - inside) * further))
}

/// How far a lag is from the line through its neighbours, s; zero at the ends.
fn bend(lags: &[Lag], at: usize) -> f64 {
    let before = at.checked_sub(1).and_then(|before| lags.get(before));
    let (Some(before), Some(own), Some(after)) = (before, lags.get(at), lags.get(at + 1)) else { return 0.0 };
    let span = after.time - before.time;
    let share = if span > 0.0 { (own.time - before.time) / span } else { 0.5 };
    (own.value - before.value - (after.value - before.value) * share).abs()
}

/// How evenly the coarse clock runs, by lags; in the last pass, or in one after which there are others.
fn judged(rates: &Rates, coarse: &StreamClock, lags: &[Lag], is_last: bool) -> Result<Steadiness, String> {
    let even = || Ok(Steadiness::even(coarse.clone()));
    let Some(Stepped { fit, places, least_gain }) = Stepped::of(lags).filter(|_| lags.len() >= 2 * FEWEST)
    else {
        return even();
    };
    let expected = median(lags.iter().map(Lag::deviation).collect()).unwrap_or(SCATTER);
    let ratio = (fit.left / expected).powi(2);
    let line = StepFit::of(lags, &[]).map_or(f64::INFINITY, |line| line.left);
    let is_stepped = !is_last && !places.is_empty() && STEPPED * fit.left < line;
    if ratio > WANDERS * WANDERS && !is_stepped {
        // Chernoff's bound of a χ² that large.
        let p_value = libm::exp(-0.5 * lags.len() as f64 * (ratio - 1.0 - ratio.ln()));
        return wandering(coarse, lags, p_value);
    }
    if places.is_empty() {
        return even();
    }
    let jump = |(at, place): (usize, &usize)| {
        // Where the lags scatter by less than a filter might make them, a jump is known by as much better.
        let (by, error) = (fit.coefficients[2 + at], OVERLAP * ratio.sqrt() * fit.errors[2 + at]);
        let error = error.hypot(BEST);
        let between = lags[place - 1].time..lags[*place].time;
        let before = fit.coefficients[0] + fit.coefficients[1] * between.start;
        let before = before + fit.coefficients[2..2 + at].iter().sum::<f64>();
        let within = placed(rates, coarse, &between, before, by).unwrap_or(between);
        Jump { within, by, error }
    };
    let jumps: Vec<Jump> = places.iter().enumerate().map(jump).collect();
    let p_value = lags.len() as f64 * libm::exp(-0.5 * least_gain);
    Ok(Steadiness { clock: jumping(coarse, &fit, &jumps), jumps, wander: None, p_value })
}

/// Where the clock jumps about the time between the middles of two windows, from a lag `before` to one that is `by` later:
/// where the sum of squares of the rates' differences is least, and next to it.
fn placed(
    rates: &Rates,
    clock: &StreamClock,
    between: &Range<f64>,
    before: f64,
    by: f64,
) -> Option<Range<f64>> {
    let rows = rates.real.within(&(between.start - WINDOW..between.end + WINDOW));
    let off = |row: usize, lag: f64| {
        let ideal = rates.ideal.at(clock.stream_time(rates.real.time[row]) + lag)?;
        Some((rates.real.values[row] - ideal).norm_squared())
    };
    // The sum of squares if the jump comes before each row, less that if it comes at the end.
    let mut costs = vec![0.0];
    for row in rows.clone() {
        costs.push(costs.last()? + off(row, before)? - off(row, before + by)?);
    }
    let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
    let best = costs.iter().position(|cost| *cost == least)?;
    let squares: Option<Vec<f64>> = rows
        .clone()
        .map(|row| off(row, if row < rows.start + best { before } else { before + by }))
        .collect();
    let variance = median(squares?)?;
    let may_be = |cost: &f64| *cost <= least + PLACED * variance;
    let (from, to) = (costs.iter().position(may_be)?, costs.iter().rposition(may_be)?);
    let time = |at: usize| rates.real.time.get(rows.start + at).copied();
    Some(time(from)?..time(to).unwrap_or(between.end + WINDOW))
}

#[cfg(test)]
mod tests;

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

use nalgebra::{DMatrix, DVector};

use super::rate_lags::{Lag, Rates, WINDOW};
use crate::{recording::median, simulator::StreamClock};

/// Passes of finding lags.
const PASSES: usize = 2;
/// Rounds of least squares, each with the weights that the last one left.
const ROUNDS: usize = 6;
/// Lags of a steady clock scatter by this at least, s: a filter's delay depends on how brisk a movement is.
const SCATTER: f64 = 4e-4;
/// What is further off counts as another movement, in standard deviations.
const FAR: f64 = 4.0;
/// A piece of the clock between jumps has so many windows at least.
const FEWEST: usize = 4;
/// A jump takes so much of the sum of squares away,
const SURE: f64 = 60.0;
/// and is at least this long, s.
const LEAST: f64 = 2e-3;
/// Most jumps.
const MOST: usize = 8;
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
}

impl Lag {
    fn deviation(&self) -> f64 {
        self.error.hypot(SCATTER)
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
    for _ in 0..PASSES {
        let Some(rates) = rates.aligned(&steadiness.clock) else { break };
        let against_coarse = |lag: Lag| {
            let value = lag.value + steadiness.clock.stream_time(lag.time) - coarse.stream_time(lag.time);
            Lag { value, ..lag }
        };
        let lags: Vec<Lag> = rates.lags(&steadiness.clock).into_iter().map(against_coarse).collect();
        steadiness = judged(&rates, coarse, &lags)?;
        if steadiness.wander.is_some() && (lags.len() as f64) < FOUND * rates.brisk_windows() as f64 {
            return Err(LOST_ROWS.to_owned());
        }
        if steadiness.jumps.is_empty() && steadiness.wander.is_none() {
            break;
        }
    }
    Ok(steadiness)
}

/// The coarse clock with jumps.
fn jumping(coarse: &StreamClock, fit: &StepFit, jumps: &[Jump]) -> StreamClock {
    let slope = 1.0 / (1.0 + coarse.error) + fit.coefficients[1];
    let at_zero = coarse.offset / (1.0 + coarse.error) + fit.coefficients[0];
    let mut corrections = Vec::new();
    let mut sum = 0.0;
    for jump in jumps {
        let middle = 0.5 * (jump.within.start + jump.within.end);
        corrections.push((middle, sum));
        sum += jump.by / slope;
        corrections.push((middle, sum));
    }
    let unknown = jumps.iter().map(|jump| jump.within.start - MARGIN..jump.within.end + MARGIN).collect();
    StreamClock { offset: at_zero / slope, error: 1.0 / slope - 1.0, corrections, unknown }
}

/// A clock that follows the lags, between them on a line, but for those that are far from their neighbours.
fn wandering(coarse: &StreamClock, lags: &[Lag], p_value: f64) -> Result<Steadiness, String> {
    let Some(line) = StepFit::of(lags, &[]) else { return Err(LOST_ROWS.to_owned()) };
    let bends: Vec<f64> = (0..lags.len()).map(|at| bend(lags, at)).collect();
    let usual = median(bends.clone()).unwrap_or(0.0);
    if usual > LOST {
        return Err(LOST_ROWS.to_owned());
    }
    let even = jumping(coarse, &line, &[]);
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

/// How evenly the coarse clock runs, by lags.
fn judged(rates: &Rates, coarse: &StreamClock, lags: &[Lag]) -> Result<Steadiness, String> {
    let even = || Ok(Steadiness::even(coarse.clone()));
    let Some(Stepped { fit, places, least_gain }) = stepped(lags).filter(|_| lags.len() >= 2 * FEWEST) else {
        return even();
    };
    let expected = median(lags.iter().map(Lag::deviation).collect()).unwrap_or(SCATTER);
    let ratio = (fit.left / expected).powi(2);
    if ratio > WANDERS * WANDERS {
        // Chernoff's bound of a χ² that large.
        let p_value = libm::exp(-0.5 * lags.len() as f64 * (ratio - 1.0 - ratio.ln()));
        return wandering(coarse, lags, p_value);
    }
    if places.is_empty() {
        return even();
    }
    let jump = |(at, place): (usize, &usize)| {
        let (by, error) = (fit.coefficients[2 + at], fit.errors[2 + at]);
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

/// A line with steps through lags.
struct StepFit {
    /// Value at zero, slope, and the steps.
    coefficients: Vec<f64>,
    errors: Vec<f64>,
    /// Sum of whitened squares, each at most that of [`FAR`].
    cost: f64,
    /// Scatter about it, by the median, s.
    left: f64,
}

/// A line with as many steps as lags show.
struct Stepped {
    fit: StepFit,
    /// The lags before which a step is.
    places: Vec<usize>,
    /// The least that a step took away of the cost.
    least_gain: f64,
}

fn stepped(lags: &[Lag]) -> Option<Stepped> {
    let mut places: Vec<usize> = Vec::new();
    let mut best = StepFit::of(lags, &places)?;
    let mut least_gain = f64::INFINITY;
    while places.len() < MOST {
        let with = |place: usize| {
            let mut places = places.clone();
            places.push(place);
            places.sort_unstable();
            let bounds = [&[0][..], &places, &[lags.len()]].concat();
            let long = bounds.windows(2).all(|piece| piece[1] >= piece[0] + FEWEST);
            long.then(|| StepFit::of(lags, &places)).flatten().map(|fit| (fit, places))
        };
        let tried = (1..lags.len()).filter_map(with);
        let Some((fit, at)) = tried.min_by(|a, b| a.0.cost.total_cmp(&b.0.cost)) else { break };
        let gain = best.cost - fit.cost;
        if gain < SURE || fit.coefficients[2..].iter().any(|jump| jump.abs() < LEAST) {
            break;
        }
        (best, places) = (fit, at);
        least_gain = gain.min(least_gain);
    }
    Some(Stepped { fit: best, places, least_gain })
}

impl StepFit {
    /// With steps before the lags of these places, by least squares of which far lags have little part.
    fn of(lags: &[Lag], places: &[usize]) -> Option<Self> {
        let columns = 2 + places.len();
        let design = DMatrix::from_fn(lags.len(), columns, |row, column| match column {
            0 => 1.0,
            1 => lags[row].time,
            step => f64::from(u8::from(row >= places[step - 2])),
        });
        let values = DVector::from_iterator(lags.len(), lags.iter().map(|lag| lag.value));
        let mut off: DVector<f64> = DVector::zeros(lags.len());
        let mut found = None;
        for _ in 0..ROUNDS {
            // Cauchy's weights: those of all are equal at first.
            let ratio = |row: usize| off[row] / lags[row].deviation();
            let weight = |row: usize| lags[row].deviation().powi(-2) / (1.0 + ratio(row).powi(2) / FAR);
            let weighted =
                DMatrix::from_fn(lags.len(), columns, |row, column| design[(row, column)] * weight(row));
            let inverse = (design.transpose() * &weighted).try_inverse()?;
            let solution = &inverse * (weighted.transpose() * &values);
            off = &values - &design * &solution;
            found = Some((solution, inverse));
        }
        let (solution, inverse) = found?;
        let whitened = |row: usize| off[row] / lags[row].deviation();
        Some(Self {
            coefficients: solution.iter().copied().collect(),
            errors: (0..columns).map(|at| inverse[(at, at)].max(0.0).sqrt()).collect(),
            cost: (0..lags.len()).map(|row| whitened(row).powi(2).min(FAR * FAR)).sum(),
            left: 1.48 * median(off.iter().map(|off| off.abs()).collect())?,
        })
    }
}

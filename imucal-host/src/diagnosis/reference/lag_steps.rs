//! A line with steps through lags: how a clock runs that jumps.
//!
//! ```text
//! lag(t) = a + b t + Σ J_k [t ≥ t_k]      Σ ρ((lag_i − lag(t_i)) / σ_i) least,  ρ(z) ≈ min(z², c²)
//! ```
//!
//! Steps are where the lags next to one another differ, or where a further one takes most of the sum away; each is then moved to where
//! it is best next to the others. Weights are Cauchy's. Not modelled: lags that depend on one another.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::rate_lags::Lag;
use crate::{recording::median, simulator::StreamClock};

/// Lags of a steady clock scatter by this at least, s: a filter's delay depends on how brisk a movement is.
pub(super) const SCATTER: f64 = 4e-4;
/// What is further off counts as another movement, in standard deviations.
pub(super) const FAR: f64 = 4.0;
/// A piece of the clock between jumps has so many windows at least.
pub(super) const FEWEST: usize = 4;
/// A jump takes so much of the sum of squares away,
const SURE: f64 = 60.0;
/// and is at least this long, s.
const LEAST: f64 = 2e-3;
/// Most jumps.
const MOST: usize = 8;
/// Places of a jump that are tried first.
const SCANNED: usize = 256;
/// Rounds of least squares, each with the weights that the last one left.
const ROUNDS: usize = 6;

impl Lag {
    /// Standard deviation about that of a clock with jumps, s.
    pub fn deviation(&self) -> f64 {
        self.error.hypot(SCATTER)
    }
}

/// A line with steps through lags.
pub(super) struct StepFit {
    /// Value at zero, slope, and the steps.
    pub coefficients: Vec<f64>,
    pub errors: Vec<f64>,
    /// Sum of whitened squares, each at most that of [`FAR`].
    cost: f64,
    /// Scatter about it, by the median, s.
    pub left: f64,
}

/// A line with as many steps as lags show.
pub(super) struct Stepped {
    pub fit: StepFit,
    /// The lags before which a step is.
    pub places: Vec<usize>,
    /// The least that a step took away of the cost.
    pub least_gain: f64,
}

impl Stepped {
    /// Of as many steps as lags show: those that are apparent, and further ones where each is best; all where they are best together.
    pub fn of(lags: &[Lag]) -> Option<Self> {
        let mut found = Self::of_apparent(lags)?;
        while found.places.len() < MOST {
            let Some((fit, places)) = with_step(lags, &found.places) else { break };
            let (fit, places) = settled(lags, fit, places);
            let gain = found.fit.cost - fit.cost;
            if gain < SURE || fit.has_small_step() {
                break;
            }
            found = Self { fit, places, least_gain: gain.min(found.least_gain) };
        }
        Some(found)
    }

    /// Of the steps that lags next to one another show, without those that are not needed. Where several are, none alone need make
    /// the lags agree.
    fn of_apparent(lags: &[Lag]) -> Option<Self> {
        let mut places = apparent(lags);
        loop {
            let (fit, settled) = settled(lags, StepFit::of(lags, &places)?, places);
            places = settled;
            let gain = |at: usize| Some(StepFit::of(lags, &without(&places, at))?.cost - fit.cost);
            let gains: Option<Vec<f64>> = (0..places.len()).map(gain).collect();
            let least = gains?.into_iter().enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
            match least {
                Some((at, gain)) if gain < SURE || fit.has_small_step() => places = without(&places, at),
                least => {
                    let least_gain = least.map_or(f64::INFINITY, |(_, gain)| gain);
                    return Some(Self { fit, places, least_gain });
                }
            }
        }
    }
}

/// The lags before which those next to one another differ most, [`MOST`] at most, in their order.
fn apparent(lags: &[Lag]) -> Vec<usize> {
    let level = |of: &[Lag]| median(of.iter().map(|lag| lag.value).collect());
    let differing = |at: usize| {
        let (before, after) = (lags.get(at - FEWEST..at)?, lags.get(at..at + FEWEST)?);
        let by = (level(after)? - level(before)?).abs();
        let spread = median(before.iter().chain(after).map(Lag::deviation).collect())?;
        (by > LEAST.max(FAR * spread)).then_some((by, at))
    };
    let mut differing: Vec<(f64, usize)> = (FEWEST..lags.len()).filter_map(differing).collect();
    differing.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut places: Vec<usize> = Vec::new();
    for (_, at) in differing {
        if places.len() < MOST && places.iter().all(|place| place.abs_diff(at) >= FEWEST) {
            places.push(at);
        }
    }
    places.sort_unstable();
    places
}

fn without(places: &[usize], at: usize) -> Vec<usize> {
    let mut others = places.to_vec();
    others.remove(at);
    others
}

/// With one step more, where the cost is least: of [`SCANNED`] places, and of those next to the best of them.
fn with_step(lags: &[Lag], others: &[usize]) -> Option<(StepFit, Vec<usize>)> {
    let with = |place: usize| {
        let mut places = others.to_vec();
        places.push(place);
        places.sort_unstable();
        let bounds = [&[0][..], &places, &[lags.len()]].concat();
        let long = bounds.windows(2).all(|piece| piece[1] >= piece[0] + FEWEST);
        long.then(|| StepFit::of(lags, &places)).flatten().map(|fit| (place, fit, places))
    };
    let best = |places: Range<usize>, stride: usize| {
        places.step_by(stride).filter_map(with).min_by(|a, b| a.1.cost.total_cmp(&b.1.cost))
    };
    let stride = lags.len().div_ceil(SCANNED);
    let (place, fit, places) = best(1..lags.len(), stride)?;
    if stride == 1 {
        return Some((fit, places));
    }
    let (_, fit, places) = best((place + 1).saturating_sub(stride)..(place + stride).min(lags.len()), 1)?;
    Some((fit, places))
}

/// With each step where it is best next to the others: the first of several may lie between two places.
fn settled(lags: &[Lag], mut fit: StepFit, mut places: Vec<usize>) -> (StepFit, Vec<usize>) {
    for _ in 0..ROUNDS {
        let before = fit.cost;
        for at in 0..places.len() {
            if let Some(moved) =
                with_step(lags, &without(&places, at)).filter(|(moved, _)| moved.cost < fit.cost)
            {
                (fit, places) = moved;
            }
        }
        if fit.cost >= before {
            break;
        }
    }
    (fit, places)
}

impl StepFit {
    /// One of the steps is shorter than a jump.
    fn has_small_step(&self) -> bool {
        self.coefficients[2..].iter().any(|jump| jump.abs() < LEAST)
    }

    /// A clock that is off by these lags' line from another.
    pub fn clock(&self, from: &StreamClock) -> StreamClock {
        let slope = 1.0 / (1.0 + from.error) + self.coefficients[1];
        let at_zero = from.offset / (1.0 + from.error) + self.coefficients[0];
        StreamClock { offset: at_zero / slope, error: 1.0 / slope - 1.0, ..StreamClock::default() }
    }

    /// With steps before the lags of these places, by least squares of which far lags have little part.
    pub fn of(lags: &[Lag], places: &[usize]) -> Option<Self> {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Lags every two and a half seconds on a line with steps before those of these numbers, off by less than a tenth of [`SCATTER`].
    fn lags(count: usize, steps: &[(usize, f64)]) -> Vec<Lag> {
        let value = |at: usize| {
            let sum: f64 = steps.iter().filter(|(place, _)| at >= *place).map(|(_, by)| by).sum();
            2e-5 * at as f64 + sum + 0.1 * SCATTER * (2.0 * at as f64).sin()
        };
        (0..count).map(|at| Lag { time: 2.5 * at as f64, value: value(at), error: 1e-5 }).collect()
    }

    #[test]
    fn steps_are_found_however_many_lags_there_are() {
        let cases: [(usize, &[(usize, f64)]); 6] = [
            (40, &[]),
            (40, &[(9, 0.01)]),
            // A step between two others, which one alone would be placed at.
            (96, &[(35, 0.18), (61, -0.36)]),
            (96, &[(20, 0.05), (40, 0.05), (60, -0.1), (80, 0.004)]),
            (2000, &[(411, 0.006)]),
            (2000, &[(300, 0.02), (333, -0.02), (1500, 0.3)]),
        ];
        for (count, steps) in cases {
            let found = Stepped::of(&lags(count, steps)).unwrap();
            let places: Vec<usize> = steps.iter().map(|(place, _)| *place).collect();
            assert_eq!(found.places, places, "{count}");
            for (by, (_, expected)) in found.fit.coefficients[2..].iter().zip(steps) {
                assert!((by - expected).abs() < SCATTER, "{count}: {by} {expected}");
            }
            assert!(found.fit.left < 0.2 * SCATTER, "{count}");
        }
    }

    #[test]
    fn lags_of_another_movement_here_and_there_make_no_step() {
        let mut lags = lags(200, &[(120, 0.03)]);
        lags.iter_mut().step_by(11).for_each(|lag| lag.value -= 0.5);
        assert_eq!(Stepped::of(&lags).unwrap().places, [120]);
    }
}

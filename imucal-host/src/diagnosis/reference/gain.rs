//! Impacts in a row that one side has fainter or stronger than the other, where the faster side resolves them.
//!
//! ```text
//! g  = Σ e_slow · e_fast / Σ |e_fast|²          gain of an impact, at the samples of the slower side
//! σ² = v + τ² + k ρ                             its variance where both sides had the same impact
//! p₀ = t₂((g − g₀) / σ) / σ                     then
//! p₁ = half at nothing and half between nothing and g₀, or between g₀ and 3 g₀, each with the errors σ
//! s  = Σ over a stretch of ln (p₁ / p₀)         no impact counts more than a limit
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | v | what the slower side's noise makes of g |
//! | ρ | power of what the faster side's own neighbours do not foretell, as a share of that at the slower samples: how badly it resolves the impact |
//! | τ, k | the least scatter, given, and what ρ adds, the likeliest for the pair |
//! | g₀ | the usual gain: the median, where σ is small |
//! | t₂ | Student's density with two degrees of freedom, since a pulse between two samples is off by far more than σ now and then |
//!
//! An impact whose σ is large says nothing: a cubic makes short ones fainter, and pairs whose faster side does not resolve
//! impacts have none but such. Not recognised: gains that differ all along.

use std::{
    f64::consts::{PI, SQRT_2},
    ops::Range,
};

use super::scan::Events;
use crate::recording::median;

/// τ.
const SCATTER: f64 = 0.05;
/// k is looked for from the first to the second, in steps of this factor.
const ROUGH: (f64, f64, f64) = (3e-3, 3.0, 1.3);
/// An impact is looked at where σ is less.
const RESOLVED: f64 = 0.35;
/// Of fewer such impacts it is not known what is usual.
const FEWEST: usize = 20;
/// g₀ is within these where both sides have the same axes and units.
const USUAL: (f64, f64) = (0.7, 1.4);
/// The largest gain that p₁ allows for, in g₀.
const STRONGEST: f64 = 3.0;
/// Share of impacts within a stretch that are as usual.
const USUAL_WITHIN: f64 = 0.05;
/// No impact adds more to s.
const MOST: f64 = 5.0;

/// The gain of one impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gain {
    /// g.
    pub value: f64,
    /// v.
    pub variance: f64,
    /// ρ.
    pub roughness: f64,
}

impl Gain {
    /// σ.
    fn sigma(&self, rough: f64) -> f64 {
        (self.variance + SCATTER * SCATTER + rough * self.roughness).sqrt()
    }
}

/// Stretches of impacts whose gains are not the usual ones, with their s, from the gain of each, `None` where the faster side
/// shows none, and from whether no stretch reaches to it from the one before.
pub fn changed_stretches(gains: &[Option<Gain>], begins: &[bool]) -> Vec<(Range<usize>, f64)> {
    let shown: Vec<Gain> = gains.iter().flatten().copied().collect();
    if shown.len() < FEWEST {
        return Vec::new();
    }
    let rough = likeliest_rough(&shown);
    let is_resolved = |at: &usize| gains[*at].is_some_and(|gain| gain.sigma(rough) < RESOLVED);
    let known: Vec<usize> = (0..gains.len()).filter(is_resolved).collect();
    let resolved: Vec<Gain> = known.iter().filter_map(|at| gains[*at]).collect();
    let usual = median(resolved.iter().map(|gain| gain.value).collect()).unwrap_or(0.0);
    if resolved.len() < FEWEST || !(USUAL.0..USUAL.1).contains(&usual) {
        return Vec::new();
    }
    let events = Events { known: &known, begins };
    let found = |density: fn(f64, f64) -> f64| {
        let score = |gain: &Gain| log_odds(gain.value / usual, gain.sigma(rough) / usual, density);
        events.asserted(resolved.iter().map(score).collect())
    };
    let mut stretches = found(fainter);
    stretches.extend(found(stronger));
    stretches
}

/// k, for gains about one.
fn likeliest_rough(gains: &[Gain]) -> f64 {
    let log_likelihood = |rough: f64| -> f64 {
        gains.iter().map(|gain| student(gain.value - 1.0, gain.sigma(rough)).ln()).sum()
    };
    let tried = std::iter::successors(Some(ROUGH.0), |rough| Some(rough * ROUGH.2));
    let tried = tried.take_while(|rough| *rough < ROUGH.1).map(|rough| (rough, log_likelihood(rough)));
    tried.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(ROUGH.1, |(rough, _)| rough)
}

/// ln (p₁ / p₀) of a gain in g₀.
fn log_odds(gain: f64, sigma: f64, density: fn(f64, f64) -> f64) -> f64 {
    let usual = student(gain - 1.0, sigma);
    let changed = (1.0 - USUAL_WITHIN) * density(gain, sigma) + USUAL_WITHIN * usual;
    (changed / usual).ln().min(MOST)
}

/// Student's density with two degrees of freedom, of this scale.
fn student(x: f64, sigma: f64) -> f64 {
    let z = x / sigma;
    (1.0 + 0.5 * z * z).powf(-1.5) / (2.0 * SQRT_2 * sigma)
}

fn normal(x: f64, sigma: f64) -> f64 {
    (-0.5 * (x / sigma).powi(2)).exp() / (sigma * (2.0 * PI).sqrt())
}

/// An even density between two gains, with errors.
fn even(gain: f64, sigma: f64, (low, high): (f64, f64)) -> f64 {
    let above = |edge: f64| 0.5 * libm::erfc((edge - gain) / (sigma * SQRT_2));
    (above(low) - above(high)) / (high - low)
}

fn fainter(gain: f64, sigma: f64) -> f64 {
    0.5 * normal(gain, sigma.hypot(SCATTER)) + 0.5 * even(gain, sigma, (0.0, 1.0))
}

fn stronger(gain: f64, sigma: f64) -> f64 {
    even(gain, sigma, (1.0, STRONGEST))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::random::{Purpose, Random};

    /// Gains of impacts that both sides have, with a heavy tail, of this k.
    fn gains(count: usize, rough: f64, seed: u64) -> Vec<Option<Gain>> {
        let mut random = Random::new(seed, Purpose::Route);
        let gain = |_| {
            let roughness = 10f64.powf(random.between(-2.0, 1.0));
            let tail = if random.share() < 0.03 { 6.0 } else { 1.0 };
            let sigma = (SCATTER * SCATTER + rough * roughness).sqrt();
            Some(Gain { value: 1.0 + tail * sigma * random.normal(), variance: 1e-4, roughness })
        };
        (0..count).map(gain).collect()
    }

    fn found(gains: &[Option<Gain>]) -> Vec<(Range<usize>, f64)> {
        changed_stretches(gains, &vec![false; gains.len()])
    }

    #[test]
    fn impacts_in_a_row_that_are_missing_or_twice_as_strong_are_a_stretch() {
        for factor in [0.0, 2.0] {
            let mut gains = gains(200, 0.04, 7);
            for gain in gains[80..90].iter_mut().flatten() {
                gain.value *= factor;
            }
            let found = found(&gains);
            assert_eq!(found.len(), 1, "{factor}: {found:?}");
            assert!(found[0].0.start < 84 && found[0].0.start > 76 && found[0].0.len() < 14, "{found:?}");
        }
    }

    #[test]
    fn impacts_that_both_sides_have_are_no_stretch_however_badly_they_are_resolved() {
        for seed in 0..200 {
            for rough in [0.02, 0.1, 0.5, 2.0] {
                assert_eq!(found(&gains(300, rough, seed)), [], "seed {seed}, k {rough}");
            }
        }
    }

    #[test]
    fn nothing_is_said_of_axes_that_do_not_agree_or_of_few_impacts() {
        let mut turned = gains(200, 0.04, 3);
        turned.iter_mut().flatten().for_each(|gain| gain.value -= 1.0);
        assert_eq!(found(&turned), []);
        assert_eq!(found(&gains(19, 0.04, 3)), []);
        assert_eq!(found(&[]), []);
        assert_eq!(found(&[None; 50]), []);
    }
}

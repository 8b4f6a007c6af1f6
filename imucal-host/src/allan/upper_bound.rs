//! The most that a squared coefficient may be which a recording does not determine.
//!
//! ```text
//! P(θ̂ ≤ found | θ) = 2.5 %      θ̂ = e₀ z + θ χ²_ν / ν,   z ~ N(0, 1)
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | θ | the squared coefficient, of which θ̂ is what a fit finds |
//! | e₀ | standard error where there is nothing of it: what other noise makes |
//! | ν | degrees of freedom of its own variances, by e(θ)² = e₀² + 2 θ² / ν |
//!
//! A large coefficient scatters by its own size, so that a small one that was found may come of it more easily than its standard error
//! there says. The sum is taken for a gamma distribution of the same mean, variance and skewness. Not modelled: what of the other
//! coefficients would be smaller if this one were larger.

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Probability of less than what was found.
const LESS: f64 = 0.025;
/// The normal quantile of that.
const NORMAL: f64 = -1.96;
/// Rounds in which ν is taken where the bound is.
const ROUNDS: usize = 3;
/// Doublings and halvings of a search.
const DOUBLINGS: usize = 60;
const HALVINGS: usize = 40;
/// Degrees of freedom from which on a gamma distribution is a normal one.
const MANY: f64 = 1e6;

/// The bound for a size that was found; `error_at` gives the standard error of what would be found of another size.
pub fn upper_bound(found: f64, error_at: &dyn Fn(f64) -> Option<f64>) -> Option<f64> {
    let without = error_at(0.0)?;
    let mut bound = found - NORMAL * without;
    for _ in 0..ROUNDS {
        let own = error_at(bound)?.powi(2) - without * without;
        bound = of(found, without, (own / (bound * bound)).max(0.0))?;
    }
    Some(bound)
}

/// The bound where sizes scatter by `without` and by `own` = 2 / ν of their square.
fn of(found: f64, without: f64, own: f64) -> Option<f64> {
    let reaches = |size: f64| {
        let error = (without * without + own * size * size).sqrt();
        let skewness = 2.0 * own * own * (size / error).powi(3);
        size + error * quantile(skewness) >= found
    };
    let mut step = without.max(found);
    let doubled = (0..DOUBLINGS).any(|_| {
        step *= 2.0;
        reaches(found + step)
    });
    if !doubled {
        return None;
    }
    let (mut low, mut high) = (found, found + step);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if reaches(middle) { high = middle } else { low = middle }
    }
    Some(high)
}

/// Of a gamma distribution of mean zero, variance one and this skewness.
fn quantile(skewness: f64) -> f64 {
    let freedom = 8.0 / (skewness * skewness);
    if freedom > MANY {
        return NORMAL;
    }
    ChiSquared::new(freedom)
        .map_or(f64::NAN, |chi| (chi.inverse_cdf(LESS) - freedom) / (2.0 * freedom).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::allan::{
        coefficients::{Coefficient, Estimator, Sums},
        drawn::{Drawn, cascade},
    };

    #[test]
    fn without_scatter_of_its_own_the_bound_is_the_normal_one_and_without_other_noise_that_of_a_variance() {
        let bound = upper_bound(3.0, &|_| Some(0.5)).unwrap();
        assert!((bound - (3.0 + 1.96 * 0.5)).abs() < 1e-6, "{bound}");
        // χ² of 4 degrees of freedom is less than 0.4844 in 2.5 %.
        let bound = upper_bound(1.0, &|size| Some((1e-12 + 0.5 * size * size).sqrt())).unwrap();
        assert!((bound - 4.0 / 0.4844).abs() < 0.01, "{bound}");
    }

    #[test]
    fn random_walks_hardly_seen_are_below_their_bound_as_often_as_is_said() {
        const RUNS: u64 = 40;
        const SAMPLES: usize = 20_000;
        let points = |walk: f64, seed: u64| {
            cascade(SAMPLES, Drawn { white: 1.0, walk, ..Drawn::default() }, seed).points()
        };
        let sums = Sums::new(&points(0.0, 0), SAMPLES as u64);
        for walk in [5e-4, 2e-3, 4e-3] {
            let (mut below, mut hidden) = (0, 0);
            for seed in 0..RUNS {
                let estimator = Estimator::new(&points(walk, 100 + seed), &sums, SAMPLES as u64, 1.0);
                for axis in 0..3 {
                    let most = match estimator.axis(axis, 0.0, 1.0).random_walk {
                        Coefficient::Known(known) => known.interval.1,
                        Coefficient::NotSeen { most, .. } => {
                            hidden += 1;
                            most.unwrap_or(f64::INFINITY)
                        }
                    };
                    below += u32::from(most < walk);
                }
            }
            println!("K = {walk}: hidden in {hidden} of {} axes, below the truth in {below}", 3 * RUNS);
            // 2.5 % are 3 of 120; more than 10 are chance in one of 3000.
            assert!(below <= 10, "{walk}: {below}");
        }
    }
}

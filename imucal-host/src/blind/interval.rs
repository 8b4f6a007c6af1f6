//! Confidence of a share: the exact interval of Clopper and Pearson (1934).
//!
//! ```text
//! low: P(X ≥ k | p) = α / 2,    high: P(X ≤ k | p) = α / 2      quantiles of a beta distribution
//! ```

use statrs::distribution::{Beta, ContinuousCDF};

/// The 95 % interval of a share of which `hits` of `trials` were seen; 0 to 1 without trials.
pub fn clopper_pearson(hits: usize, trials: usize) -> [f64; 2] {
    const TAIL: f64 = 0.025;
    let (k, n) = (hits.min(trials) as f64, trials as f64);
    let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map(|beta| beta.inverse_cdf(p)).ok();
    let low = if hits == 0 { None } else { quantile(k, n - k + 1.0, TAIL) };
    let high = if hits >= trials { None } else { quantile(k + 1.0, n - k, 1.0 - TAIL) };
    [low.unwrap_or(0.0), high.unwrap_or(1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bounds_are_those_of_the_closed_forms_and_of_tables() {
        // None or all of n: 1 − (α/2)^(1/n).
        let [low, high] = clopper_pearson(0, 20);
        assert!(low == 0.0 && (high - (1.0 - 0.025f64.powf(0.05))).abs() < 1e-9, "{high}");
        let [low, high] = clopper_pearson(77, 77);
        assert!(high == 1.0 && (low - 0.025f64.powf(1.0 / 77.0)).abs() < 1e-9, "{low}");
        // R: binom.test(5, 100), binom.test(50, 1000), binom.test(4, 10).
        for (hits, trials, expected) in [
            (5, 100, [0.016_431_88, 0.112_834_9]),
            (50, 1000, [0.037_335_4, 0.065_390_5]),
            (4, 10, [0.121_552_3, 0.737_621_9]),
        ] {
            let found = clopper_pearson(hits, trials);
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-6, "{hits}/{trials}: {found} {expected}");
            }
        }
        assert_eq!(clopper_pearson(0, 0), [0.0, 1.0]);
    }

    #[test]
    fn each_tail_has_the_probability_it_is_said_to_have() {
        use statrs::distribution::{Binomial, DiscreteCDF};
        for (hits, trials) in [(1, 30), (17, 40), (260, 270)] {
            let [low, high] = clopper_pearson(hits, trials);
            let at = |p: f64, k: usize| Binomial::new(p, trials as u64).unwrap().cdf(k as u64);
            assert!((1.0 - at(low, hits - 1) - 0.025).abs() < 1e-6);
            assert!((at(high, hits) - 0.025).abs() < 1e-6);
        }
    }
}

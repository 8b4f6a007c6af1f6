//! How much larger standard errors are because neighbouring residuals are alike.
//!
//! With ψ_i = (JᵀJ)⁻¹ J_i r_i the influence of observation i, a parameter's variance is that of Σ ψ_i: the mean
//! square of sums over blocks that are long enough not to know of each other. Blocks are doubled until their sums
//! spread no wider than chance allows (Flyvbjerg & Petersen 1989). The ratio to Σ ψ_i² inflates the classical
//! variance, parameter by parameter, and never below one: that keeps the covariance's correlations and its rank.

use nalgebra::{SMatrix, SVector};

use super::rows::Rows;

/// Fewer blocks say nothing of their spread.
const LEAST_BLOCKS: usize = 20;

/// Factor on each parameter's standard error, at least 1. `unscaled` is (JᵀJ)⁻¹; rows are in time order, `each` of them
/// an observation: the axes of a vector are no neighbours in time.
pub fn inflation<const P: usize>(
    rows: &Rows<P>,
    unscaled: &SMatrix<f64, P, P>,
    each: usize,
) -> SVector<f64, P> {
    let influence: Vec<SVector<f64, P>> =
        rows.residuals.iter().zip(&rows.jacobian).map(|(r, j)| unscaled * j * *r).collect();
    blocked_ratio(influence.chunks_exact(each).map(|of_one| of_one.iter().sum()).collect())
        .map(|ratio| ratio.max(1.0).sqrt())
}

/// Variance of each series' sum over that of an independent series of the same spread. All share one length of
/// block, so that the settling of one is not left to the chance of its own few blocks.
fn blocked_ratio<const P: usize>(mut sums: Vec<SVector<f64, P>>) -> SVector<f64, P> {
    let single = squares(&sums);
    let mut ratio = SVector::<f64, P>::repeat(1.0);
    while sums.len() >= 2 * LEAST_BLOCKS {
        sums = sums.chunks_exact(2).map(|pair| pair[0] + pair[1]).collect();
        let blocks = sums.len() as f64;
        // The sums add up to nothing at the optimum, which takes one of their degrees of freedom.
        let freedom = blocks / (blocks - 1.0);
        // What is held is influenced by nothing.
        let wider = squares(&sums).zip_map(&single, |b, s| if s > 0.0 { b / s * freedom } else { 1.0 });
        if !wider.iter().all(|w| w.is_finite()) {
            break;
        }
        let settled = wider.mean() <= ratio.mean() * (1.0 + (2.0 / (blocks * P as f64)).sqrt());
        ratio = wider;
        if settled {
            break;
        }
    }
    ratio
}

fn squares<const P: usize>(values: &[SVector<f64, P>]) -> SVector<f64, P> {
    values.iter().map(|v| v.component_mul(v)).sum()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    fn autoregression(rho: f64, count: usize) -> Vec<SVector<f64, 1>> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut state = 0.0;
        (0..count)
            .map(|_| {
                let e: f64 = StandardNormal.sample(&mut rng);
                state = rho * state + e;
                SVector::from([state])
            })
            .collect()
    }

    #[test]
    fn white_residuals_are_hardly_inflated() {
        assert!((blocked_ratio(autoregression(0.0, 5000)).x - 1.0).abs() < 0.1);
    }

    #[test]
    fn an_autoregression_has_its_known_variance() {
        // (1 + ρ)/(1 − ρ) = 19 for ρ = 0.9.
        let ratio = blocked_ratio(autoregression(0.9, 20_000)).x;
        assert!((15.0..23.0).contains(&ratio), "{ratio}");
    }
}

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

/// Factor on each parameter's standard error, at least 1. `unscaled` is (JᵀJ)⁻¹; rows are in time order.
pub fn inflation<const P: usize>(rows: &Rows<P>, unscaled: &SMatrix<f64, P, P>) -> SVector<f64, P> {
    let influence: Vec<SVector<f64, P>> =
        rows.residuals.iter().zip(&rows.jacobian).map(|(r, j)| unscaled * j * *r).collect();
    SVector::from_fn(|k, _| blocked_ratio(influence.iter().map(|v| v[k]).collect()).max(1.0).sqrt())
}

/// Variance of a series' sum over that of an independent series of the same spread.
fn blocked_ratio(mut sums: Vec<f64>) -> f64 {
    let spread = mean_square(&sums) * sums.len() as f64;
    if spread <= 0.0 || !spread.is_finite() {
        return 1.0;
    }
    let mut ratio = 1.0;
    while sums.len() >= 2 * LEAST_BLOCKS {
        sums = sums.chunks_exact(2).map(|pair| pair[0] + pair[1]).collect();
        let blocks = sums.len() as f64;
        // The sums add up to nothing at the optimum, which takes one of their degrees of freedom.
        let wider = mean_square(&sums) * blocks / spread * blocks / (blocks - 1.0);
        let settled = wider <= ratio * (1.0 + (2.0 / blocks).sqrt());
        ratio = ratio.max(wider);
        if settled {
            break;
        }
    }
    ratio
}

fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    fn autoregression(rho: f64, count: usize) -> Vec<f64> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut state = 0.0;
        (0..count)
            .map(|_| {
                let e: f64 = StandardNormal.sample(&mut rng);
                state = rho * state + e;
                state
            })
            .collect()
    }

    #[test]
    fn white_residuals_are_hardly_inflated() {
        assert!((blocked_ratio(autoregression(0.0, 5000)) - 1.0).abs() < 0.1);
    }

    #[test]
    fn an_autoregression_has_its_known_variance() {
        // (1 + ρ)/(1 − ρ) = 19 for ρ = 0.9.
        let ratio = blocked_ratio(autoregression(0.9, 20_000));
        assert!((15.0..23.0).contains(&ratio), "{ratio}");
    }
}

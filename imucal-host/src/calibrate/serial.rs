//! How much larger standard errors are because neighbouring residuals are alike.
//!
//! With ψ_i = (JᵀJ)⁻¹ J_i r_i the influence of observation i, a parameter's variance is the long-run variance of
//! its ψ: `Σ ψ_i² + 2 Σ_l w_l Σ_i ψ_i ψ_{i+l}` with Bartlett's weights (Newey & West 1987) and the bandwidth of
//! Andrews 1991 for a first-order autoregression. Its ratio to `Σ ψ_i²` inflates the classical variance, parameter
//! by parameter, and never below one: that keeps the covariance's correlations and its rank.

use nalgebra::{SMatrix, SVector};

use super::rows::Rows;

/// Lags are cut at this share of the observations: beyond it the sums are noise.
const LONGEST_SHARE: f64 = 0.1;

/// Factor on each parameter's standard error, at least 1. `unscaled` is (JᵀJ)⁻¹; rows are in time order.
pub fn inflation<const P: usize>(rows: &Rows<P>, unscaled: &SMatrix<f64, P, P>) -> SVector<f64, P> {
    let influence: Vec<SVector<f64, P>> = rows
        .residuals
        .iter()
        .zip(&rows.jacobian)
        .map(|(r, j)| unscaled * j * *r)
        .collect();
    SVector::from_fn(|k, _| {
        long_run_ratio(&influence.iter().map(|v| v[k]).collect::<Vec<_>>())
            .max(1.0)
            .sqrt()
    })
}

/// Long-run variance of a series over its variance.
fn long_run_ratio(series: &[f64]) -> f64 {
    let zero = autocovariance(series, 0);
    if !(zero > 0.0) {
        return 1.0;
    }
    let lags = bandwidth(autocovariance(series, 1) / zero, series.len());
    let sum: f64 = (1..=lags)
        .map(|lag| (1.0 - lag as f64 / (lags + 1) as f64) * autocovariance(series, lag))
        .sum();
    1.0 + 2.0 * sum / zero
}

fn autocovariance(series: &[f64], lag: usize) -> f64 {
    series
        .iter()
        .zip(series.iter().skip(lag))
        .map(|(a, b)| a * b)
        .sum()
}

/// Andrews' bandwidth for Bartlett's weights, from the first autocorrelation.
fn bandwidth(rho: f64, count: usize) -> usize {
    let rho = rho.clamp(-0.99, 0.99);
    let alpha = 4.0 * rho * rho / ((1.0 - rho).powi(2) * (1.0 + rho).powi(2));
    let lags = 1.1447 * (alpha * count as f64).cbrt();
    (lags as usize).min((LONGEST_SHARE * count as f64) as usize)
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
        assert!((long_run_ratio(&autoregression(0.0, 5000)) - 1.0).abs() < 0.15);
    }

    #[test]
    fn an_autoregression_has_its_known_long_run_variance() {
        // (1 + ρ)/(1 − ρ) = 19 for ρ = 0.9; Bartlett's weights lose some of it.
        let ratio = long_run_ratio(&autoregression(0.9, 20_000));
        assert!((15.0..21.0).contains(&ratio), "{ratio}");
    }
}

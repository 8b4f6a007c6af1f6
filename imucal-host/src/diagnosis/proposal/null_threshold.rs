//! How much a formula must gain: what the best of all formulas gains where there is noise alone.
//!
//! Residuals are drawn from the fitted noise, for the same movement, and go through the same screening and judging. Their
//! largest gains follow Gumbel's law, whose quantile is the threshold.
//!
//! ```text
//! P(G > g) = 1 − exp(−exp(−(g − μ) / β))      β = √6 s / π,   μ = m − γ β
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | m, s | mean and standard deviation of the largest gains |
//! | γ | Euler's constant |
//!
//! Source: Gumbel, Statistics of Extremes (1958), ch. 6.

use std::f64::consts::PI;

use super::{judgement, problem::Problem, screening, term::Formulated};
use crate::{
    diagnosis::{error::DiagnosisError, mixed_model::noise::Noise},
    simulator::random::{Purpose, Random},
};

/// Residuals that are drawn.
const DRAWS: usize = 8;
/// Share of healthy recordings in which some formula may gain more.
const FALSE: f64 = 1e-3;
/// The scale is known no better than this by so few draws.
const LEAST_SCALE: f64 = 1.0;
const EULER: f64 = 0.577_215_664_901_532_9;

/// The gain that the best of these formulas exceeds in one of a thousand healthy recordings.
///
/// # Errors
///
/// [`DiagnosisError::Score`].
pub fn threshold(
    problem: &Problem<'_, '_>,
    formulas: &[Formulated],
    noise: &Noise,
) -> Result<f64, DiagnosisError> {
    let mut random = Random::new(problem.kind as u64, Purpose::Noise);
    let weighing = &problem.linear.weighing;
    let drawn: Vec<_> = (0..DRAWS).map(|_| weighing.drawn(problem.kind, noise, &mut random)).collect();
    let mut most = vec![f64::NEG_INFINITY; DRAWS];
    let screened = screening::screen(problem, formulas, &[noise], &drawn)?;
    let of_drawn = screened.iter().flat_map(|screened| &screened.of_further);
    for (at, (gains, residual)) in of_drawn.zip(&drawn).enumerate() {
        let best = gains.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
        let Some((best, _)) = best else { continue };
        let residual = problem.leaving(residual);
        let before = problem.weighed(&residual, &[], noise)?;
        let judged = judgement::judged(problem, &residual, &before, &formulas[best], noise)?;
        most[at] = judged.map_or(f64::NEG_INFINITY, |judged| judged.gain);
    }
    most.retain(|gain| gain.is_finite());
    Ok(exceeded_by(&most))
}

/// The value that the largest of a family exceeds in a share [`FALSE`] of cases, from some largest ones.
fn exceeded_by(largest: &[f64]) -> f64 {
    let count = largest.len().max(1) as f64;
    let mean = largest.iter().sum::<f64>() / count;
    let square = largest.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
    let scale = f64::max(square.sqrt() * 6f64.sqrt() / PI, LEAST_SCALE);
    mean - EULER * scale - scale * (-(-FALSE).ln_1p()).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_threshold_is_the_quantile_of_the_law_that_was_drawn_from() {
        let mut random = Random::new(3, Purpose::Noise);
        let drawn: Vec<f64> = (0..20_000).map(|_| 5.0 - 2.0 * (-random.share().ln()).ln()).collect();
        let exact = 5.0 - 2.0 * (-(1.0 - FALSE).ln()).ln();
        assert!((exceeded_by(&drawn) - exact).abs() < 0.3, "{} {exact}", exceeded_by(&drawn));
    }
}

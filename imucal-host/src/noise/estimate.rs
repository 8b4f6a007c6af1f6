//! How much white noise, scatter and drift the residuals of a fit show.
//!
//! ```text
//! V = s² S (1/T + ρ F),   w = E(s²),   d = E(s² ρ)      over their posterior
//! p(y | s, ρ) ∝ |V|^−½ |JᵀV⁻¹J|^−½ exp(−½ rᵀPr)
//! p(s²) = ½ δ(s² − 1) + ½ / (s² ln 10⁶) for s² ≥ 1;      p(ρ) ∝ 1/ρ
//! ```
//!
//! The restricted likelihood (Patterson & Thompson 1971), in which the fit's parameters have been integrated out: a
//! bias takes the slow part of a drift with it, and its residuals alone would show too little of it. A posterior mean,
//! since a single recording tells a drift badly, and the likeliest one is too small as often as too large, where only
//! too small is false precision. Scatter is none, or of any size: means are no quieter than the noise within them.
//! Where that noise is not known, p(s²) ∝ 1/s².
//!
//! ρ goes from a drift no larger than what the white noise of all observations averages to, to 4000 times its
//! variance. That there is none at all, a recording cannot tell: without any, the error of a bias is said to be up to
//! twice as large as it is (`tests/recovery_rig`).

use nalgebra::{DMatrix, DVector, Vector3};
use statrs::function::gamma::{gamma_lr, ln_gamma};

use super::{Noise, Span, restricted::Restricted, whitening::Whitening};

/// Ratios ρ that are weighed, each twice the one before.
const RATIOS: u32 = 13;
/// ln of the range that s² has one half of its prior in.
const SCATTER: f64 = 13.8;
/// Of more observations than this, those of a long recording, every second, third … is weighed: all would take long.
const MOST: usize = 300;

/// Residuals of observations in time order, three rows each, and their derivatives by what is fitted.
#[derive(Clone, Copy, Debug)]
pub struct Residuals<'a> {
    /// When; no two overlap.
    pub spans: &'a [Span],
    /// White noise within them, unit²·s; `None` where it is not known.
    pub density: Option<Vector3<f64>>,
    /// Of any fit: what the parameters can explain is taken out of them.
    pub residuals: &'a DVector<f64>,
    /// By the parameters, of full rank.
    pub jacobian: &'a DMatrix<f64>,
}

impl Noise {
    /// Of residuals; `None` where there are too few, or the derivatives are dependent.
    pub fn of(given: &Residuals<'_>) -> Option<Self> {
        let step = given.spans.len().div_ceil(MOST).max(1);
        let spans: Vec<Span> = given.spans.iter().step_by(step).cloned().collect();
        let (rows, free) = (3 * spans.len(), given.jacobian.ncols());
        if given.jacobian.nrows() != 3 * given.spans.len() || rows < free + 3 {
            return None;
        }
        let weighed = |row: usize| 3 * step * (row / 3) + row % 3;
        let residuals = DMatrix::from_fn(rows, 1, |row, _| given.residuals[weighed(row)]);
        let mut jacobian = DMatrix::from_fn(rows, free, |row, k| given.jacobian[(weighed(row), k)]);
        // Columns at unit length: parameters of different units would spoil the factorisation.
        jacobian.column_iter_mut().for_each(|mut column| {
            column.normalize_mut();
        });
        let density = given.density.unwrap_or_else(|| Vector3::repeat(1.0));
        let observed = given.spans.iter().map(|span| span.end - span.start).sum::<f64>();
        let weighed = (0..RATIOS).filter_map(|k| {
            let drift = f64::from(1u32 << k) / observed;
            let whitening = Self { density, white: 1.0, drift }.whitening(&spans)?;
            Some((drift, weigh(&whitening, &residuals, &jacobian, given.density.is_some())?))
        });
        let weighed: Vec<(f64, Weighed)> = weighed.collect();
        let most = weighed.iter().map(|(_, w)| w.log_likelihood).fold(f64::NEG_INFINITY, f64::max);
        let (mut sum, mut white, mut drift) = (0.0, 0.0, 0.0);
        for (ratio, each) in &weighed {
            let weight = (each.log_likelihood - most).exp();
            sum += weight;
            white += weight * each.scale;
            drift += weight * each.scale * ratio;
        }
        let noise = Self { density, white: white / sum, drift: drift / sum };
        (noise.white.is_finite() && noise.drift.is_finite()).then_some(noise)
    }
}

/// What one ratio comes to.
struct Weighed {
    log_likelihood: f64,
    /// E(s²).
    scale: f64,
}

fn weigh(
    whitening: &Whitening,
    residuals: &DMatrix<f64>,
    jacobian: &DMatrix<f64>,
    known: bool,
) -> Option<Weighed> {
    let data = whitening.whiten(residuals)?;
    let found = Restricted::of(&data, whitening.whiten(jacobian)?, whitening.log_determinant());
    let moment = |power: f64| log_moment(0.5 * found.freedom as f64 - power, 0.5 * found.left, known);
    Some(Weighed { log_likelihood: found.log_volume + moment(0.0), scale: (moment(1.0) - moment(0.0)).exp() })
}

/// ln ∫ s^−2a exp(−x/s²) p(s²) ds².
fn log_moment(a: f64, x: f64, known: bool) -> f64 {
    let all = ln_gamma(a) - a * x.ln();
    if !known {
        return all;
    }
    let share = gamma_lr(a, x);
    // Below the least number its series' first term is left.
    let share = if share > 0.0 { share.ln() } else { a * x.ln() - x - ln_gamma(a + 1.0) };
    let (none, some) = (-x, all + share - SCATTER.ln());
    let larger = none.max(some);
    larger + 0.5f64.ln() + ((none - larger).exp() + (some - larger).exp()).ln()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Rests of 4 s, 6.5 s apart.
    fn spans(count: usize) -> Vec<Span> {
        (0..count).map(|k| 6.5 * k as f64).map(|from| from..from + 4.0).collect()
    }

    /// Means of three axes over the spans: white noise of density 1, times `white` from one to the next, and a flicker
    /// of variance `drift` in steps of a quarter of a second.
    fn means(spans: &[Span], white: f64, drift: f64, seed: u64) -> DVector<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut rows = DVector::zeros(3 * spans.len());
        for axis in 0..3 {
            let times = [10.0, 100.0, 1000.0];
            let each = (drift / 3.0).sqrt();
            let mut states = times.map(|_| normal() * each);
            let mut at = 0.0;
            for (k, span) in spans.iter().enumerate() {
                let (mut sum, mut count) = (0.0, 0.0);
                while at < span.end {
                    for (state, time) in states.iter_mut().zip(times) {
                        let kept = (-0.25f64 / time).exp();
                        *state = *state * kept + normal() * each * (1.0 - kept * kept).sqrt();
                    }
                    if at >= span.start {
                        sum += states.iter().sum::<f64>();
                        count += 1.0;
                    }
                    at += 0.25;
                }
                rows[3 * k + axis] = sum / count + normal() * (white / (span.end - span.start)).sqrt();
            }
        }
        rows
    }

    /// Derivatives by three biases.
    fn biases(count: usize) -> DMatrix<f64> {
        DMatrix::from_fn(3 * count, 3, |row, k| f64::from(u8::from(row % 3 == k)))
    }

    /// What the variance of a mean is said to be over what it is, of 200 seeds' three axes.
    fn said(white: f64, drift: f64, density: Option<Vector3<f64>>) -> f64 {
        let spans = spans(32);
        let jacobian = biases(32);
        let (mut square, mut expected) = (0.0, 0.0);
        for seed in 0..200 {
            let residuals = means(&spans, white, drift, seed);
            let given = Residuals { spans: &spans, density, residuals: &residuals, jacobian: &jacobian };
            let noise = Noise::of(&given).unwrap();
            square += (jacobian.tr_mul(&residuals) / 32.0).norm_squared();
            expected += noise.propagated(&spans, &(&jacobian / 32.0)).trace();
        }
        expected / square
    }

    #[test]
    fn the_variance_of_a_mean_is_that_of_drift_and_white_noise() {
        // 600 squares know a variance to 6 %, where the slow part of the drift is its own in each.
        for (white, drift, low, high) in
            [(1.0, 0.0, 1.0, 5.0), (1.0, 0.1, 0.75, 1.6), (1.0, 1.0, 0.75, 1.35), (30.0, 10.0, 0.75, 1.7)]
        {
            for density in [None, Some(Vector3::repeat(1.0))] {
                let ratio = said(white, drift, density);
                assert!((low..high).contains(&ratio), "{white} {drift} {density:?}: {ratio}");
            }
        }
    }

    #[test]
    fn noise_is_as_large_as_residuals_whatever_rests_show() {
        let spans = spans(32);
        let jacobian = biases(32);
        for scatter in [1.0, 100.0, 1e8] {
            let residuals = means(&spans, scatter, 0.0, 5);
            for density in [None, Some(Vector3::repeat(1.0)), Some(Vector3::repeat(1e-9))] {
                let given = Residuals { spans: &spans, density, residuals: &residuals, jacobian: &jacobian };
                let noise = Noise::of(&given).unwrap();
                let variance = noise.density.x * noise.relative_covariance(&spans)[(0, 0)];
                // 93 degrees of freedom know it to 15 %; a drift that might be there comes on top.
                assert!(
                    (0.6..2.0).contains(&(variance / (scatter / 4.0))),
                    "{scatter} {density:?}: {variance}"
                );
            }
        }
        // Residuals that are quieter than the noise within rests lower nothing.
        let given = Residuals {
            spans: &spans,
            density: Some(Vector3::repeat(1.0)),
            residuals: &DVector::zeros(96),
            jacobian: &jacobian,
        };
        assert!((Noise::of(&given).unwrap().white - 1.0).abs() < 0.1);
    }

    #[test]
    fn whitened_rows_have_unit_variance_and_no_memory() {
        let spans = spans(40);
        let noise = Noise { density: Vector3::repeat(1.0), white: 1.0, drift: 1.0 };
        let whitening = noise.whitening(&spans).unwrap();
        let (mut square, mut product) = (0.0, 0.0);
        for seed in 0..50 {
            let rows = means(&spans, 1.0, 1.0, seed);
            let white = whitening.whiten(&DMatrix::from_column_slice(120, 1, rows.as_slice())).unwrap();
            square += white.norm_squared() / 6000.0;
            product += (3..120).map(|k| white[k] * white[k - 3]).sum::<f64>() / 5850.0;
        }
        assert!((square - 1.0).abs() < 0.06 && product.abs() < 0.05, "{square} {product}");
    }

    #[test]
    fn every_other_of_many_observations_tells_as_much_as_all_of_some() {
        let spans = spans(2 * MOST);
        let residuals = means(&spans, 1.0, 1.0, 3);
        let jacobian = biases(2 * MOST);
        let given = Residuals { spans: &spans, density: None, residuals: &residuals, jacobian: &jacobian };
        let noise = Noise::of(&given).unwrap();
        // A recording of an hour is given a fourth correlation time, which this drift has not: what the others then
        // lack of its fastest part is taken for scatter.
        assert!((0.8..1.6).contains(&noise.white) && (0.6..1.7).contains(&noise.drift), "{noise:?}");
    }

    #[test]
    fn too_few_rows_have_no_noise() {
        let spans = spans(1);
        let given =
            Residuals { spans: &spans, density: None, residuals: &DVector::zeros(3), jacobian: &biases(1) };
        assert!(Noise::of(&given).is_none());
    }
}

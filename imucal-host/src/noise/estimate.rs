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
//! since a single recording determines a drift badly, and the likeliest one is too small as often as too large, where only
//! too small is false precision. Scatter is none, or of any size: means are no quieter than the noise within them.
//! Where that noise is not known, p(s²) ∝ 1/s².
//!
//! ρ goes from a drift no larger than what the white noise of all observations averages to, to 4000 times its
//! variance. That there is none at all, a recording cannot show: without any, the error of a bias is said to be up to
//! twice as large as it is (`tests/recovery_rig`).

use nalgebra::{DMatrix, DVector, Vector3};
use statrs::function::gamma::{gamma_lr, ln_gamma};

use super::{
    Noise, Span, flicker,
    knots::Knots,
    precision::Precision,
    random_effects::{ChannelBlocks, RandomEffects},
    restricted::Restricted,
    sparse_rows::SparseRows,
};

/// Ratios ρ that are weighed, each twice the one before.
const RATIOS: u32 = 13;
/// ln of the range that s² has one half of its prior in.
const SCATTER: f64 = 13.8;

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
        let (rows, free) = (3 * given.spans.len(), given.jacobian.ncols());
        if given.jacobian.nrows() != rows || rows < free + 3 || given.spans.iter().any(Span::is_empty) {
            return None;
        }
        let density = given.density.unwrap_or_else(|| Vector3::repeat(1.0));
        let columns = columns(given, &density);
        let observed = given.spans.iter().map(|span| span.end - span.start).sum::<f64>();
        let volume = given.spans.len() as f64 * density.map(f64::ln).sum();
        let weighed = (0..RATIOS).filter_map(|k| {
            let drift = f64::from(1u32 << k) / observed;
            let (products, log_determinant) = products(given.spans, drift, &columns);
            let found = Restricted::of_products(&products, rows, 3.0 * log_determinant + volume)?;
            Some((drift, Weighed::of(&found, given.density.is_some())))
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

impl Weighed {
    fn of(found: &Restricted, known: bool) -> Self {
        let moment = |power: f64| log_moment(0.5 * found.freedom as f64 - power, 0.5 * found.left, known);
        Self { log_likelihood: found.log_volume + moment(0.0), scale: (moment(1.0) - moment(0.0)).exp() }
    }
}

/// Derivatives and, last, residuals of each axis in units of its white noise; derivatives at unit length over all axes,
/// since parameters of different units would spoil the factorisation.
fn columns(given: &Residuals<'_>, density: &Vector3<f64>) -> [Vec<Vec<f64>>; 3] {
    let lengths: Vec<f64> = given.jacobian.column_iter().map(|column| column.norm()).collect();
    [0, 1, 2].map(|axis| {
        let of_axis = |column: &dyn Fn(usize) -> f64, length: f64| -> Vec<f64> {
            let scale = 1.0 / (length * density[axis].sqrt());
            (0..given.spans.len()).map(|k| column(3 * k + axis) * scale).collect()
        };
        let derivatives =
            lengths.iter().enumerate().map(|(k, length)| of_axis(&|row| given.jacobian[(row, k)], *length));
        derivatives.chain([of_axis(&|row| given.residuals[row], 1.0)]).collect()
    })
}

/// Xᵀ (V/S)⁻¹ X over all axes, and ln|V/S| of one, for white noise of w = 1 and a drift.
fn products(spans: &[Span], drift: f64, columns: &[Vec<Vec<f64>>; 3]) -> (DMatrix<f64>, f64) {
    let processes = flicker::processes(spans, drift);
    let weight = |span: &Span| {
        let length = span.end - span.start;
        let own: f64 = processes.iter().map(|process| process.mean_given_ends(length).1).sum();
        1.0 / (1.0 / length + own)
    };
    let channel = ChannelBlocks {
        weights: spans.iter().map(weight).collect(),
        offsets: SparseRows::empty(spans.len()),
    };
    let knots = Knots::over(spans, &processes);
    let effects = RandomEffects::new(knots, vec![channel], 0, processes.len());
    let precision = Precision::new(&effects.states, 0.0, &[&processes]);
    let of_axis = |columns: &Vec<Vec<f64>>| {
        let columns = columns.iter().map(Vec::as_slice).collect();
        precision.products(&effects.cross_products(&[columns]))
    };
    let [x, y, z] = columns.each_ref().map(of_axis);
    (x + y + z, precision.log_determinant)
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
                let variance = noise.density.x * noise.carried(&spans[..1], &DMatrix::identity(1, 1))[(0, 0)];
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
    fn the_likelihood_is_that_of_the_dense_covariance() {
        let (spans, drift) = (spans(20), 0.7);
        let residuals = means(&spans, 1.0, 1.0, 3);
        let density = Vector3::new(1.0, 2.0, 0.5);
        let jacobian = DMatrix::from_fn(60, 2, |row, k| ((row + 7 * k) as f64).cos());
        let given =
            Residuals { spans: &spans, density: Some(density), residuals: &residuals, jacobian: &jacobian };
        let (found, log_determinant) = products(&spans, drift, &columns(&given, &density));
        let white = DMatrix::identity(20, 20) / 4.0;
        let covariance = white + flicker::covariance_of(&spans, &flicker::processes(&spans, drift));
        let factor = covariance.cholesky().unwrap();
        let mut expected = DMatrix::zeros(3, 3);
        for axis in 0..3 {
            let x = DMatrix::from_fn(20, 3, |k, column| {
                let row = 3 * k + axis;
                let value = if column < 2 {
                    jacobian[(row, column)] / jacobian.column(column).norm()
                } else {
                    residuals[row]
                };
                value / density[axis].sqrt()
            });
            expected += x.tr_mul(&factor.solve(&x));
        }
        assert!((found - expected).amax() < 1e-9);
        assert!((log_determinant - factor.ln_determinant()).abs() < 1e-9);
    }

    #[test]
    fn six_hundred_observations_tell_white_noise_and_drift() {
        let spans = spans(600);
        let residuals = means(&spans, 1.0, 1.0, 3);
        let jacobian = biases(600);
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

//! How much white noise, scatter and drift residuals show, and what it does to a fit.
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

use super::{Span, flicker, whitening::Whitening};

/// Ratios ρ that are weighed, each twice the one before.
const RATIOS: u32 = 13;
/// ln of the range that s² has one half of its prior in.
const SCATTER: f64 = 13.8;
/// More observations than this are rests of a long recording, whose drift would take long to weigh.
const MOST: usize = 500;

/// Noise of a triad's observations, axis by axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// White noise and scatter: density, unit²·s.
    pub white: Vector3<f64>,
    /// Drift: variance, unit².
    pub drift: Vector3<f64>,
}

/// Observations in time order, three rows each, and their derivatives by what is fitted.
#[derive(Clone, Copy, Debug)]
pub struct Residuals<'a> {
    /// When.
    pub spans: &'a [Span],
    /// White noise within them, unit²·s; `None` where it is not known.
    pub density: Option<Vector3<f64>>,
    /// Left by a fit of least squares.
    pub residuals: &'a DVector<f64>,
    /// By the parameters, of full rank.
    pub jacobian: &'a DMatrix<f64>,
}

impl Noise {
    /// Of residuals; `None` where there are too few, too many, or the derivatives are dependent.
    pub fn of(given: &Residuals<'_>) -> Option<Self> {
        let (rows, free) = given.jacobian.shape();
        if given.spans.len() > MOST || rows != 3 * given.spans.len() || rows < free + 3 {
            return None;
        }
        let density = given.density.unwrap_or_else(|| Vector3::repeat(1.0));
        let by_axis = |row: usize| density[row % 3].sqrt();
        let residuals = DMatrix::from_fn(rows, 1, |row, _| given.residuals[row] / by_axis(row));
        // Columns at unit length: parameters of different units would spoil the factorisation.
        let length: Vec<f64> = given.jacobian.column_iter().map(|column| column.norm()).collect();
        let jacobian =
            DMatrix::from_fn(rows, free, |row, k| given.jacobian[(row, k)] / (length[k] * by_axis(row)));
        let flicker = flicker::covariance(given.spans);
        let weigh = |ratio: f64| {
            let whitening = Whitening::new(unit_covariance(given.spans, &flicker, 1.0, ratio))?;
            weigh(&whitening, &residuals, &jacobian, given.density.is_some())
        };
        let observed = given.spans.iter().map(|span| span.end - span.start).sum::<f64>();
        let ratios = (0..RATIOS).map(|k| f64::from(1u32 << k) / observed);
        let weighed: Vec<(f64, Weighed)> =
            ratios.filter_map(|ratio| Some((ratio, weigh(ratio)?))).collect();
        let most = weighed.iter().map(|(_, w)| w.log_likelihood).fold(f64::NEG_INFINITY, f64::max);
        let (mut sum, mut white, mut drift) = (0.0, 0.0, 0.0);
        for (ratio, each) in &weighed {
            let weight = (each.log_likelihood - most).exp();
            sum += weight;
            white += weight * each.scale;
            drift += weight * each.scale * ratio;
        }
        let noise = Self { white: density * (white / sum), drift: density * (drift / sum) };
        (noise.white.iter().chain(noise.drift.iter()).all(|x| x.is_finite()) && white > 0.0).then_some(noise)
    }

    /// Covariance of one axis's observations, unit².
    pub fn covariance(&self, spans: &[Span], axis: usize) -> DMatrix<f64> {
        unit_covariance(spans, &flicker::covariance(spans), self.white[axis], self.drift[axis])
    }

    /// Covariance of what follows linearly from the observations: `influence` has three rows for each, and a column
    /// for each result.
    pub fn propagated(&self, spans: &[Span], influence: &DMatrix<f64>) -> DMatrix<f64> {
        let mut sum = DMatrix::zeros(influence.ncols(), influence.ncols());
        for axis in 0..3 {
            let own = influence.rows_with_step(axis, spans.len(), 2);
            sum += own.transpose() * self.covariance(spans, axis) * own;
        }
        sum
    }
}

/// White noise of this density and drift of this variance.
fn unit_covariance(spans: &[Span], flicker: &DMatrix<f64>, white: f64, drift: f64) -> DMatrix<f64> {
    let mut covariance = flicker * drift;
    for (k, span) in spans.iter().enumerate() {
        covariance[(k, k)] += white / (span.end - span.start);
    }
    covariance
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
    let (rows, free) = jacobian.shape();
    let data = whitening.whiten(residuals)?;
    let qr = whitening.whiten(jacobian)?.qr();
    let log_det_fit = 2.0 * qr.r().diagonal().iter().map(|d| d.abs().ln()).sum::<f64>();
    let explained = qr.q().tr_mul(&data).norm_squared();
    let left = (data.norm_squared() - explained).max(f64::MIN_POSITIVE);
    let moment = |power: f64| log_moment(0.5 * (rows - free) as f64 - power, 0.5 * left, known);
    Some(Weighed {
        log_likelihood: -0.5 * (3.0 * whitening.log_determinant() + log_det_fit) + moment(0.0),
        scale: (moment(1.0) - moment(0.0)).exp(),
    })
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

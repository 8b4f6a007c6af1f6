//! How well a set of effects explains what the baseline leaves.
//!
//! ```text
//! s = z_E − G_EB (G_BB + Λ)⁻¹ z_B      V = G_EE − G_EB (G_BB + Λ)⁻¹ G_BE
//! ln BF = −½ ln|I + A V A| + ½ sᵀ (V + A⁻²)⁻¹ s      A: prior standard deviations of the amplitudes
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | G, z | Jᵀ Σ⁻¹ J and Jᵀ Σ⁻¹ r, in usual sizes of the parameters |
//! | B, E | columns of the baseline and of effects |
//! | Λ | a prior so loose that it only keeps the inverse finite |
//!
//! An effect's size is not known beforehand, nor whether it acts on one axis alone: its evidence is the mean over a few
//! scales of all its amplitudes and of each, those of the other effects being the likeliest. Source: Kass and Raftery,
//! Bayes factors, J. Am. Stat. Assoc. 90 (1995); the projection is Neyman's efficient score.

use nalgebra::{DMatrix, DVector};

use super::design::{LOOSE, Normal, loosened};

/// A signature of this whitened squared size is found in four of five recordings.
pub const SEEN: f64 = 25.0;
/// Sizes an effect may have, in usual ones.
const SCALES: [f64; 8] = [0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0];
/// Share of effects of several amplitudes of which one stands alone: a shock moves one axis, one of them is curved.
const ALONE: f64 = 0.3;
/// How often each effect of several is given its likeliest scale.
const SWEEPS: usize = 2;

/// Score and information of effects' columns after the baseline's projection.
#[derive(Clone, Debug)]
pub struct Projected {
    /// s.
    pub score: DVector<f64>,
    /// V.
    pub information: DMatrix<f64>,
    /// Information before the projection, column by column.
    pub before: DVector<f64>,
}

impl Projected {
    /// Projects the columns `baseline` out of the others, which keep their order. `None` where that is impossible.
    pub fn new(normal: &Normal, baseline: &[usize], others: &[usize]) -> Option<Self> {
        let pick = |rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |i, j| normal.information[(rows[i], columns[j])])
        };
        let score = |rows: &[usize]| DVector::from_fn(rows.len(), |i, _| normal.score[rows[i]]);
        let across = pick(baseline, others);
        let factor = loosened(pick(baseline, baseline))?;
        let information = pick(others, others) - across.transpose() * factor.solve(&across);
        let before = DVector::from_fn(others.len(), |i, _| normal.information[(others[i], others[i])]);
        Some(Self {
            score: score(others) - across.transpose() * factor.solve(&score(baseline)),
            information,
            before,
        })
    }

    /// The columns at these places.
    fn part(&self, places: &[usize]) -> (DVector<f64>, DMatrix<f64>) {
        let n = places.len();
        (
            DVector::from_fn(n, |i, _| self.score[places[i]]),
            DMatrix::from_fn(n, n, |i, j| self.information[(places[i], places[j])]),
        )
    }

    /// ln BF of effects, each given by the places of its columns, against none of them.
    pub fn log_bayes_factor(&self, effects: &[&[usize]]) -> f64 {
        let places: Vec<usize> = effects.concat();
        let owner: Vec<usize> =
            effects.iter().enumerate().flat_map(|(k, own)| own.iter().map(move |_| k)).collect();
        let (score, information) = self.part(&places);
        let mut usual = DVector::repeat(places.len(), SCALES[3]);
        let mut priors = vec![0.0; effects.len()];
        let mut log_sum = 0.0;
        for _ in 0..if effects.len() > 1 { SWEEPS } else { 1 } {
            let mut breadth = 0.0;
            for effect in 0..effects.len() {
                let own: Vec<usize> = (0..places.len()).filter(|at| owner[*at] == effect).collect();
                let (mut most, mut best) = (f64::NEG_INFINITY, (0.0, usual.clone()));
                let mut values = Vec::new();
                for (prior, sizes) in sizes(own.len()) {
                    own.iter().zip(sizes).for_each(|(at, size)| usual[*at] = size);
                    let value = prior + log_bayes_factor(&score, &information, &usual);
                    if value > most {
                        (most, best) = (value, (prior, usual.clone()));
                    }
                    values.push(value);
                }
                (priors[effect], usual) = best;
                breadth += values.iter().map(|value| (value - most).exp()).sum::<f64>().ln();
                log_sum = most - priors[effect] + priors.iter().sum::<f64>() + breadth;
            }
        }
        if log_sum.is_nan() { f64::NEG_INFINITY } else { log_sum }
    }

    /// Of columns that are those at `with` less those at `without`.
    pub fn combined(&self, with: &[usize], without: Option<&[usize]>) -> Self {
        let places: Vec<usize> = with.iter().chain(without.unwrap_or_default()).copied().collect();
        let (score, information) = self.part(&places);
        let n = with.len();
        let sign = |part: usize| if part == 0 { 1.0 } else { -1.0 };
        let parts = if without.is_some() { 2 } else { 1 };
        let pairs = || (0..parts).flat_map(|a| (0..parts).map(move |b| (a, b)));
        Self {
            score: DVector::from_fn(n, |i, _| (0..parts).map(|a| sign(a) * score[a * n + i]).sum()),
            information: DMatrix::from_fn(n, n, |i, j| {
                pairs().map(|(a, b)| sign(a) * sign(b) * information[(a * n + i, b * n + j)]).sum()
            }),
            before: DVector::zeros(n),
        }
    }

    /// Most likely amplitudes of some columns with loose priors, and their covariance.
    pub fn estimate(&self, places: &[usize]) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let (score, information) = self.part(places);
        let n = places.len();
        let covariance = (information + DMatrix::identity(n, n) / (LOOSE * LOOSE)).try_inverse()?;
        Some((&covariance * score, covariance))
    }

    /// Whitened squared size of what some columns explain.
    pub fn explained(&self, places: &[usize]) -> f64 {
        let (score, _) = self.part(places);
        self.estimate(places).map_or(0.0, |(amplitudes, _)| amplitudes.dot(&score))
    }
}

/// Usual sizes that an effect's amplitudes may have, and ln of the prior of each: all of them alike, or one alone.
fn sizes(count: usize) -> impl Iterator<Item = (f64, Vec<f64>)> {
    let alone = if count > 1 { ALONE } else { 0.0 };
    let all = std::iter::once((1.0 - alone, None));
    let each = (0..count).map(move |at| (alone / count as f64, Some(at)));
    let acts = move |at: usize, only: Option<usize>| only.is_none_or(|only| only == at);
    all.chain(each).filter(|(share, _)| *share > 0.0).flat_map(move |(share, only)| {
        SCALES.into_iter().map(move |scale| {
            let sizes = (0..count).map(|at| if acts(at, only) { scale } else { 0.0 }).collect();
            ((share / SCALES.len() as f64).ln(), sizes)
        })
    })
}

/// ln BF of columns of these usual sizes.
fn log_bayes_factor(score: &DVector<f64>, information: &DMatrix<f64>, usual: &DVector<f64>) -> f64 {
    let n = score.len();
    let scaled =
        DMatrix::from_fn(n, n, |i, j| usual[i] * information[(i, j)] * usual[j]) + DMatrix::identity(n, n);
    let Some(factor) = scaled.cholesky() else { return f64::NEG_INFINITY };
    let scaled_score = score.component_mul(usual);
    0.5 * (scaled_score.dot(&factor.solve(&scaled_score)) - factor.ln_determinant())
}

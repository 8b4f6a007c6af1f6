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

use crate::diagnosis::{
    error::DiagnosisError,
    mixed_model::{
        design::{LOOSE, Normal, loosened},
        likelihood::reml_criterion,
        noise::Noise,
    },
};

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
    pub fn new(normal: &Normal, baseline: &[usize], others: &[usize]) -> Result<Self, DiagnosisError> {
        let pick = |rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |i, j| normal.information[(rows[i], columns[j])])
        };
        let score = |rows: &[usize]| DVector::from_fn(rows.len(), |i, _| normal.score[rows[i]]);
        let across = pick(baseline, others);
        let columns = baseline.len();
        let factor = loosened(pick(baseline, baseline)).ok_or(DiagnosisError::Score { columns })?;
        let information = pick(others, others) - across.transpose() * factor.solve(&across);
        let before = DVector::from_fn(others.len(), |i, _| normal.information[(others[i], others[i])]);
        Ok(Self {
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
        let all = Columns { score, information };
        let mut usual = DVector::repeat(places.len(), SCALES[3]);
        let mut priors = vec![0.0; effects.len()];
        let mut log_sum = 0.0;
        for _ in 0..if effects.len() > 1 { SWEEPS } else { 1 } {
            let mut breadth = 0.0;
            for effect in 0..effects.len() {
                let (own, others): (Vec<usize>, Vec<usize>) =
                    (0..places.len()).partition(|at| owner[*at] == effect);
                let Some((marginal, given)) = all.given(&own, &others, &usual) else {
                    return f64::NEG_INFINITY;
                };
                let sized = given.sized();
                let Some(best) = sized.iter().max_by(|a, b| a.value.total_cmp(&b.value)) else { continue };
                own.iter().enumerate().for_each(|(k, at)| usual[*at] = best.size(k));
                priors[effect] = best.prior;
                breadth += sized.iter().map(|sized| (sized.value - best.value).exp()).sum::<f64>().ln();
                log_sum = marginal + best.value - best.prior + priors.iter().sum::<f64>() + breadth;
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

/// Score and information of some columns.
struct Columns {
    score: DVector<f64>,
    information: DMatrix<f64>,
}

/// A usual size of an effect's amplitudes: of all of them alike, or of one alone.
struct Sized {
    scale: f64,
    only: Option<usize>,
    /// ln of its prior.
    prior: f64,
    /// ln BF and that prior.
    value: f64,
}

impl Sized {
    /// Usual size of the amplitude at this place.
    fn size(&self, at: usize) -> f64 {
        if self.only.is_none_or(|only| only == at) { self.scale } else { 0.0 }
    }
}

impl Columns {
    /// Some of the columns with others of usual sizes integrated out, and ln BF of these; `None` where these are no numbers.
    fn given(&self, own: &[usize], others: &[usize], usual: &DVector<f64>) -> Option<(f64, Self)> {
        let score = |at: &[usize]| DVector::from_fn(at.len(), |i, _| self.score[at[i]]);
        let pick = |rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |i, j| self.information[(rows[i], columns[j])])
        };
        let acting: Vec<usize> = others.iter().copied().filter(|at| usual[*at] > 0.0).collect();
        let mut scaled = pick(&acting, &acting);
        for (i, one) in acting.iter().enumerate() {
            for (j, other) in acting.iter().enumerate() {
                scaled[(i, j)] = usual[*one] * scaled[(i, j)] * usual[*other];
            }
            scaled[(i, i)] += 1.0;
        }
        let factor = scaled.cholesky()?;
        let sizes = DVector::from_fn(acting.len(), |i, _| usual[acting[i]]);
        let scaled_score = score(&acting).component_mul(&sizes);
        let solved = factor.solve(&scaled_score);
        let mut across = pick(&acting, own);
        across.row_iter_mut().zip(sizes.iter()).for_each(|(mut row, size)| row *= *size);
        let marginal = 0.5 * (scaled_score.dot(&solved) - factor.ln_determinant());
        let given = Self {
            score: score(own) - across.tr_mul(&solved),
            information: pick(own, own) - across.tr_mul(&factor.solve(&across)),
        };
        // Eigenvalues are sought for without an end in numbers that are none.
        given.information.iter().all(|value| value.is_finite()).then_some((marginal, given))
    }

    /// ln BF of each size that an effect of these columns may have.
    fn sized(&self) -> Vec<Sized> {
        let n = self.score.len();
        let alone = if n > 1 { ALONE } else { 0.0 };
        let own = self.information.clone().symmetric_eigen();
        let along = own.eigenvectors.tr_mul(&self.score);
        let mut sized = Vec::with_capacity(SCALES.len() * (n + 1));
        let mut add = |share: f64, only: Option<usize>, value: &dyn Fn(f64) -> f64| {
            let prior = (share / SCALES.len() as f64).ln();
            sized.extend(SCALES.map(|scale| Sized { scale, only, prior, value: prior + value(scale) }));
        };
        add(1.0 - alone, None, &|scale| {
            let each = own.eigenvalues.iter().zip(along.iter());
            each.map(|(information, score)| log_bayes_factor(*score, *information, scale)).sum()
        });
        for at in (0..n).filter(|_| n > 1) {
            let (score, information) = (self.score[at], self.information[(at, at)]);
            add(alone / n as f64, Some(at), &|scale| log_bayes_factor(score, information, scale));
        }
        sized
    }
}

/// ln BF of one column of this usual size.
fn log_bayes_factor(score: f64, information: f64, usual: f64) -> f64 {
    let (score, scaled) = (usual * score, 1.0 + usual * usual * information);
    if scaled > 0.0 { 0.5 * (score * score / scaled - scaled.ln()) } else { f64::NEG_INFINITY }
}

/// ln of the probability of the data and of the noise that they are weighed by, but for a constant: columns of the
/// baseline come first, then `groups` of columns, each an effect or what may stand for one.
pub fn log_evidence(
    normal: &Normal,
    noise: &Noise,
    baseline: usize,
    groups: &[Vec<usize>],
) -> Result<f64, DiagnosisError> {
    let first: Vec<usize> = (0..baseline).collect();
    let others: Vec<usize> = (baseline..normal.score.len()).collect();
    let projected = Projected::new(normal, &first, &others)?;
    let places: Vec<Vec<usize>> =
        groups.iter().map(|group| group.iter().map(|column| column - baseline).collect()).collect();
    let parts: Vec<&[usize]> = places.iter().map(Vec::as_slice).collect();
    let alone = Normal {
        information: normal.information.view((0, 0), (baseline, baseline)).into_owned(),
        score: normal.score.rows(0, baseline).into_owned(),
        ..normal.clone()
    };
    Ok(projected.log_bayes_factor(&parts) - 0.5 * reml_criterion(&alone) - noise.neg_log_prior())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn information_that_is_no_number_is_no_evidence() {
        let information = DMatrix::from_fn(3, 3, |i, j| if i + j == 3 { f64::NAN } else { 1.0 });
        let (score, before) = (DVector::repeat(3, 1.0), DVector::repeat(3, 1.0));
        let projected = Projected { score, information, before };
        assert_eq!(projected.log_bayes_factor(&[&[0, 1, 2]]), f64::NEG_INFINITY);
    }

    #[test]
    fn what_others_leave_and_the_others_are_as_evident_as_all_together() {
        let x = DMatrix::from_fn(12, 5, |i, j| (0.7 * (i * (j + 1)) as f64 + j as f64).sin());
        let all = Columns { score: DVector::from_fn(5, |i, _| 3.0 - i as f64), information: x.tr_mul(&x) };
        let usual = DVector::from_vec(vec![0.3, 0.0, 1.0, 0.3, 1.0]);
        let (marginal, given) = all.given(&[1, 4], &[0, 2, 3], &usual).unwrap();
        for sized in given.sized() {
            let mut sizes = usual.clone();
            (sizes[1], sizes[4]) = (sized.size(0), sized.size(1));
            let scales = DMatrix::from_diagonal(&sizes);
            let grown = DMatrix::identity(5, 5) + &scales * &all.information * &scales;
            let scaled = &scales * &all.score;
            let explained = scaled.dot(&(grown.clone().try_inverse().unwrap() * &scaled));
            let expected = 0.5 * (explained - grown.determinant().ln());
            assert!((marginal + sized.value - sized.prior - expected).abs() < 1e-9);
        }
    }
}

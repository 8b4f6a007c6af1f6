//! Sizes of the kinds of noise, from the Allan variances of one axis.
//!
//! ```text
//! σ² = A θ + e,   Cov(e) = V(θ)          θ: squared coefficients ≥ 0, A: [`Products::design`], V: [`Products::covariance`]
//! Aᵀ V(θ)⁻¹ (σ² − A θ) = 0               solved for θ by repeated generalised least squares; Cov(θ) = (Aᵀ V⁻¹ A)⁻¹
//! ```
//!
//! A coefficient that comes out negative is not there and is taken out, the least certain first. The variances of long
//! averages are few independent numbers and count accordingly; those of overlapping lengths repeat one another, which V
//! knows. The misfit is χ² = eᵀ V⁻¹ e. Source: quasi-likelihood, R. W. M. Wedderburn, Biometrika 61 (1974).
//!
//! A squared coefficient is spread as χ² of edf = 2 (θ/std θ)² degrees of freedom, as a variance is.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::{covariance::Products, process::Kind};

/// Rounds at most, and what one may still change, of a size.
const ROUNDS: usize = 50;
const SETTLED: f64 = 1e-7;
/// A misfit less probable than this is one.
pub(super) const MISFIT: f64 = 1e-3;

/// Sizes of some kinds of noise.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Kinds that are there.
    pub kinds: Vec<Kind>,
    /// Their squared coefficients, unit² in samples.
    pub sizes: DVector<f64>,
    /// Covariance of the sizes.
    pub covariance: DMatrix<f64>,
    /// χ² of what is left.
    pub misfit: f64,
    /// Variances less coefficients.
    pub freedom: usize,
    /// ln|V| + χ².
    pub deviance: f64,
}

impl Fit {
    /// Probability of so large a misfit by chance.
    pub fn chance(&self) -> f64 {
        chance(self.misfit, self.freedom)
    }

    /// A kind's squared coefficient and its standard error; `None` where it is not there.
    pub fn of(&self, kind: Kind) -> Option<(f64, f64)> {
        let at = self.kinds.iter().position(|known| *known == kind)?;
        Some((self.sizes[at], self.covariance[(at, at)].max(0.0).sqrt()))
    }

    /// Every size of `kinds`, 0 where it is not there.
    pub fn sizes_of(&self, kinds: &[Kind]) -> DVector<f64> {
        let size = |kind: &Kind| self.of(*kind).map_or(0.0, |(size, _)| size);
        DVector::from_iterator(kinds.len(), kinds.iter().map(size))
    }
}

/// Fits the kinds of `products` that are there to variances from the `first` length on; `None` where none is there.
pub fn fit(products: &Products, variances: &[f64], first: usize, among: &[Kind]) -> Option<Fit> {
    let problem = Problem { products, variances: DVector::from_column_slice(&variances[first..]), first };
    let mut active: Vec<usize> =
        (0..products.kinds().len()).filter(|at| among.contains(&products.kinds()[*at])).collect();
    loop {
        if active.is_empty() || active.len() >= problem.variances.len() {
            return None;
        }
        let solved = problem.solve(&active)?;
        let ratio = |(at, size): (usize, &f64)| (at, size / solved.covariance[(at, at)].sqrt());
        let negative = solved.sizes.iter().enumerate().map(ratio).filter(|(_, ratio)| *ratio <= 0.0);
        let Some((worst, _)) = negative.min_by(|a, b| a.1.total_cmp(&b.1)) else {
            return Some(solved);
        };
        active.remove(worst);
    }
}

/// The standard error of a kind in a fit from the `first` length on if its size were this, and that of the others as in `fit`.
pub fn error_at(products: &Products, fit: &Fit, first: usize, kind: Kind, size: f64) -> Option<f64> {
    let kinds = products.kinds();
    let all = products.design();
    let rows = all.nrows() - first;
    let columns: Vec<usize> =
        (0..kinds.len()).filter(|at| kinds[*at] == kind || fit.of(kinds[*at]).is_some()).collect();
    let design = DMatrix::from_fn(rows, columns.len(), |row, at| all[(first + row, columns[at])]);
    let mut sizes = fit.sizes_of(kinds);
    sizes[kinds.iter().position(|other| *other == kind)?] = size;
    let covariance = products.covariance(&sizes);
    let factor = covariance.view((first, first), (rows, rows)).into_owned().cholesky()?;
    let (_, covariance) = generalised(&design, &factor, &DVector::zeros(rows))?;
    let own = columns.iter().position(|at| kinds[*at] == kind)?;
    Some(covariance[(own, own)].max(0.0).sqrt())
}

struct Problem<'a> {
    products: &'a Products,
    variances: DVector<f64>,
    first: usize,
}

impl Problem<'_> {
    fn solve(&self, active: &[usize]) -> Option<Fit> {
        let rows = self.variances.len();
        let all = self.products.design();
        let design = DMatrix::from_fn(rows, active.len(), |row, at| all[(self.first + row, active[at])]);
        let mut sizes = self.start(&design)?;
        for _ in 0..ROUNDS {
            let factor = self.factor(active, &sizes)?;
            let (next, _) = generalised(&design, &factor, &self.variances)?;
            let change = (&next - &sizes).component_div(&next.map(|x| x.abs().max(f64::MIN_POSITIVE))).amax();
            // Half-way, where sizes swing about their limit.
            sizes = (sizes + next) * 0.5;
            if change < SETTLED {
                break;
            }
        }
        let factor = self.factor(active, &sizes)?;
        let (sizes, covariance) = generalised(&design, &factor, &self.variances)?;
        let misfit = misfit(&design, &factor, &self.variances, &sizes);
        let kinds = active.iter().map(|at| self.products.kinds()[*at]).collect();
        let deviance = factor.ln_determinant() + misfit;
        Some(Fit { kinds, sizes, covariance, misfit, freedom: rows - active.len(), deviance })
    }

    /// As if the variances were independent, each as uncertain as it is large.
    fn start(&self, design: &DMatrix<f64>) -> Option<DVector<f64>> {
        let inverse = self.variances.map(|variance| 1.0 / variance);
        let mut weighted = design.clone();
        weighted.column_iter_mut().for_each(|mut column| column.component_mul_assign(&inverse));
        let scales: Vec<f64> = weighted.column_iter().map(|column| 1.0 / column.norm()).collect();
        weighted.column_iter_mut().zip(&scales).for_each(|(mut column, scale)| column *= *scale);
        let ones = DVector::from_element(self.variances.len(), 1.0);
        let normal = weighted.tr_mul(&weighted);
        let found = normal.cholesky()?.solve(&weighted.tr_mul(&ones));
        // None begins at nothing: V would hold it there.
        let least = 1e-3 * found.amax();
        Some(DVector::from_iterator(found.len(), found.iter().zip(&scales).map(|(x, s)| x.max(least) * s)))
    }

    fn factor(&self, active: &[usize], sizes: &DVector<f64>) -> Option<Cholesky<f64, Dyn>> {
        let mut whole = DVector::zeros(self.products.kinds().len());
        active.iter().zip(sizes.iter()).for_each(|(at, size)| whole[*at] = size.max(0.0));
        let covariance = self.products.covariance(&whole);
        let rows = self.variances.len();
        covariance.view((self.first, self.first), (rows, rows)).into_owned().cholesky()
    }
}

/// Coefficients of the columns of a design and their covariance, by the weights of a factor of V.
pub(super) fn generalised(
    design: &DMatrix<f64>,
    factor: &Cholesky<f64, Dyn>,
    variances: &DVector<f64>,
) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let weighted = factor.solve(design);
    // Sizes of unlike units: scaled to ones on the diagonal.
    let normal = design.tr_mul(&weighted);
    let scales = normal.diagonal().map(|x| 1.0 / x.sqrt());
    let scaled = |matrix: &DMatrix<f64>| {
        DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] * scales[i] * scales[j])
    };
    let covariance = scaled(&scaled(&normal).try_inverse()?);
    let sizes = &covariance * weighted.tr_mul(variances);
    Some((sizes, covariance))
}

/// eᵀ V⁻¹ e.
pub(super) fn misfit(
    design: &DMatrix<f64>,
    factor: &Cholesky<f64, Dyn>,
    variances: &DVector<f64>,
    sizes: &DVector<f64>,
) -> f64 {
    let left = variances - design * sizes;
    left.dot(&factor.solve(&left))
}

/// Probability of so large a χ².
pub(super) fn chance(misfit: f64, freedom: usize) -> f64 {
    ChiSquared::new(freedom.max(1) as f64).map_or(0.0, |chi| chi.sf(misfit))
}

/// By how much standard errors are too small: the root of a misfit that is no chance.
pub(super) fn inflation(misfit: f64, freedom: usize) -> f64 {
    let of_misfit = || (misfit / freedom.max(1) as f64).sqrt().max(1.0);
    if chance(misfit, freedom) >= MISFIT { 1.0 } else { of_misfit() }
}

/// 95 % interval of a squared coefficient with so many equivalent degrees of freedom.
pub fn interval(size: f64, freedom: f64) -> (f64, f64) {
    let quantile = |share| ChiSquared::new(freedom).map_or(f64::NAN, |chi| chi.inverse_cdf(share));
    (size * freedom / quantile(0.975), size * freedom / quantile(0.025))
}

/// Equivalent degrees of freedom of a size that has this standard error.
pub fn freedom(size: f64, error: f64) -> f64 {
    2.0 * (size / error).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::allan::drawn::{Drawn, cascade};

    fn fitted(drawn: Drawn, among: &[Kind]) -> Fit {
        let points = cascade(20_000, drawn, 7).points();
        let points: Vec<_> = points.into_iter().filter(|point| point.samples <= 5000).collect();
        let lengths = points.iter().map(|point| (point.samples as f64, point.span)).collect();
        let variances: Vec<f64> = points.iter().map(|point| point.variance.x).collect();
        fit(&Products::new(among.to_vec(), lengths), &variances, 0, among).unwrap()
    }

    #[test]
    fn what_was_drawn_is_found_within_its_errors_and_the_misfit_is_chance() {
        let all = [Kind::Quantisation, Kind::White, Kind::Flicker, Kind::Walk];
        let drawn = Drawn { quantisation: 2.0, white: 1.0, flicker: 0.0, walk: 0.02, ..Drawn::default() };
        let found = fitted(drawn, &all);
        for (kind, truth) in [(Kind::Quantisation, 4.0), (Kind::White, 1.0), (Kind::Walk, 4e-4)] {
            let (size, error) = found.of(kind).unwrap();
            assert!((size - truth).abs() < 3.0 * error && error < 0.4 * truth, "{kind:?} {size} {error}");
        }
        assert!(found.chance() > 0.01, "{found:?}");
    }

    #[test]
    fn a_kind_that_is_missing_shows_as_misfit() {
        let drawn = Drawn { white: 1.0, walk: 0.05, ..Drawn::default() };
        assert!(fitted(drawn, &[Kind::White]).chance() < 1e-9);
    }

    #[test]
    fn intervals_are_those_of_a_variance_with_as_many_degrees_of_freedom() {
        // χ² of 10 degrees of freedom: 3.247 and 20.483.
        let (low, high) = interval(1.0, 10.0);
        assert!((low - 10.0 / 20.483).abs() < 1e-4 && (high - 10.0 / 3.247).abs() < 1e-3, "{low} {high}");
        assert_eq!(freedom(3.0, 1.0), 18.0);
    }
}

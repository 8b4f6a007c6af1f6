//! The rows of a model, kept: for residuals by observation, influence and held-out errors.

use std::ops::Range;

use imucal_core::{
    model::{Model, RowSink},
    solver::{LevenbergMarquardt, condition::weakest_direction, triangular::Triangular},
};
use nalgebra::{DMatrix, SMatrix, SVector};

/// Residuals and derivatives in the model's order.
#[derive(Clone, Debug)]
pub struct Rows<const P: usize> {
    /// Residuals.
    pub residuals: Vec<f64>,
    /// Their derivatives by the parameters.
    pub jacobian: Vec<SVector<f64, P>>,
}

impl<const P: usize> Rows<P> {
    /// All rows of a model.
    pub fn of(model: &impl Model<f64, P>, theta: &SVector<f64, P>) -> Self {
        let mut rows = Self { residuals: Vec::new(), jacobian: Vec::new() };
        model.rows(theta, &mut rows);
        rows
    }

    /// The Gauss–Newton step; `None` where the rows do not determine it.
    pub fn step(&self) -> Option<SVector<f64, P>> {
        self.factor(0..0).damped_step(0.0, &SVector::repeat(0.0))
    }

    /// The factor of all rows but some.
    pub(super) fn factor(&self, left_out: Range<usize>) -> Triangular<f64, P> {
        let mut factor = Triangular::default();
        for (k, (residual, jacobian)) in self.residuals.iter().zip(&self.jacobian).enumerate() {
            if !left_out.contains(&k) {
                factor.push(*residual, jacobian);
            }
        }
        factor
    }

    /// The derivatives of the first `count` rows by the parameters in `free`.
    pub fn derivatives(&self, count: usize, free: &[usize]) -> DMatrix<f64> {
        DMatrix::from_fn(count, free.len(), |row, k| self.jacobian[row][free[k]])
    }
}

/// The standard error along the weakest direction of a fit over its classical one, all else held:
/// √(uᵀ C₀⁻¹ u / uᵀ C⁻¹ u); 1 where a covariance is singular.
pub fn weakest_inflation<const P: usize>(
    solver: &LevenbergMarquardt<f64, P>,
    covariance: &SMatrix<f64, P, P>,
) -> f64 {
    let along = |covariance: &SMatrix<f64, P, P>, unit: &SVector<f64, P>| {
        // Entries of different units would spoil the inverse.
        let std = covariance.diagonal().map(f64::sqrt);
        let correlation = SMatrix::<f64, P, P>::from_fn(|i, j| covariance[(i, j)] / (std[i] * std[j]));
        let unit = unit.component_div(&std);
        Some(unit.dot(&nalgebra::Cholesky::new(correlation)?.solve(&unit)))
    };
    let inflation = || {
        let unit = weakest_direction(solver.factor().r())?;
        Some((along(&solver.covariance()?, &unit)? / along(covariance, &unit)?).sqrt())
    };
    inflation().filter(|inflation| inflation.is_finite()).unwrap_or(1.0)
}

/// Rows that are multiplied at a time: few enough to stay in a processor's cache.
const PART: usize = 512;

/// So many rows by parts.
pub(super) fn parts(rows: usize) -> impl Iterator<Item = Range<usize>> {
    (0..rows).step_by(PART).map(move |from| from..(from + PART).min(rows))
}

/// J (JᵀJ)⁻¹: by how much each residual moves each parameter of a fit of least squares. `None` where J is not of full
/// rank.
pub fn influence(jacobian: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    Some(jacobian * inverse(jacobian)?)
}

/// (JᵀJ)⁻¹; `None` where J is not of full rank.
pub(super) fn inverse(jacobian: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let count = jacobian.ncols();
    let mut products = DMatrix::zeros(count, count);
    for part in parts(jacobian.nrows()) {
        let own = jacobian.rows(part.start, part.len());
        products += own.tr_mul(&own);
    }
    inverse_of(&products)
}

/// The inverse of JᵀJ; `None` where J is not of full rank.
pub(super) fn inverse_of(products: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let count = products.ncols();
    // Columns at unit length: parameters of different units would spoil the inverse.
    let length = products.diagonal().map(f64::sqrt);
    let scaled = |matrix: &DMatrix<f64>| {
        DMatrix::from_fn(count, count, |i, j| matrix[(i, j)] / (length[i] * length[j]))
    };
    Some(scaled(&scaled(products).try_inverse()?))
}

impl<const P: usize> RowSink<f64, P> for Rows<P> {
    const JACOBIAN: bool = true;

    fn row(&mut self, residual: f64, jacobian: &SVector<f64, P>) {
        self.residuals.push(residual);
        self.jacobian.push(*jacobian);
    }
}

/// Residuals of a model without derivatives.
#[derive(Clone, Debug, Default)]
pub struct Residuals(pub Vec<f64>);

impl Residuals {
    /// All residuals of a model.
    pub fn of<const P: usize>(model: &impl Model<f64, P>, theta: &SVector<f64, P>) -> Vec<f64> {
        let mut residuals = Self::default();
        model.rows(theta, &mut residuals);
        residuals.0
    }
}

impl<const P: usize> RowSink<f64, P> for Residuals {
    const JACOBIAN: bool = false;

    fn row(&mut self, residual: f64, _: &SVector<f64, P>) {
        self.0.push(residual);
    }
}

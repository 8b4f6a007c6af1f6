//! Rows of correlated observations made independent.

use nalgebra::{Cholesky, DMatrix};

/// Factor of the observations' covariance, V = L Lᵀ, the same for each axis.
#[derive(Clone, Debug)]
pub struct Whitening {
    lower: DMatrix<f64>,
}

impl Whitening {
    /// Of a covariance; `None` where it is none.
    pub fn new(covariance: DMatrix<f64>) -> Option<Self> {
        Some(Self { lower: Cholesky::new(covariance)?.l() })
    }

    /// Logarithm of the covariance's determinant.
    pub fn log_determinant(&self) -> f64 {
        2.0 * self.lower.diagonal().iter().map(|d| d.ln()).sum::<f64>()
    }

    /// L⁻¹ of each axis's rows: rows of unit variance. Three rows an observation.
    pub fn whiten(&self, rows: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let count = self.lower.nrows();
        let mut white = rows.clone();
        for axis in 0..3 {
            let own = rows.rows_with_step(axis, count, 2).into_owned();
            white.rows_with_step_mut(axis, count, 2).copy_from(&self.lower.solve_lower_triangular(&own)?);
        }
        Some(white)
    }
}

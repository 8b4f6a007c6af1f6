//! Rows of correlated observations made independent.

use nalgebra::{Cholesky, DMatrix, Vector3};

/// Factor of the observations' covariance, V = scale² L Lᵀ: L of all axes, a scale for each.
#[derive(Clone, Debug)]
pub struct Whitening {
    lower: DMatrix<f64>,
    scale: Vector3<f64>,
}

impl Whitening {
    /// Of L Lᵀ; `None` where that is no covariance.
    pub fn new(covariance: DMatrix<f64>, scale: Vector3<f64>) -> Option<Self> {
        Some(Self { lower: Cholesky::new(covariance)?.l(), scale })
    }

    /// Logarithm of the determinant of all axes' covariance.
    pub fn log_determinant(&self) -> f64 {
        let of_one = self.lower.diagonal().iter().map(|d| d.ln()).sum::<f64>();
        6.0 * of_one + 2.0 * self.lower.nrows() as f64 * self.scale.iter().map(|s| s.ln()).sum::<f64>()
    }

    /// Rows of unit variance from three rows an observation.
    pub fn whiten(&self, rows: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let count = self.lower.nrows();
        let mut white = rows.clone();
        for axis in 0..3 {
            let own = rows.rows_with_step(axis, count, 2) / self.scale[axis];
            white.rows_with_step_mut(axis, count, 2).copy_from(&self.lower.solve_lower_triangular(&own)?);
        }
        Some(white)
    }
}

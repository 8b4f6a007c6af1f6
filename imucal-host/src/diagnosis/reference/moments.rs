//! Second moments of samples and of what they were given: y ≈ K v + b by linear least squares.

use nalgebra::{Matrix3, Vector3};

/// Directions in which the input varies less than this share of the largest do not count.
const FLAT: f64 = 1e-6;

/// Second moments of samples and inputs about their means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Moments {
    /// Rows.
    pub rows: f64,
    /// Σ (y − ȳ)(v − v̄)ᵀ
    pub cross: Matrix3<f64>,
    /// Σ |y − ȳ|²
    pub output: f64,
    /// Σ (v − v̄)(v − v̄)ᵀ
    pub input: Matrix3<f64>,
}

/// Means of samples and inputs; zero without any.
pub(crate) fn means(pairs: &[(Vector3<f64>, Vector3<f64>)]) -> (Vector3<f64>, Vector3<f64>) {
    let zero = (Vector3::zeros(), Vector3::zeros());
    let sum = pairs.iter().fold(zero, |(y, v), pair| (y + pair.0, v + pair.1));
    let rows = pairs.len().max(1) as f64;
    (sum.0 / rows, sum.1 / rows)
}

impl Moments {
    /// Of samples, each with its input.
    pub(crate) fn of(pairs: &[(Vector3<f64>, Vector3<f64>)]) -> Self {
        let (y, v) = means(pairs);
        let rows = pairs.len() as f64;
        let mut moments = Self { rows, cross: Matrix3::zeros(), output: 0.0, input: Matrix3::zeros() };
        for (own_y, own_v) in pairs {
            let (y, v) = (own_y - y, own_v - v);
            moments.cross += y * v.transpose();
            moments.output += y.norm_squared();
            moments.input += v * v.transpose();
        }
        moments
    }

    /// K; zero along inputs that do not vary.
    pub(crate) fn sensitivity(&self) -> Matrix3<f64> {
        let largest = self.input.symmetric_eigenvalues().max();
        self.input
            .pseudo_inverse(FLAT * largest)
            .map_or_else(|_| Matrix3::zeros(), |inverse| self.cross * inverse)
    }

    /// Share of the samples' variance that K does not explain; 1 where nothing varies.
    pub(crate) fn unexplained(&self) -> f64 {
        let explained = (self.sensitivity() * self.cross.transpose()).trace();
        if self.output > 0.0 { (1.0 - explained / self.output).max(0.0) } else { 1.0 }
    }
}

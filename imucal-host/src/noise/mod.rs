//! Noise of observations: white, scatter from one to the next, drift. The linear mixed model that calibration and diagnosis
//! weigh their observations by, and the parameters that calibration gives it.
//!
//! ```text
//! V_ij = S ( w δ_ij / T_i + d F_ij )       each axis on its own, S its white noise
//! ```
//!
//! | symbol | meaning | unit |
//! | --- | --- | --- |
//! | S | density of the white noise within rests ([`white`]) | unit²·s |
//! | T_i | length of observation i | s |
//! | w | 1 for white noise alone; above it what differs from one observation to the next, as stops that scatter | – |
//! | d | variance of the drift over S; its inverse is the time over which white noise averages to the drift's size | 1/s |
//! | F | covariance of unit flicker between the observations' means ([`flicker`]) | – |
//!
//! S is measured within rests, w and d from residuals ([`estimate`]).
//!
//! | file | what |
//! | --- | --- |
//! | [`process`], [`knots`] | a drift: a Gauss–Markov process, and where its values are estimated |
//! | [`skyline`], [`sparse_rows`], [`symmetric_product`] | matrices that are banded, have few entries a row, or are symmetric |
//! | [`random_effects`], [`precision`] | what observations share, and their inverse covariance with that eliminated, in the order of time; cost and memory linear in length |
//! | [`flicker`] | processes whose sum is 1/f noise |
//! | [`restricted`] | the restricted likelihood |
//! | [`white`], [`within`] | white noise of samples, and drift within rests |
//! | [`estimate`] | w and d from residuals |
//! | [`blocked_cholesky`] | factor of a dense covariance |
//! | [`interval`] | standard errors whose ±1.96 hold 95 % |
//! | [`semiseparable`] | covariance of means over spans, whitened in the order of time |
//! | [`state_space`] | covariance of rows that share such means, and other errors, whitened by a Kalman filter |
//!
//! Not modelled: axes that err alike, scatter whose size or direction depends on the pose, an error that repeats when a
//! pose comes back.

use std::ops::Range;

use nalgebra::{DMatrix, Vector3};

pub mod process;

pub mod knots;

pub mod skyline;

pub mod sparse_rows;

pub mod symmetric_product;

pub mod random_effects;

pub mod precision;

pub mod flicker;

pub mod restricted;

pub mod white;

pub mod within;

pub mod estimate;

pub mod blocked_cholesky;

pub mod interval;

pub mod semiseparable;

pub mod state_space;

pub use estimate::Residuals;

/// When an observation was made, s.
pub type Span = Range<f64>;

/// Noise of a triad's observations.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// S of each axis, unit²·s.
    pub density: Vector3<f64>,
    /// w.
    pub white: f64,
    /// d, 1/s.
    pub drift: f64,
}

impl Noise {
    /// The drift alone.
    #[must_use]
    pub fn without_white(&self) -> Self {
        Self { white: 0.0, ..self.clone() }
    }

    /// Variance of the drift of each axis, unit².
    pub fn drift_variance(&self) -> Vector3<f64> {
        self.density * self.drift
    }

    /// V/S of observations that do not overlap.
    pub fn covariance(&self, spans: &[Span]) -> DMatrix<f64> {
        let mut covariance = flicker::covariance_of(spans, &flicker::processes(spans, self.drift));
        for (k, span) in spans.iter().enumerate() {
            covariance[(k, k)] += self.white / (span.end - span.start);
        }
        covariance
    }

    /// Aᵀ (V/S) A of observations in time order that do not overlap; A has a row for each.
    pub fn carried(&self, spans: &[Span], influence: &DMatrix<f64>) -> DMatrix<f64> {
        let mut sum = DMatrix::zeros(influence.ncols(), influence.ncols());
        for (span, row) in spans.iter().zip(influence.row_iter()) {
            sum.ger(self.white / (span.end - span.start), &row.transpose(), &row.transpose(), 1.0);
        }
        for process in flicker::processes(spans, self.drift) {
            sum += process.carried(spans, influence);
        }
        sum
    }

    /// Covariance of what follows linearly from the observations: `influence` has three rows for each, and a column
    /// for each result.
    pub fn propagated(&self, spans: &[Span], influence: &DMatrix<f64>) -> DMatrix<f64> {
        let mut sum = DMatrix::zeros(influence.ncols(), influence.ncols());
        for axis in 0..3 {
            let own = influence.rows_with_step(axis, spans.len(), 2).into_owned();
            sum += self.carried(spans, &own) * self.density[axis];
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_covariance_of_observations_is_what_they_carry_one_by_one() {
        let spans = [0.0..4.0, 4.0..9.0, 12.0..52.0, 52.5..53.0];
        let noise = Noise { density: Vector3::repeat(1.0), white: 0.3, drift: 0.02 };
        let carried = noise.carried(&spans, &DMatrix::identity(4, 4));
        assert!((noise.covariance(&spans) - carried).amax() < 1e-12);
    }
}

//! Noise of observations that are means over stretches of time: white, scatter from one to the next, drift.
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
//! S is measured within rests, w and d from residuals ([`estimate`]). Not modelled: axes that err alike, scatter whose
//! size or direction depends on the pose, an error that repeats when a pose comes back.

use std::ops::Range;

use nalgebra::{DMatrix, Vector3};

pub mod estimate;
pub mod flicker;
pub mod interval;
mod restricted;
pub mod white;
pub mod whitening;
pub mod within;

pub use estimate::Residuals;
pub use whitening::Whitening;

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

    /// V / S, the same for each axis, of observations in time order that do not overlap.
    pub fn relative_covariance(&self, spans: &[Span]) -> DMatrix<f64> {
        let mut covariance = flicker::covariance(spans) * self.drift;
        for (k, span) in spans.iter().enumerate() {
            covariance[(k, k)] += self.white / (span.end - span.start);
        }
        covariance
    }

    /// What makes three rows an observation independent and of unit variance; `None` where a span has no length.
    pub fn whitening(&self, spans: &[Span]) -> Option<Whitening> {
        Whitening::new(self.relative_covariance(spans), self.density.map(f64::sqrt))
    }

    /// Covariance of what follows linearly from the observations: `influence` has three rows for each, and a column
    /// for each result.
    pub fn propagated(&self, spans: &[Span], influence: &DMatrix<f64>) -> DMatrix<f64> {
        let covariance = self.relative_covariance(spans);
        let mut sum = DMatrix::zeros(influence.ncols(), influence.ncols());
        for axis in 0..3 {
            let own = influence.rows_with_step(axis, spans.len(), 2);
            sum += own.transpose() * &covariance * own * self.density[axis];
        }
        sum
    }
}

//! Covariance of the means of rests: white noise, a converter's steps, and drift that rests share.
//!
//! ```text
//! V₀ = diag(Σ_a n_a² (S_a / T + q_a)),   V₁ = (Σ_a n_a n'_a S_a) F
//! ```
//!
//! of one component of each mean along n, or of all three. Symbols as in [`super::shell_errors`].

use nalgebra::{DMatrix, DVector, Vector3};

use super::rest_noise::RestNoise;
use crate::noise::{
    Noise, Span, flicker,
    interval::{Errors, Parts, Scale},
    semiseparable::{Mean, Semiseparable},
};

/// V₀ and V₁ of some rests, and what is known of the drift.
#[derive(Clone, Debug)]
pub struct RestCovariance {
    noise: Semiseparable,
    ratios: Vec<(f64, f64)>,
    five: bool,
    density: Vector3<f64>,
    shown: Vector3<f64>,
}

impl RestCovariance {
    /// Of one component each, along these unit vectors; `None` where an axis shows no noise.
    pub fn along(shown: &RestNoise, used: &[usize], normals: &[Vector3<f64>]) -> Option<Self> {
        Self::of(shown, used, &[normals.iter().copied().enumerate().collect()])
    }

    /// Of all three components of each, in order; `None` where an axis shows no noise.
    pub fn of_vectors(shown: &RestNoise, used: &[usize]) -> Option<Self> {
        // Axes are independent.
        let along = |axis: usize| (0..used.len()).map(move |k| (3 * k + axis, Vector3::ith(axis, 1.0)));
        Self::of(shown, used, &[0, 1, 2].map(|axis| along(axis).collect()))
    }

    /// Of chains of components of the means, each in the order of the rests used, with the row that it is in.
    fn of(shown: &RestNoise, used: &[usize], chains: &[Vec<(usize, Vector3<f64>)>]) -> Option<Self> {
        let spans: Vec<Span> = used.iter().map(|k| shown.spans[*k].clone()).collect();
        let length = |k: usize| spans[k].end - spans[k].start;
        let own = |k: usize| shown.density / length(k) + shown.steps[used[k]];
        // Steps as white noise: what differs from one mean to the next.
        let count = used.len();
        let density = (0..count).map(|k| own(k) * length(k)).sum::<Vector3<f64>>() / count as f64;
        if density.iter().any(|axis| axis.is_nan() || *axis <= 0.0) {
            return None;
        }
        let root = shown.density.map(f64::sqrt);
        let mean = |(k, (row, normal)): (usize, &(usize, Vector3<f64>))| Mean {
            row: *row,
            span: spans[k].clone(),
            white: normal.component_mul(normal).dot(&own(k)),
            drifts: normal.component_mul(&root),
        };
        let chains = chains.iter().map(|chain| chain.iter().enumerate().map(mean).collect());
        let noise = Semiseparable::new(chains.collect(), flicker::processes(&spans, 1.0));
        let ratios = shown.drifts(&spans);
        let five = !shown.within.is_empty();
        Some(Self { noise, ratios, five, density, shown: shown.density })
    }

    /// Errors of what follows from the components by `influence`; see [`Parts::errors`].
    pub fn errors(
        &self,
        residuals: &DVector<f64>,
        jacobian: &DMatrix<f64>,
        influence: &DMatrix<f64>,
    ) -> Option<Errors> {
        let parts =
            Parts { parts: &self.noise, ratios: &self.ratios, scale: Scale::AtLeastOne, five: self.five };
        parts.errors(residuals, jacobian, influence)
    }

    /// Noise of the means, as errors found it.
    pub fn of_means(&self, errors: &Errors) -> Noise {
        Noise {
            density: self.density,
            white: errors.scale,
            drift: errors.scale * errors.ratio * self.shown.mean() / self.density.mean(),
        }
    }
}

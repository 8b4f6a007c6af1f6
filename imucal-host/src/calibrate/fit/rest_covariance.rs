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
};

/// V₀ and V₁ of some rests, and what is known of the drift.
#[derive(Clone, Debug)]
pub struct RestCovariance {
    white: DMatrix<f64>,
    drift: DMatrix<f64>,
    ratios: Vec<(f64, f64)>,
    five: bool,
    density: Vector3<f64>,
    shown: Vector3<f64>,
}

impl RestCovariance {
    /// Of one component each, along these unit vectors; `None` where an axis shows no noise.
    pub fn along(shown: &RestNoise, used: &[usize], normals: &[Vector3<f64>]) -> Option<Self> {
        let components: Vec<(usize, Vector3<f64>)> =
            normals.iter().enumerate().map(|(k, normal)| (k, *normal)).collect();
        Self::of(shown, used, &components)
    }

    /// Of all three components of each, in order; `None` where an axis shows no noise.
    pub fn of_vectors(shown: &RestNoise, used: &[usize]) -> Option<Self> {
        let axes = |k: usize| (0..3).map(move |axis| (k, Vector3::ith(axis, 1.0)));
        let components: Vec<(usize, Vector3<f64>)> = (0..used.len()).flat_map(axes).collect();
        Self::of(shown, used, &components)
    }

    /// Of components of the means, by the position of the rest among those used.
    fn of(shown: &RestNoise, used: &[usize], components: &[(usize, Vector3<f64>)]) -> Option<Self> {
        let spans: Vec<Span> = used.iter().map(|k| shown.spans[*k].clone()).collect();
        let length = |k: usize| spans[k].end - spans[k].start;
        let own = |k: usize| shown.density / length(k) + shown.steps[used[k]];
        // Steps as white noise: what differs from one mean to the next.
        let count = used.len();
        let density = (0..count).map(|k| own(k) * length(k)).sum::<Vector3<f64>>() / count as f64;
        if density.iter().any(|axis| axis.is_nan() || *axis <= 0.0) {
            return None;
        }
        let between = flicker::covariance_of(&spans, &flicker::processes(&spans, 1.0));
        let alike =
            |i: usize, j: usize, of: &Vector3<f64>| components[i].1.component_mul(&components[j].1).dot(of);
        let rows = components.len();
        let white = DMatrix::from_fn(rows, rows, |i, j| {
            if components[i].0 == components[j].0 { alike(i, j, &own(components[i].0)) } else { 0.0 }
        });
        let drift = DMatrix::from_fn(rows, rows, |i, j| {
            between[(components[i].0, components[j].0)] * alike(i, j, &shown.density)
        });
        let ratios = shown.drifts(&spans);
        let five = !shown.within.is_empty();
        Some(Self { white, drift, ratios, five, density, shown: shown.density })
    }

    /// Errors of what follows from the components by `influence`; see [`Parts::errors`].
    pub fn errors(
        &self,
        residuals: &DVector<f64>,
        jacobian: &DMatrix<f64>,
        influence: &DMatrix<f64>,
    ) -> Option<Errors> {
        let parts = Parts {
            parts: [&self.white, &self.drift],
            ratios: &self.ratios,
            scale: Scale::AtLeastOne,
            five: self.five,
        };
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

//! Our geometric fit: distance from the ellipsoid in raw units, less what noise alone makes of it on a curved
//! surface.
//!
//! ```text
//! r = (|A(m − b)| − F) / |Aᵀu| − e(σ²),   σ² from the residuals of the round before
//! ```
//!
//! The residual and its source: [`imucal_core::model::norm`]. It is the fit of a calibration by the field form,
//! without its care for outliers. Estimated noise, so that nothing but the points is needed.

use imucal_core::{
    model::{
        norm::{NormModel, curvature_excess},
        parameterisation::UPPER_TRIANGULAR,
    },
    observation::ShellPoint,
    solver::{LevenbergMarquardt, lm::Settings},
    triad::Triad,
};

use super::quadric::{self, Frame};

/// Rounds of expecting the noise's excess.
const ROUNDS: usize = 3;

/// Fits from a start; `None` where the points do not determine one quadric, or it does not converge to a
/// gain that can be inverted.
pub fn fit(points: &[ShellPoint<f64>], norm: f64, start: &Triad<f64>) -> Option<Triad<f64>> {
    quadric::factor(points, &Frame::of(points)?)?;
    let mut points = points.to_vec();
    let mut triad = *start;
    for _ in 0..ROUNDS {
        let mut solver = LevenbergMarquardt::new(UPPER_TRIANGULAR.theta(&triad), Settings::default());
        let report = solver.run(&NormModel { points: &points, norm, form: UPPER_TRIANGULAR });
        triad = UPPER_TRIANGULAR.triad(solver.theta());
        if !report.termination.was_successful() || !triad.is_finite() || triad.is_singular() {
            return None;
        }
        let variance = solver.variance().unwrap_or(0.0);
        for point in &mut points {
            point.excess = curvature_excess(&triad, norm, &point.value, variance);
        }
    }
    Some(triad)
}

#[cfg(test)]
mod tests {
    use super::super::quadric::tests::{assert_found, cap, circle};
    use super::*;
    use crate::ellipsoid::sphere;

    #[test]
    fn without_noise_the_ellipsoid_is_exact() {
        let points = cap(1.0, 300, 0.0);
        let start = sphere::start(&points, 475.0).unwrap();
        assert_found(&fit(&points, 475.0, &start).unwrap(), 1e-9);
    }

    #[test]
    fn no_points_and_points_in_a_plane_have_no_ellipsoid() {
        assert!(fit(&circle(), 1.0, &Triad::identity()).is_none());
        assert!(fit(&[], 1.0, &Triad::identity()).is_none());
    }
}

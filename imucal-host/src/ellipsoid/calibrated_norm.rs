//! The usual geometric fit: the calibrated length against the field's, by Levenberg–Marquardt.
//!
//! ```text
//! y = A (m − b),   r = |y| − F,   ∂r/∂A = u (m − b)ᵀ,   ∂r/∂b = −Aᵀu,   u = y/|y|
//! ```
//!
//! Source: Vasconcelos et al. 2011 and models.md 5. Kept for comparison: its residual is in calibrated units and
//! vanishes for A → 0, b → ∞ whatever was measured, which draws the centre away from the points.
//! [`super::distance`] does not.

use imucal_core::{
    model::{Model, RowSink, parameterisation::UPPER_TRIANGULAR},
    observation::ShellPoint,
    solver::{LevenbergMarquardt, lm::Settings},
    triad::Triad,
};
use nalgebra::{SVector, Vector3};

use super::quadric::{self, Frame};

/// Points whose calibrated length is to be `norm`; gain upper triangular.
struct CalibratedNorm<'a> {
    points: &'a [ShellPoint<f64>],
    norm: f64,
}

impl Model<f64, 9> for CalibratedNorm<'_> {
    fn rows<S: RowSink<f64, 9>>(&self, theta: &SVector<f64, 9>, sink: &mut S) {
        let triad = UPPER_TRIANGULAR.triad(theta);
        for point in self.points {
            let x = point.value - triad.bias;
            let y = triad.gain * x;
            let (length, mut all) = (y.norm(), SVector::<f64, 12>::zeros());
            let u: Vector3<f64> = y / length;
            for k in 0..9 {
                all[k] = u[k / 3] * x[k % 3];
            }
            all.fixed_rows_mut::<3>(9).copy_from(&-triad.gain.tr_mul(&u));
            sink.row(length - self.norm, &UPPER_TRIANGULAR.select(&all));
        }
    }

    fn independent_rows(&self) -> usize {
        self.points.len()
    }
}

/// Fits from a start; `None` where the points do not determine one quadric, or it does not converge to a
/// gain that can be inverted.
pub fn fit(points: &[ShellPoint<f64>], norm: f64, start: &Triad<f64>) -> Option<Triad<f64>> {
    quadric::factor(points, &Frame::of(points)?)?;
    let mut solver = LevenbergMarquardt::new(UPPER_TRIANGULAR.theta(start), Settings::default());
    let report = solver.run(&CalibratedNorm { points, norm });
    let triad = UPPER_TRIANGULAR.triad(solver.theta());
    (report.termination.was_successful() && triad.is_finite() && !triad.is_singular()).then_some(triad)
}

#[cfg(test)]
mod tests {
    use super::super::quadric::tests::{assert_found, cap, circle};
    use super::*;
    use crate::ellipsoid::sphere;
    use imucal_core::solver::jacobian_check::largest_jacobian_error;

    #[test]
    fn the_jacobian_is_the_numerical_one() {
        let points = cap(0.4, 30, 5.0);
        let theta = UPPER_TRIANGULAR.theta(&sphere::start(&points, 475.0).unwrap());
        assert!(largest_jacobian_error(&CalibratedNorm { points: &points, norm: 475.0 }, &theta) < 1e-6);
    }

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

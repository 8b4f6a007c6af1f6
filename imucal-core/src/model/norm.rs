//! The norm form: what is measured at rest, or in a constant field, has a known length.
//!
//! ```text
//! y = A (m − b),   u = y/|y|,   r = (|y| − F) / |Aᵀu| − e
//! ```
//!
//! | symbol | meaning | paper |
//! | --- | --- | --- |
//! | m | sensor output, nominal SI: a rest's mean, or one sample of a magnetometer | e_m |
//! | A, b | gain (upper triangular, or diagonal) and bias | K⁻¹, b |
//! | F | length of the measured vector: local gravity, or the field's magnitude | g, \|B\| |
//! | r | distance of m from the ellipsoid \|A(m − b)\| = F along its normal, to first order; raw unit | – |
//! | e | the distance expected from noise alone on a curved surface ([`curvature_excess`]) | – |
//!
//! Source: the field forms of models.md 2 (T9) and 4 (ellipsoid), there a reconstruction of Secer & Barshan 2016.
//! The division by |Aᵀu| is what keeps the fit bounded: the plain residual |y| − F vanishes for A → 0 with
//! b → ∞, whatever was measured; a distance in raw units does not.
//!
//! Not modelled: anything that moves the sensor's axes against its case (a norm is blind to rotation), pose-dependent
//! forces, fields that vary over the path.

use nalgebra::{Matrix3, SVector, Vector3};

use super::{Model, Parameterisation, RowSink, parameterisation::ENTRIES};
use crate::{observation::ShellPoint, scalar::Scalar, triad::Triad};

/// Points that calibration maps to a sphere of radius `norm`.
#[derive(Clone, Copy, Debug)]
pub struct NormModel<'a, T: Scalar, const P: usize> {
    /// The points, nominal SI.
    pub points: &'a [ShellPoint<T>],
    /// Radius F of the calibrated sphere, calibrated unit.
    pub norm: T,
    /// Entries of gain and bias that are estimated.
    pub form: Parameterisation<P>,
}

/// What a residual and its derivatives are made of at one point.
struct Shell<T: Scalar> {
    /// m − b.
    x: Vector3<T>,
    /// Unit vector along A x.
    u: Vector3<T>,
    /// |A x| − F.
    outside: T,
    /// 1/|Aᵀu|: raw unit per calibrated unit along the normal.
    per_slope: T,
    /// Unit normal of the shell in raw axes.
    normal: Vector3<T>,
    /// 1/|A x|.
    per_length: T,
}

impl<T: Scalar> Shell<T> {
    #[inline]
    fn at(triad: &Triad<T>, norm: T, point: &Vector3<T>) -> Self {
        let x = point - triad.bias;
        let y = triad.gain * x;
        let length = y.dot(&y).root();
        let per_length = T::one() / length;
        let u = y * per_length;
        let pulled = triad.gain.tr_mul(&u);
        let per_slope = T::one() / pulled.dot(&pulled).root();
        Self { x, u, outside: length - norm, per_slope, normal: pulled * per_slope, per_length }
    }

    /// Derivative of `outside · per_slope` by the gain's nine entries (rows) and the bias.
    #[inline]
    fn gradient(&self, gain: &Matrix3<T>) -> SVector<T, ENTRIES> {
        let per_slope = self.per_slope;
        let ratio = self.outside * per_slope * per_slope;
        let stretched = gain * self.normal;
        // How the slope changes as u turns: the part of A·normal across u, by |y|.
        let swing = (stretched - self.u * self.u.dot(&stretched)) * self.per_length;
        let by_y = self.u * per_slope - swing * ratio;
        let by_bias = -gain.tr_mul(&by_y);
        let curved = self.u * ratio;
        let [one, two, three] = [(by_y.x, curved.x), (by_y.y, curved.y), (by_y.z, curved.z)]
            .map(|(by_y, curved)| self.x * by_y - self.normal * curved);
        SVector::from([
            one.x, one.y, one.z, two.x, two.y, two.z, three.x, three.y, three.z, by_bias.x, by_bias.y,
            by_bias.z,
        ])
    }
}

impl<T: Scalar, const P: usize> Model<T, P> for NormModel<'_, T, P> {
    #[inline(never)]
    fn rows<S: RowSink<T, P>>(&self, theta: &SVector<T, P>, sink: &mut S) {
        let triad = self.form.triad(theta);
        for point in self.points {
            let shell = Shell::at(&triad, self.norm, &point.value);
            let residual = shell.outside * shell.per_slope - point.excess;
            let jacobian =
                if S::JACOBIAN { self.form.select(&shell.gradient(&triad.gain)) } else { SVector::zeros() };
            sink.row(residual, &jacobian);
        }
    }

    fn independent_rows(&self) -> usize {
        self.points.len()
    }
}

/// Expected distance outside the shell of a point with isotropic noise of `variance` (raw unit²) on each axis.
///
/// Half the variance times the sum of the principal curvatures, `(tr AᵀA − |A n|²) / (F |Aᵀu|)`: noise along the
/// tangent of a sphere of radius R leaves a point σ²/R outside on average. Leaving this out inflates the gain's
/// inverse, and shifts the centre where only a part of the sphere is covered. Second order in σ/R; source: the
/// classic expansion of a distance function, as in Kanatani 2008 (hyperaccurate correction).
pub fn curvature_excess<T: Scalar>(triad: &Triad<T>, norm: T, point: &Vector3<T>, variance: T) -> T {
    let shell = Shell::at(triad, norm, point);
    let trace = triad.gain.norm_squared();
    let along = (triad.gain * shell.normal).norm_squared();
    (trace - along) / norm * shell.per_slope * variance * T::of(0.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        model::parameterisation::{DIAGONAL, FULL, UPPER_TRIANGULAR},
        solver::jacobian_check::largest_jacobian_error,
    };
    use proptest::prelude::*;

    fn cloud(values: &[[f64; 3]]) -> std::vec::Vec<ShellPoint<f64>> {
        values.iter().map(|v| ShellPoint { value: Vector3::from(*v), excess: 0.01 }).collect()
    }

    proptest! {
        #[test]
        fn the_analytic_jacobian_is_the_numerical_one(
            points in prop::collection::vec(prop::array::uniform3(2.0f64..12.0), 1..4),
            signs in prop::array::uniform3(prop::sample::select(std::vec![-1.0f64, 1.0])),
            noise in prop::array::uniform12(-0.1f64..0.1),
        ) {
            let points = cloud(&points.iter().map(|p| [p[0] * signs[0], p[1] * signs[1], p[2] * signs[2]]).collect::<std::vec::Vec<_>>());
            let theta = FULL.theta(&Triad::identity()) + SVector::from(noise);
            let (full, upper, diagonal) = (
                NormModel { points: &points, norm: 9.8, form: FULL },
                NormModel { points: &points, norm: 9.8, form: UPPER_TRIANGULAR },
                NormModel { points: &points, norm: 9.8, form: DIAGONAL },
            );
            let triad = FULL.triad(&theta);
            prop_assert!(largest_jacobian_error(&full, &theta) < 1e-7);
            prop_assert!(largest_jacobian_error(&upper, &UPPER_TRIANGULAR.theta(&triad)) < 1e-7);
            prop_assert!(largest_jacobian_error(&diagonal, &DIAGONAL.theta(&triad)) < 1e-7);
        }
    }

    #[test]
    fn on_a_sphere_the_residual_is_the_exact_distance() {
        let points = cloud(&[[3.0, 4.0, 12.0]]);
        let model = NormModel { points: &points, norm: 2.0, form: UPPER_TRIANGULAR };
        let gain = Triad { gain: Matrix3::identity() * 0.25, bias: Vector3::zeros() };
        let mut sum = crate::model::SquaredSum(0.0);
        model.rows(&UPPER_TRIANGULAR.theta(&gain), &mut sum);
        // 13 from the centre of a sphere of radius 8, less the excess.
        assert!((sum.0 - 4.99f64.powi(2)).abs() < 1e-12);
    }

    #[test]
    fn the_curvature_excess_of_a_sphere_is_the_variance_over_its_radius() {
        let gain = Triad { gain: Matrix3::identity() * 0.5f64, bias: Vector3::zeros() };
        let excess = curvature_excess(&gain, 10.0, &Vector3::new(20.0, 0.0, 0.0), 0.04);
        assert!((excess - 0.04 / 20.0).abs() < 1e-15);
    }
}

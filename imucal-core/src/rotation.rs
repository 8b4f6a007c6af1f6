//! Rotations: the exponential map and its derivative, for vectors of a radian or so and of any size.
//!
//! Convention, once for the crate: `C_a_b` takes components from `a` to `b`, and a body that turns by the
//! rotation vector φ (components in the body) goes from `C_b_n` to `C_b_n · exp([φ]×)`.
//!
//! ```text
//! exp([φ]×) = I + a(φ²)[φ]× + b(φ²)[φ]×²        a = sin φ/φ, b = (1 − cos φ)/φ²
//! J_l(φ)    = I + b(φ²)[φ]× + c(φ²)[φ]×²        c = (φ − sin φ)/φ³
//! exp([φ + δ]×) ≈ exp([J_l(φ) δ]×) · exp([φ]×)
//! ```
//!
//! Below one radian the coefficients come from their power series (to φ¹⁶: the remainder is below 1e-15, see
//! `series_and_closed_form_agree`), above from libm. Source: Rodrigues' formula; the derivative as in Chirikjian,
//! *Stochastic Models, Information Theory, and Lie Groups*, vol. 2, ch. 10.

use nalgebra::{Matrix3, Vector3};

use crate::scalar::Scalar;

/// Series are used below this squared angle, rad².
const SERIES_LIMIT: f64 = 1.0;
/// Terms of each series there.
const TERMS: usize = 9;
/// Below this squared angle, rad², a few terms leave the same remainder.
const SHORT_LIMIT: f64 = 0.02;
/// Terms of each series there.
const SHORT_TERMS: usize = 6;

/// `[v]×`: the matrix that takes x to v × x.
#[inline]
pub fn cross_matrix<T: Scalar>(v: &Vector3<T>) -> Matrix3<T> {
    let o = T::zero();
    Matrix3::new(o, -v.z, v.y, v.z, o, -v.x, -v.y, v.x, o)
}

/// The three coefficients a, b, c of the module's equations at a squared angle.
#[derive(Clone, Copy, Debug)]
struct Coefficients<T> {
    a: T,
    b: T,
    c: T,
}

/// Factors of a series, as constants: a device without double precision takes hundreds of instructions for each.
struct Factors<const N: u32>;

impl<const N: u32> Factors<N> {
    const ALL: [f64; TERMS - 1] = [
        Self::at(1),
        Self::at(2),
        Self::at(3),
        Self::at(4),
        Self::at(5),
        Self::at(6),
        Self::at(7),
        Self::at(8),
    ];

    const fn at(k: u32) -> f64 {
        1.0 / ((2 * k + N - 1) * (2 * k + N)) as f64
    }
}

/// The first `TERMS` of `Σ_k (−x)^k · N! / (2k + N)!` by Horner's rule, that is 1 − x/((N+1)(N+2)) · (1 − …).
#[inline]
fn series<T: Scalar, const N: u32, const TERMS: usize>(x: T) -> T {
    let mut sum = T::one();
    for factor in Factors::<N>::ALL.iter().take(TERMS - 1).rev() {
        sum = T::one() - x * sum * T::of(*factor);
    }
    sum
}

#[inline]
fn series_coefficients<T: Scalar, const TERMS: usize>(x: T) -> Coefficients<T> {
    Coefficients {
        a: series::<T, 1, TERMS>(x),
        b: series::<T, 2, TERMS>(x) * T::of(0.5),
        c: series::<T, 3, TERMS>(x) * T::of(1.0 / 6.0),
    }
}

#[inline]
fn coefficients<T: Scalar>(x: T) -> Coefficients<T> {
    if x < T::of(SHORT_LIMIT) {
        series_coefficients::<T, SHORT_TERMS>(x)
    } else if x < T::of(SERIES_LIMIT) {
        series_coefficients::<T, TERMS>(x)
    } else {
        let angle = x.root();
        let (sin, cos) = (angle.sin(), angle.cos());
        Coefficients { a: sin / angle, b: (T::one() - cos) / x, c: (angle - sin) / (x * angle) }
    }
}

/// `I + first · [φ]× + second · [φ]×²`, the square as φφᵀ − φ² I.
#[inline]
fn polynomial<T: Scalar>(phi: &Vector3<T>, x: T, first: T, second: T) -> Matrix3<T> {
    let v = phi * first;
    let w = phi * second;
    let d = T::one() - second * x;
    Matrix3::new(
        d + w.x * phi.x,
        w.x * phi.y - v.z,
        w.x * phi.z + v.y,
        w.y * phi.x + v.z,
        d + w.y * phi.y,
        w.y * phi.z - v.x,
        w.z * phi.x - v.y,
        w.z * phi.y + v.x,
        d + w.z * phi.z,
    )
}

/// `C = exp([φ]×)` and the left Jacobian `J_l(φ)`, φ in rad.
#[inline]
pub fn exp_with_jacobian<T: Scalar>(phi: &Vector3<T>) -> (Matrix3<T>, Matrix3<T>) {
    let x = phi.dot(phi);
    let k = coefficients(x);
    (polynomial(phi, x, k.a, k.b), polynomial(phi, x, k.b, k.c))
}

/// `C = exp([φ]×)`: the rotation matrix of a rotation vector φ, rad.
#[inline]
pub fn exp<T: Scalar>(phi: &Vector3<T>) -> Matrix3<T> {
    let x = phi.dot(phi);
    let k = coefficients(x);
    polynomial(phi, x, k.a, k.b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn exp_agrees_with_an_independent_rotation(v in prop::array::uniform3(-4.0f64..4.0)) {
            let phi = Vector3::from(v);
            let other = Rotation3::from_scaled_axis(phi).into_inner();
            prop_assert!((exp(&phi) - other).norm() < 1e-14 * 4.0);
            prop_assert!((exp_with_jacobian(&phi).0 - other).norm() < 1e-14 * 4.0);
        }

        #[test]
        fn the_left_jacobian_is_the_derivative(v in prop::array::uniform3(-2.0f64..2.0), d in prop::array::uniform3(-1.0f64..1.0)) {
            let (phi, delta) = (Vector3::from(v), Vector3::from(d) * 1e-6);
            let (_, jacobian) = exp_with_jacobian(&phi);
            let moved = exp(&(phi + delta)) * exp(&(phi - delta)).transpose();
            let skew = (moved - moved.transpose()) * 0.25;
            let numeric = Vector3::new(skew.m32, skew.m13, skew.m21);
            prop_assert!((jacobian * delta - numeric).norm() < 1e-14);
        }
    }

    #[test]
    fn series_and_closed_form_agree() {
        let x = 0.999_999f64;
        let (angle, series) = (x.sqrt(), coefficients(x));
        assert!((series.a - angle.sin() / angle).abs() < 1e-15);
        assert!((series.b - (1.0 - angle.cos()) / x).abs() < 1e-15);
        assert!((series.c - (angle - angle.sin()) / (x * angle)).abs() < 1e-15);
        let (short, long) = (coefficients(0.019_999f64), series_coefficients::<f64, TERMS>(0.019_999));
        assert!((short.a - long.a).abs() + (short.b - long.b).abs() + (short.c - long.c).abs() < 1e-15);
    }
}

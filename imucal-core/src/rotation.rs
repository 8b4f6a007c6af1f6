//! Rotations: the exponential map and its derivative, for vectors of a radian or so and of any size.
//!
//! Convention, once for the crate: `C_a_b` takes components from `a` to `b`, and a body that turns by the
//! rotation vector φ (components in the body) goes from `C_b_n` to `C_b_n · exp([φ]×)`.
//!
//! ```text
//! exp([φ]×) = I + a(φ²)[φ]× + b(φ²)[φ]×²        a = sin φ/φ, b = (1 − cos φ)/φ²
//! J_l(φ)    = I + b(φ²)[φ]× + c(φ²)[φ]×²        c = (φ − sin φ)/φ³
//! exp([φ + δ]×) ≈ exp([J_l(φ) δ]×) · exp([φ]×)
//! log(q)    = 2 atan(|v|/|w|)/|v| · v · sign w    q = (w, v), of any length
//! J_l⁻¹(φ)  = I − ½[φ]× + e(φ²)[φ]×²       e = (1 − a/(2b))/φ²
//! ```
//!
//! Below one radian the coefficients come from their power series (to φ¹⁶: the remainder is below 1e-15, see
//! `series_and_closed_form_agree`), above from those of half the angle: libm's sine takes double precision, which a
//! device has to emulate. Source: Rodrigues' formula; the derivative as in Chirikjian,
//! *Stochastic Models, Information Theory, and Lie Groups*, vol. 2, ch. 10; matrix to quaternion as in Shepperd 1978
//! (J. Guidance and Control 1). Errors, largest entry over angles up to π, asserted by the tests:
//!
//! | function | `f64` | `f32` |
//! | --- | --- | --- |
//! | [`exp`], below 0.14 rad | 4e-16 | 2e-7 |
//! | [`exp`], to 4 rad | 2e-15 | 6e-7 |
//! | [`quaternion_log`], below 16° relative to the angle, above absolute, rad | 2e-15 | 6e-7 |
//! | [`log`] of [`exp`], absolute, rad | 3e-15 | 2e-6 |

pub mod axis_order;

use nalgebra::{Matrix3, Quaternion, Vector3};

use crate::scalar::Scalar;

/// Series are used below this squared angle, rad².
const SERIES_LIMIT: f64 = 1.0;
/// Terms of each series there.
const TERMS: usize = 9;
/// Below this squared angle, rad², a few terms leave the same remainder.
const SHORT_LIMIT: f64 = 0.02;
/// Terms of each series there.
const SHORT_TERMS: usize = 6;
/// And so many, in single precision.
const SINGLE_TERMS: usize = 4;

/// `[v]×`: the matrix that takes x to v × x.
#[inline]
pub fn cross_matrix<T: Scalar>(v: &Vector3<T>) -> Matrix3<T> {
    let o = T::zero();
    Matrix3::new(o, -v.z, v.y, v.z, o, -v.x, -v.y, v.x, o)
}

/// `m · v`, by components: nalgebra's product is the same arithmetic in the same order, but at a device's
/// `opt-level = "s"` it stays a loop, four times as long.
#[inline]
pub fn image<T: Scalar>(m: &Matrix3<T>, v: &Vector3<T>) -> Vector3<T> {
    Vector3::new(
        m.m11 * v.x + m.m12 * v.y + m.m13 * v.z,
        m.m21 * v.x + m.m22 * v.y + m.m23 * v.z,
        m.m31 * v.x + m.m32 * v.y + m.m33 * v.z,
    )
}

/// `a · b`, likewise, and out of line: it takes 200 bytes wherever it is written out.
#[inline(never)]
pub fn product<T: Scalar>(a: &Matrix3<T>, b: &Matrix3<T>) -> Matrix3<T> {
    let (x, y, z) = (
        Vector3::new(b.m11, b.m21, b.m31),
        Vector3::new(b.m12, b.m22, b.m32),
        Vector3::new(b.m13, b.m23, b.m33),
    );
    let (x, y, z) = (image(a, &x), image(a, &y), image(a, &z));
    Matrix3::new(x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z)
}

/// The three coefficients a, b, c of the module's equations at a squared angle.
#[derive(Clone, Copy, Debug)]
struct Coefficients<T> {
    a: T,
    b: T,
    c: T,
}

/// Factor k of a series.
const fn factor(k: u32, n: u32) -> f64 {
    1.0 / ((2 * k + n - 1) * (2 * k + n)) as f64
}

/// The first `TERMS` of `Σ_k (−x)^k · N! / (2k + N)!` by Horner's rule, that is 1 − x/((N+1)(N+2)) · (1 − …).
///
/// Written out: a loop over a table of `f64` has a device without double precision convert each factor each time, at
/// five times the cost of all the rest.
#[inline]
fn series<T: Scalar, const N: u32, const TERMS: usize>(x: T) -> T {
    let mut sum = T::one();
    macro_rules! terms {
        ($($k:literal)*) => {
            $(if TERMS > $k {
                sum = T::one() - x * sum * T::of(const { factor($k, N) });
            })*
        };
    }
    terms!(8 7 6 5 4 3 2 1);
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

#[inline(never)]
fn coefficients<T: Scalar>(x: T) -> Coefficients<T> {
    if x < T::of(SHORT_LIMIT) {
        series_coefficients::<T, SHORT_TERMS>(x)
    } else if x < T::of(SERIES_LIMIT) {
        series_coefficients::<T, TERMS>(x)
    } else {
        doubled_coefficients(x)
    }
}

/// Halvings of an angle at the most: more have none left.
const HALVINGS: u32 = 64;

/// The coefficients of a larger angle, from those of its half, as often as need be: sin 2h = 2 sin h cos h.
#[inline(never)]
fn doubled_coefficients<T: Scalar>(x: T) -> Coefficients<T> {
    let (mut small, mut halvings) = (x, 0);
    while small >= T::of(SERIES_LIMIT) && halvings < HALVINGS {
        small *= T::of(0.25);
        halvings += 1;
    }
    let mut k = series_coefficients::<T, TERMS>(small);
    for _ in 0..halvings {
        let a = k.a * (T::one() - k.b * small);
        small *= T::of(4.0);
        k = Coefficients { a, b: k.a * k.a * T::of(0.5), c: (T::one() - a) / small };
    }
    k
}

/// Sine and cosine of an angle, rad, meant for small ones: half a dozen roundings more for each doubling beyond 1 rad.
pub fn sin_cos<T: Scalar>(angle: T) -> (T, T) {
    let x = angle * angle;
    let k = coefficients(x);
    (k.a * angle, T::one() - k.b * x)
}

/// `I + first · [φ]× + second · [φ]×²`, the square as φφᵀ − φ² I.
#[inline]
fn polynomial<T: Scalar>(phi: &Vector3<T>, x: T, first: T, second: T) -> Matrix3<T> {
    let v = Vector3::new(phi.x * first, phi.y * first, phi.z * first);
    let w = Vector3::new(phi.x * second, phi.y * second, phi.z * second);
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
    let x = phi.x * phi.x + phi.y * phi.y + phi.z * phi.z;
    let (a, b) = if x < T::of(SHORT_LIMIT) {
        if T::EPSILON > T::of(1e-10) {
            // In single precision the first term left out, x⁴/9!, is nothing.
            (series::<T, 1, SINGLE_TERMS>(x), series::<T, 2, SINGLE_TERMS>(x) * T::of(0.5))
        } else {
            (series::<T, 1, SHORT_TERMS>(x), series::<T, 2, SHORT_TERMS>(x) * T::of(0.5))
        }
    } else {
        let k = coefficients(x);
        (k.a, k.b)
    };
    polynomial(phi, x, a, b)
}

/// `C ← C exp([φ]×)`, in place: what a swarm's particle does for each block, so that its cost is that of a search.
#[inline(never)]
pub fn turn<T: Scalar>(c: &mut Matrix3<T>, phi: &Vector3<T>) {
    let e = exp(phi);
    let row = |x: T, y: T, z: T| {
        (
            x * e.m11 + y * e.m21 + z * e.m31,
            x * e.m12 + y * e.m22 + z * e.m32,
            x * e.m13 + y * e.m23 + z * e.m33,
        )
    };
    (c.m11, c.m12, c.m13) = row(c.m11, c.m12, c.m13);
    (c.m21, c.m22, c.m23) = row(c.m21, c.m22, c.m23);
    (c.m31, c.m32, c.m33) = row(c.m31, c.m32, c.m33);
}

/// Below this squared tangent of half the angle the logarithm takes its series: angles below 16°.
const LOG_LIMIT: f64 = 0.02;
/// Factors 1/(2k + 1) of that series; the first left out is below 0.02⁹/19 = 3e-17.
const LOG_FACTORS: [f64; 9] =
    [1.0, 1.0 / 3.0, 0.2, 1.0 / 7.0, 1.0 / 9.0, 1.0 / 11.0, 1.0 / 13.0, 1.0 / 15.0, 1.0 / 17.0];

/// Rotation vector of a quaternion of any length but zero, rad, of at most π: the shorter way round.
#[inline]
pub fn quaternion_log<T: Scalar>(q: &Quaternion<T>) -> Vector3<T> {
    let v = q.imag();
    // q and −q are the same rotation.
    let (w, v) = if q.w < T::zero() { (-q.w, -v) } else { (q.w, v) };
    let sine = v.dot(&v);
    let tangent = sine / (w * w);
    if tangent < T::of(LOG_LIMIT) {
        // 2 atan(t)/t · v/w, as Σ (−t²)^k / (2k + 1).
        let mut sum = T::zero();
        for factor in LOG_FACTORS.iter().rev() {
            sum = T::of(*factor) - tangent * sum;
        }
        v * ((sum + sum) / w)
    } else {
        let sine = sine.root();
        let half = sine.atan2(w);
        v * ((half + half) / sine)
    }
}

/// The quaternion of a rotation matrix, w first, length 1 to rounding, of either sign.
///
/// Takes `C_a_b` to the quaternion that does the same to a vector, `q v q*`.
#[inline]
pub fn quaternion<T: Scalar>(c: &Matrix3<T>) -> Quaternion<T> {
    let one = T::one();
    let trace = c.m11 + c.m22 + c.m33;
    let (x, y, z) = (c.m32 - c.m23, c.m13 - c.m31, c.m21 - c.m12);
    let (xy, xz, yz) = (c.m12 + c.m21, c.m13 + c.m31, c.m23 + c.m32);
    // Shepperd: divide by the largest of the four components, which is at least a half.
    let (largest, rest) = if trace >= c.m11 && trace >= c.m22 && trace >= c.m33 {
        (one + trace, [None, Some(x), Some(y), Some(z)])
    } else if c.m11 >= c.m22 && c.m11 >= c.m33 {
        (one + c.m11 - c.m22 - c.m33, [Some(x), None, Some(xy), Some(xz)])
    } else if c.m22 >= c.m33 {
        (one + c.m22 - c.m11 - c.m33, [Some(y), Some(xy), None, Some(yz)])
    } else {
        (one + c.m33 - c.m11 - c.m22, [Some(z), Some(xz), Some(yz), None])
    };
    let twice = largest.root();
    let half = T::of(0.5);
    let [w, x, y, z] = rest.map(|component| component.map_or(twice * half, |product| product * half / twice));
    Quaternion::new(w, x, y, z)
}

/// The rotation matrix of a quaternion of any length but zero.
pub fn matrix<T: Scalar>(q: &Quaternion<T>) -> Matrix3<T> {
    let v = q.imag();
    let length = q.w * q.w + v.dot(&v);
    let two = T::of(2.0) / length;
    polynomial(&v, v.dot(&v), q.w * two, two)
}

/// `log(C)`: the rotation vector of a rotation matrix, rad, of at most π. The inverse of [`exp`].
#[inline]
pub fn log<T: Scalar>(c: &Matrix3<T>) -> Vector3<T> {
    quaternion_log(&quaternion(c))
}

/// `B_2k / (2k)!`, k from 1, without the alternating sign: the series of e.
const BERNOULLI: [f64; 9] = [
    1.0 / 12.0,
    1.0 / 720.0,
    1.0 / 30_240.0,
    1.0 / 1_209_600.0,
    1.0 / 47_900_160.0,
    691.0 / 1_307_674_368_000.0,
    1.0 / 74_724_249_600.0,
    3_617.0 / 10_670_622_842_880_000.0,
    43_867.0 / 5_109_094_217_170_944_000.0,
];

/// `J_l⁻¹(φ)`, φ in rad, shorter than 2π: `log(exp([δ]×) exp([φ]×)) ≈ φ + J_l⁻¹(φ) δ`.
pub fn inverse_left_jacobian<T: Scalar>(phi: &Vector3<T>) -> Matrix3<T> {
    let x = phi.dot(phi);
    let e = if x < T::of(SERIES_LIMIT) {
        BERNOULLI.iter().rev().fold(T::zero(), |sum, term| sum * x + T::of(*term))
    } else {
        let k = coefficients(x);
        (T::one() - k.a / (k.b + k.b)) / x
    };
    polynomial(phi, x, T::of(-0.5), e)
}

#[cfg(test)]
mod tests;

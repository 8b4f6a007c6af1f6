//! Adjusted least squares: the algebraic ellipsoid without the bias of noise.
//!
//! ```text
//! f(x; ψ) = ψᵀ m(x) = 0,   m(x) = (x², y², z², xy, xz, yz, x, y, z, 1)
//! Ψ(σ²) = mean of m mᵀ with each monomial replaced by an unbiased one:
//!     x → x,  x² → x² − σ²,  x³ → x³ − 3xσ²,  x⁴ → x⁴ − 6x²σ² + 3σ⁴
//! ψ = eigenvector of the least eigenvalue of Ψ(σ²), with σ² such that it is zero
//! ```
//!
//! Source: Markovsky, Kukush & Van Huffel 2004, with the noise estimated together with the ellipsoid; models.md 5. The
//! ordinary algebraic fit (σ² = 0) is off by several times its noise where a part of the sphere is unseen. Where
//! the noise is known, [`with_noise`] is the textbook estimator, consistent under it. Not modelled: noise that
//! differs between axes, or that is correlated in time.

use imucal_core::{observation::ShellPoint, triad::Triad};
use nalgebra::SMatrix;

use super::quadric::{Frame, MONOMIALS, Quadric};

/// Coefficient of σ^{2k} x^{n−2k} in the unbiased monomial of degree n.
const UNBIASED: [[f64; 3]; 5] =
    [[1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, -1.0, 0.0], [1.0, -3.0, 0.0], [1.0, -6.0, 3.0]];
/// The noise is looked for up to this share of the cloud's extent.
const LARGEST_NOISE: f64 = 0.2;

type Design = SMatrix<f64, 10, 10>;

/// Raw moments of a cloud, mean of x^a y^b z^c for a + b + c ≤ 4, after the cloud is centred and scaled.
struct Moments {
    sums: [[[f64; 5]; 5]; 5],
    frame: Frame,
}

impl Moments {
    fn of(points: &[ShellPoint<f64>]) -> Option<Self> {
        let count = points.len() as f64;
        let frame = Frame::of(points)?;
        let mut sums = [[[0.0; 5]; 5]; 5];
        for p in points {
            let x = frame.inside(&p.value);
            let powers = [x.x, x.y, x.z].map(|v| [1.0, v, v * v, v * v * v, v * v * v * v]);
            for a in 0..5 {
                for b in 0..5 - a {
                    for c in 0..5 - a - b {
                        sums[a][b][c] += powers[0][a] * powers[1][b] * powers[2][c] / count;
                    }
                }
            }
        }
        Some(Self { sums, frame })
    }

    /// Moment of the unbiased monomial x^a y^b z^c under noise of variance `s`.
    fn unbiased(&self, [a, b, c]: [usize; 3], s: f64) -> f64 {
        let mut sum = 0.0;
        for (i, x) in UNBIASED[a].iter().enumerate().take(a / 2 + 1) {
            for (j, y) in UNBIASED[b].iter().enumerate().take(b / 2 + 1) {
                for (k, z) in UNBIASED[c].iter().enumerate().take(c / 2 + 1) {
                    let raw = self.sums[a - 2 * i][b - 2 * j][c - 2 * k];
                    sum += x * y * z * s.powi((i + j + k) as i32) * raw;
                }
            }
        }
        sum
    }

    fn design(&self, s: f64) -> Design {
        Design::from_fn(|i, j| {
            let (p, q) = (MONOMIALS[i], MONOMIALS[j]);
            self.unbiased([p[0] + q[0], p[1] + q[1], p[2] + q[2]], s)
        })
    }
}

/// Least eigenvalue of the design and its eigenvector.
fn least(design: Design) -> (f64, Quadric) {
    let eigen = design.symmetric_eigen();
    let (index, value) = eigen.eigenvalues.argmin();
    (value, eigen.eigenvectors.column(index).into_owned())
}

/// The noise variance at which the least eigenvalue vanishes, by bisection: it falls as the noise grows.
fn noise_variance(moments: &Moments) -> f64 {
    let (mut low, mut high) = (0.0, LARGEST_NOISE * LARGEST_NOISE);
    if least(moments.design(high)).0 > 0.0 {
        return high;
    }
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if least(moments.design(middle)).0 > 0.0 {
            low = middle
        } else {
            high = middle
        }
        if high - low < 1e-6 * high {
            break;
        }
    }
    low
}

/// The triad, gain upper triangular, that maps the cloud's ellipsoid to a sphere of radius `norm`; `None` where
/// the points lie in a plane or on a quadric that is no ellipsoid.
pub fn start(points: &[ShellPoint<f64>], norm: f64) -> Option<Triad<f64>> {
    let moments = Moments::of(points)?;
    let (_, psi) = least(moments.design(noise_variance(&moments)));
    moments.frame.triad(&psi, norm)
}

/// The same for noise whose standard deviation on each axis is known, raw unit.
pub fn with_noise(points: &[ShellPoint<f64>], norm: f64, noise: f64) -> Option<Triad<f64>> {
    let moments = Moments::of(points)?;
    let (_, psi) = least(moments.design((noise / moments.frame.extent).powi(2)));
    moments.frame.triad(&psi, norm)
}

#[cfg(test)]
mod tests {
    use super::super::quadric::tests::{CENTRE, assert_found, cap, circle};
    use super::*;

    #[test]
    fn without_noise_the_ellipsoid_is_exact() {
        assert_found(&start(&cap(1.0, 300, 0.0), 475.0).unwrap(), 1e-5);
        assert_found(&with_noise(&cap(1.0, 300, 0.0), 475.0, 0.0).unwrap(), 1e-8);
    }

    #[test]
    fn on_the_top_third_noise_does_not_shift_the_centre() {
        let points = cap(0.3, 200_000, 2.0);
        for triad in [start(&points, 475.0).unwrap(), with_noise(&points, 475.0, 2.0).unwrap()] {
            assert!((triad.bias - CENTRE).norm() < 2.5, "{}", triad.bias);
        }
    }

    #[test]
    fn points_in_a_plane_have_no_ellipsoid() {
        assert!(start(&circle(), 1.0).is_none());
    }
}

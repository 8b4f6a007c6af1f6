//! Adjusted least squares: the algebraic ellipsoid without the bias of noise.
//!
//! ```text
//! f(x; ψ) = ψᵀ m(x) = 0,   m(x) = (x², y², z², xy, xz, yz, x, y, z, 1)
//! Ψ(σ²) = mean of m mᵀ with each monomial replaced by an unbiased one:
//!     x → x,  x² → x² − σ²,  x³ → x³ − 3xσ²,  x⁴ → x⁴ − 6x²σ² + 3σ⁴
//! ψ = eigenvector of the least eigenvalue of Ψ(σ²), with σ² such that it is zero
//! ```
//!
//! Source: Markovsky, Kukush & Van Huffel 2004, with the noise estimated beside the ellipsoid; models.md 5. The
//! ordinary algebraic fit (σ² = 0) is off by several times its noise where a part of the sphere is unseen.
//! Not modelled: noise that differs between axes, or that is correlated in time.

use imucal_core::{observation::ShellPoint, triad::Triad};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Exponents of the monomials m(x).
const MONOMIALS: [[usize; 3]; 10] = [
    [2, 0, 0],
    [0, 2, 0],
    [0, 0, 2],
    [1, 1, 0],
    [1, 0, 1],
    [0, 1, 1],
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
    [0, 0, 0],
];
/// Coefficient of σ^{2k} x^{n−2k} in the unbiased monomial of degree n.
const UNBIASED: [[f64; 3]; 5] =
    [[1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, -1.0, 0.0], [1.0, -3.0, 0.0], [1.0, -6.0, 3.0]];
/// The noise is looked for up to this share of the cloud's extent.
const LARGEST_NOISE: f64 = 0.2;

type Design = SMatrix<f64, 10, 10>;

/// Raw moments of a cloud, mean of x^a y^b z^c for a + b + c ≤ 4, after the cloud is centred and scaled.
struct Moments {
    sums: [[[f64; 5]; 5]; 5],
    middle: Vector3<f64>,
    extent: f64,
}

impl Moments {
    fn of(points: &[ShellPoint<f64>]) -> Option<Self> {
        let count = points.len() as f64;
        let middle: Vector3<f64> = points.iter().map(|p| p.value).sum::<Vector3<f64>>() / count;
        let extent = (points.iter().map(|p| (p.value - middle).norm_squared()).sum::<f64>() / count).sqrt();
        if !(extent.is_finite() && extent > 0.0) {
            return None;
        }
        let mut sums = [[[0.0; 5]; 5]; 5];
        for p in points {
            let x = (p.value - middle) / extent;
            let powers = [x.x, x.y, x.z].map(|v| [1.0, v, v * v, v * v * v, v * v * v * v]);
            for a in 0..5 {
                for b in 0..5 - a {
                    for c in 0..5 - a - b {
                        sums[a][b][c] += powers[0][a] * powers[1][b] * powers[2][c] / count;
                    }
                }
            }
        }
        Some(Self { sums, middle, extent })
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
fn least(design: Design) -> (f64, SVector<f64, 10>) {
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
    let q = Matrix3::new(
        psi[0],
        0.5 * psi[3],
        0.5 * psi[4],
        0.5 * psi[3],
        psi[1],
        0.5 * psi[5],
        0.5 * psi[4],
        0.5 * psi[5],
        psi[2],
    );
    let linear = Vector3::new(psi[6], psi[7], psi[8]) * 0.5;
    let centre = -(q.try_inverse()? * linear);
    let scale = centre.dot(&(q * centre)) - psi[9];
    let upper = (q / scale).cholesky()?.l().transpose();
    let triad =
        Triad { gain: upper * (norm / moments.extent), bias: moments.middle + centre * moments.extent };
    triad.is_finite().then_some(triad)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};

    /// Points on the top `share` of an ellipsoid, with noise.
    fn cap(share: f64, count: u32, noise: f64) -> Vec<ShellPoint<f64>> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
        let normal = Normal::new(0.0, noise).unwrap();
        let k = Matrix3::new(1.05, 0.02, 0.0, 0.02, 0.95, -0.03, 0.0, -0.03, 1.1);
        (0..count)
            .map(|i| {
                let z = 1.0 - 2.0 * share * (f64::from(i) + 0.5) / f64::from(count);
                let r = (1.0 - z * z).sqrt();
                let a = 2.399_963 * f64::from(i);
                let u = Vector3::new(r * a.cos(), r * a.sin(), z) * 475.0;
                let n = Vector3::from_fn(|_, _| normal.sample(&mut rng));
                ShellPoint::new(k * u + Vector3::new(100.0, -50.0, 20.0) + n)
            })
            .collect()
    }

    #[test]
    fn without_noise_the_ellipsoid_is_exact() {
        let triad = start(&cap(1.0, 300, 0.0), 475.0).unwrap();
        assert!((triad.bias - Vector3::new(100.0, -50.0, 20.0)).norm() < 1e-3, "{}", triad.bias);
    }

    #[test]
    fn on_the_top_third_noise_does_not_shift_the_centre() {
        let triad = start(&cap(0.3, 200_000, 2.0), 475.0).unwrap();
        assert!((triad.bias - Vector3::new(100.0, -50.0, 20.0)).norm() < 2.5, "{}", triad.bias);
    }

    #[test]
    fn points_in_a_plane_have_no_ellipsoid() {
        let points: Vec<_> = (0..50)
            .map(|k| ShellPoint::new(Vector3::new(f64::from(k).cos(), f64::from(k).sin(), 0.0)))
            .collect();
        assert!(start(&points, 1.0).is_none());
    }
}

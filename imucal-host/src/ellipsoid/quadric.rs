//! Quadrics: the one design that all algebraic fits share, and the one way from a quadric to a triad.
//!
//! ```text
//! f(x; ψ) = ψᵀ m(x) = 0,   m(x) = (x², y², z², xy, xz, yz, x, y, z, 1)
//! Q = [ψ₀ ψ₃/2 ψ₄/2; · ψ₁ ψ₅/2; · · ψ₂],   c = −Q⁻¹ (ψ₆, ψ₇, ψ₈)/2,   s = cᵀQc − ψ₉
//! (x − c)ᵀ (Q/s) (x − c) = 1,   Q/s = UᵀU,   gain = F U,   bias = c
//! ```
//!
//! in the cloud's frame: about its mean, its rms distance from there as unit. Source: models.md 5 lists the fits;
//! the conversion is Cholesky's factor of the normalised quadric.

use imucal_core::{observation::ShellPoint, triad::Triad};
use nalgebra::{DMatrix, Matrix3, SMatrix, SVector, Vector3};

/// Exponents of the monomials m(x).
pub const MONOMIALS: [[usize; 3]; 10] = [
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
/// Two singular values below this share of the largest: more than one quadric goes through the points.
const DEGENERATE: f64 = 1e-9;

/// A quadric's coefficients, in the order of [`MONOMIALS`].
pub type Quadric = SVector<f64, 10>;

/// Where a cloud is, and how large.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Origin, raw unit.
    pub middle: Vector3<f64>,
    /// Unit of length, raw unit.
    pub extent: f64,
}

impl Frame {
    /// The cloud's mean, and the rms distance from there; `None` where all points are one, or none is.
    pub fn of(points: &[ShellPoint<f64>]) -> Option<Self> {
        let count = points.len() as f64;
        let middle: Vector3<f64> = points.iter().map(|p| p.value).sum::<Vector3<f64>>() / count;
        let extent = (points.iter().map(|p| (p.value - middle).norm_squared()).sum::<f64>() / count).sqrt();
        (extent.is_finite() && extent > 0.0).then_some(Self { middle, extent })
    }

    /// A raw point in this frame.
    pub fn inside(&self, point: &Vector3<f64>) -> Vector3<f64> {
        (point - self.middle) / self.extent
    }

    /// The triad, gain upper triangular, that maps a quadric of this frame to a sphere of radius `norm`; `None`
    /// where it is no ellipsoid.
    pub fn triad(&self, psi: &Quadric, norm: f64) -> Option<Triad<f64>> {
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
        let triad = Triad { gain: upper * (norm / self.extent), bias: self.middle + centre * self.extent };
        triad.is_finite().then_some(triad)
    }
}

/// The monomials at a point.
pub fn monomials(x: &Vector3<f64>) -> Quadric {
    Quadric::from_fn(|k, _| {
        let [a, b, c] = MONOMIALS[k];
        x.x.powi(a as i32) * x.y.powi(b as i32) * x.z.powi(c as i32)
    })
}

/// Triangular factor R of the design, one row m(x)ᵀ a point: `|Rψ|² = Σ f(x; ψ)²`, without the squared condition
/// number of the normal equations. `None` for points of which more than one quadric goes through all.
pub fn factor(points: &[ShellPoint<f64>], frame: &Frame) -> Option<SMatrix<f64, 10, 10>> {
    if points.len() < MONOMIALS.len() {
        return None;
    }
    let mut design = DMatrix::zeros(points.len(), MONOMIALS.len());
    for (mut row, p) in design.row_iter_mut().zip(points) {
        row.tr_copy_from(&monomials(&frame.inside(&p.value)));
    }
    let r = SMatrix::<f64, 10, 10>::from_fn({
        let r = design.qr().r();
        move |i, j| r[(i, j)]
    });
    let mut sizes: Vec<f64> = r.singular_values().iter().copied().collect();
    sizes.sort_by(f64::total_cmp);
    (sizes[1] > DEGENERATE * sizes[9]).then_some(r)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};

    /// Centre of the ellipsoid of [`cap`].
    pub const CENTRE: Vector3<f64> = Vector3::new(100.0, -50.0, 20.0);

    /// K of the ellipsoid of [`cap`].
    pub fn sensitivity() -> Matrix3<f64> {
        Matrix3::new(1.05, 0.02, 0.0, 0.02, 0.95, -0.03, 0.0, -0.03, 1.1)
    }

    /// Points on the top `share` of an ellipsoid, with noise.
    pub fn cap(share: f64, count: u32, noise: f64) -> Vec<ShellPoint<f64>> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
        let normal = Normal::new(0.0, noise).unwrap();
        (0..count)
            .map(|i| {
                let z = 1.0 - 2.0 * share * (f64::from(i) + 0.5) / f64::from(count);
                let r = (1.0 - z * z).sqrt();
                let a = 2.399_963 * f64::from(i);
                let u = Vector3::new(r * a.cos(), r * a.sin(), z) * 475.0;
                let n = Vector3::from_fn(|_, _| normal.sample(&mut rng));
                ShellPoint::new(sensitivity() * u + CENTRE + n)
            })
            .collect()
    }

    /// Points on a circle: a plane, and many quadrics through it.
    pub fn circle() -> Vec<ShellPoint<f64>> {
        (0..50).map(|k| ShellPoint::new(Vector3::new(f64::from(k).cos(), f64::from(k).sin(), 0.0))).collect()
    }

    /// Asserts that a triad is that of [`cap`], as exact as `tolerance` relative to the field.
    pub fn assert_found(triad: &Triad<f64>, tolerance: f64) {
        assert!((triad.bias - CENTRE).norm() < 475.0 * tolerance, "{}", triad.bias);
        // A rotation is left open: K Kᵀ is what an ellipsoid determines.
        let k = triad.sensitivity().unwrap();
        let difference = k * k.transpose() - sensitivity() * sensitivity().transpose();
        assert!(difference.amax() < 10.0 * tolerance, "{difference}");
    }

    #[test]
    fn the_quadric_of_a_known_ellipsoid_gives_its_axes_and_centre() {
        // (x − 1)²/4 + (y + 2)²/9 + (z − 3)² = 1, times a factor of either sign.
        for factor in [-5.0, 0.3] {
            let psi = Quadric::from([
                0.25,
                1.0 / 9.0,
                1.0,
                0.0,
                0.0,
                0.0,
                -0.5,
                4.0 / 9.0,
                -6.0,
                0.25 + 4.0 / 9.0 + 9.0 - 1.0,
            ]) * factor;
            let frame = Frame { middle: Vector3::new(10.0, 0.0, 0.0), extent: 2.0 };
            let triad = frame.triad(&psi, 6.0).unwrap();
            assert!((triad.bias - Vector3::new(12.0, -4.0, 6.0)).norm() < 1e-12);
            assert!((triad.gain - Matrix3::from_diagonal(&Vector3::new(1.5, 1.0, 3.0))).amax() < 1e-12);
        }
    }

    #[test]
    fn a_hyperboloid_is_no_triad() {
        let psi = Quadric::from([1.0, 1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0]);
        let frame = Frame { middle: Vector3::zeros(), extent: 1.0 };
        assert!(frame.triad(&psi, 1.0).is_none());
    }

    #[test]
    fn one_point_has_no_frame_and_a_plane_no_factor() {
        assert!(Frame::of(&[]).is_none());
        assert!(Frame::of(&[ShellPoint::new(Vector3::x()); 20]).is_none());
        assert!(factor(&circle(), &Frame::of(&circle()).unwrap()).is_none());
    }
}

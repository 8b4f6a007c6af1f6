//! The direct fit: the quadric with the least algebraic distance, by singular value decomposition of the design.
//!
//! ```text
//! min Σ (ψᵀ m(x))²   subject to   |ψ| = 1
//! ```
//!
//! Source: models.md 5 (algebraic, SVD). Any quadric may come out, so it can fail where [`super::li_griffiths`]
//! cannot. Biased under noise where a part of the sphere is unseen, and by how much depends on origin and unit,
//! since |ψ| = 1 changes its meaning with them.

use imucal_core::{observation::ShellPoint, triad::Triad};

use super::quadric::{self, Frame};

/// The triad of the cloud, in its own [`Frame`]; `None` where the points do not determine one quadric, or it is no ellipsoid.
pub fn start(points: &[ShellPoint<f64>], norm: f64) -> Option<Triad<f64>> {
    in_frame(points, norm, &Frame::of(points)?)
}

/// The same, with |ψ| = 1 meant in a frame of the caller's.
pub fn in_frame(points: &[ShellPoint<f64>], norm: f64, frame: &Frame) -> Option<Triad<f64>> {
    let svd = quadric::factor(points, frame)?.svd(false, true);
    let least = svd.singular_values.argmin().0;
    frame.triad(&svd.v_t?.row(least).transpose(), norm)
}

#[cfg(test)]
mod tests {
    use super::super::quadric::tests::{assert_found, cap, circle};
    use super::*;

    #[test]
    fn without_noise_the_ellipsoid_is_exact() {
        assert_found(&start(&cap(1.0, 300, 0.0), 475.0).unwrap(), 1e-10);
        assert_found(&start(&cap(0.3, 9 + 3, 0.0), 475.0).unwrap(), 1e-8);
    }

    #[test]
    fn too_few_points_and_points_in_a_plane_have_no_ellipsoid() {
        assert!(start(&cap(1.0, 8, 0.0), 475.0).is_none());
        assert!(start(&circle(), 1.0).is_none());
        assert!(start(&[], 1.0).is_none());
    }

    #[test]
    fn on_a_part_of_the_sphere_the_shift_of_the_centre_depends_on_the_frame() {
        let points = cap(0.3, 20_000, 2.0);
        let own = start(&points, 475.0).unwrap();
        let frame = Frame { middle: nalgebra::Vector3::zeros(), extent: 1.0 };
        let raw = in_frame(&points, 475.0, &frame).unwrap();
        assert!((own.bias - raw.bias).norm() > 5.0, "{} {}", own.bias, raw.bias);
    }
}

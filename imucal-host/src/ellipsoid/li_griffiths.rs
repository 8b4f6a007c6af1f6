//! The ellipsoid-specific fit: least algebraic distance among ellipsoids only.
//!
//! ```text
//! min |Rψ|²   subject to   k J − I² = 1,   k = 4
//! I = a + b + c,   J = ab + bc + ac − f² − g² − h²     of Q = [a h g; h b f; g f c]
//! ```
//!
//! With linear and constant coefficients eliminated (triangular factor of their columns first, the block T left
//! for the quadratic ones), `TᵀT v = λ C v`; the solution belongs to the one positive eigenvalue of T⁻ᵀ C T⁻¹.
//!
//! Source: Li & Griffiths 2004, *Least squares ellipsoid specific fitting*. For k = 4 the constraint admits every
//! ellipsoid whose shortest radius is at least half of the longest, and nothing but ellipsoids; sensors are
//! rounder by far. Unlike that of |ψ| = 1, the answer does not depend on origin and unit. It is biased under noise
//! towards ellipsoids that are too round and too large.

use imucal_core::{observation::ShellPoint, triad::Triad};
use nalgebra::{SMatrix, SVector};

use super::quadric::{self, Frame, Quadric};

/// Columns of the design: linear and constant ones first, so that they are eliminated.
const ORDER: [usize; 10] = [6, 7, 8, 9, 0, 1, 2, 3, 4, 5];
/// Exact points leave nothing on the diagonal of T; this share of its size stands for it.
const ROUNDING: f64 = 1e-15;

type Block = SMatrix<f64, 6, 6>;

/// C of vᵀCv = 4J − I² for v = (a, b, c, 2h, 2g, 2f): the coefficients of products are twice the quadric's entries.
fn constraint() -> Block {
    Block::from_fn(|i, j| match (i, j) {
        _ if i < 3 && j < 3 => {
            if i == j {
                -1.0
            } else {
                1.0
            }
        }
        _ if i == j => -1.0,
        _ => 0.0,
    })
}

/// The triad of the cloud; `None` where the points do not determine one quadric.
pub fn start(points: &[ShellPoint<f64>], norm: f64) -> Option<Triad<f64>> {
    let frame = Frame::of(points)?;
    let r = quadric::factor(points, &frame)?;
    let ordered = SMatrix::<f64, 10, 10>::from_fn(|i, j| r[(i, ORDER[j])]).qr().r();
    let mut left: Block = ordered.fixed_view::<6, 6>(4, 4).into_owned();
    let size = left.amax();
    for k in 0..6 {
        if left[(k, k)].abs() < ROUNDING * size {
            left[(k, k)] = ROUNDING * size;
        }
    }
    let inverse = left.try_inverse()?;
    let eigen = (inverse.transpose() * constraint() * inverse).symmetric_eigen();
    let (index, largest) = eigen.eigenvalues.argmax();
    if largest <= 0.0 {
        return None;
    }
    let quadratic: SVector<f64, 6> = (inverse * eigen.eigenvectors.column(index)).normalize();
    let rest = ordered.fixed_view::<4, 4>(0, 0).into_owned();
    let linear = rest.solve_upper_triangular(&-(ordered.fixed_view::<4, 6>(0, 4) * quadratic))?;
    let mut psi = Quadric::zeros();
    psi.fixed_rows_mut::<6>(0).copy_from(&quadratic);
    psi.fixed_rows_mut::<4>(6).copy_from(&linear);
    frame.triad(&psi, norm)
}

#[cfg(test)]
mod tests {
    use super::super::quadric::tests::{assert_found, cap, circle};
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn without_noise_the_ellipsoid_is_exact() {
        assert_found(&start(&cap(1.0, 300, 0.0), 475.0).unwrap(), 1e-10);
        assert_found(&start(&cap(0.3, 12, 0.0), 475.0).unwrap(), 1e-8);
    }

    #[test]
    fn the_constraint_of_a_unit_sphere_is_three() {
        // a = b = c = 1: J = 3, I = 3, 4J − I² = 3.
        let v = SVector::from([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        assert_eq!(v.dot(&(constraint() * v)), 3.0);
        // With h = 0.2 (its product's coefficient 0.4): J = 3 − 0.04.
        let v = SVector::from([1.0, 1.0, 1.0, 0.4, 0.0, 0.0]);
        assert!((v.dot(&(constraint() * v)) - (4.0 * 2.96 - 9.0)).abs() < 1e-12);
    }

    #[test]
    fn noisy_points_of_a_hyperboloid_still_give_an_ellipsoid() {
        let points: Vec<_> = (0..400)
            .map(|k| {
                let (z, a) = (f64::from(k % 20) * 0.1 - 1.0, f64::from(k));
                let r = (1.0 + 0.2 * z * z).sqrt() + 1e-3 * (7.0 * a).sin();
                ShellPoint::new(Vector3::new(r * a.cos(), r * a.sin(), z))
            })
            .collect();
        assert!(super::super::direct::start(&points, 1.0).is_none());
        assert!(start(&points, 1.0).is_some());
    }

    #[test]
    fn too_few_points_and_points_in_a_plane_have_no_ellipsoid() {
        assert!(start(&cap(1.0, 8, 0.0), 475.0).is_none());
        assert!(start(&circle(), 1.0).is_none());
    }

    #[test]
    fn the_answer_does_not_depend_on_origin_and_unit() {
        let points = cap(0.4, 500, 2.0);
        let moved: Vec<_> =
            points.iter().map(|p| ShellPoint::new(p.value * 0.01 + Vector3::new(7.0, 1.0, -3.0))).collect();
        let (here, there) = (start(&points, 475.0).unwrap(), start(&moved, 4.75).unwrap());
        assert!((there.bias - here.bias * 0.01 - Vector3::new(7.0, 1.0, -3.0)).norm() < 1e-6);
    }
}

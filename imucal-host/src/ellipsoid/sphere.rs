//! The algebraic sphere: the start that always exists.
//!
//! ```text
//! |x|² = 2 cᵀx + (R² − |c|²)
//! ```
//!
//! linear in c and R² − |c|². Biased under noise on a part of the sphere, and blind to soft iron: a start only.
//! Source: Coope 1993 (linearised sphere).

use imucal_core::{observation::ShellPoint, triad::Triad};
use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};

/// The triad that maps the cloud's sphere to radius `norm`; `None` where the points lie in a plane.
pub fn start(points: &[ShellPoint<f64>], norm: f64) -> Option<Triad<f64>> {
    let count = points.len() as f64;
    let middle: Vector3<f64> = points.iter().map(|p| p.value).sum::<Vector3<f64>>() / count;
    let (mut normal, mut image) = (Matrix4::zeros(), Vector4::zeros());
    for p in points {
        let x = p.value - middle;
        let row = Vector4::new(2.0 * x.x, 2.0 * x.y, 2.0 * x.z, 1.0);
        normal += row * row.transpose();
        image += row * x.norm_squared();
    }
    let solution = normal.cholesky()?.solve(&image);
    let centre = solution.xyz();
    let radius = (solution.w + centre.norm_squared()).sqrt();
    let triad = Triad { gain: Matrix3::identity() * (norm / radius), bias: middle + centre };
    triad.is_finite().then_some(triad)
}

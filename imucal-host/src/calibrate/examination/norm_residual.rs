//! What the residual of a norm fit could follow: columns for [`crate::calibrate::fit::score_test`].
//!
//! ```text
//! r = uᵀ δ          δ: error of the calibrated output, unit of the radius;  u: its direction, sensor's axes
//! δ = e_j φ         a bias that follows φ (time, temperature)
//! δ = e_j u_j φ     a gain that does
//! δ = e_j u_j³, e_j u_j², e_j |u_j|     cubic and quadratic terms, and a gain that differs by sign
//! δ = e_j u'_j            hysteresis; u': the direction at the rest before
//! ```
//!
//! and all spherical harmonics of degree 3 and 4 where there are observations enough; those of degree 0 to 2 are gain
//! and bias. Source: ours, from the norm form. Not tested: what a norm is blind to, that is any rotation.

use nalgebra::{DMatrix, Vector3};

use super::residual_driver::Course;
use crate::calibrate::suspicion::Follows;

/// Harmonics of a degree are tested where so many observations stand for each.
const EACH: usize = 5;

/// Columns of one test.
#[derive(Clone, Debug)]
pub struct Columns {
    /// What a residual with them follows.
    pub follows: Follows,
    /// In words, after "follows".
    pub name: String,
    /// A row an observation.
    pub values: DMatrix<f64>,
}

/// All columns to test, of calibrated directions in the order of the courses.
/// With `memory` the direction before is tested as well.
pub fn columns(directions: &[Vector3<f64>], courses: &[Course], memory: bool) -> Vec<Columns> {
    let rows = directions.len();
    let by_axis = |of: &dyn Fn(usize, f64) -> f64| {
        DMatrix::from_fn(rows, 3, |row, axis| of(row, directions[row][axis]))
    };
    let direction = |name: &str, values| Columns { follows: Follows::Direction, name: name.into(), values };
    let mut all = vec![
        direction("direction, as cubic terms make it", by_axis(&|_, u| u * u * u * u)),
        direction("direction, as quadratic terms make it", by_axis(&|_, u| u * u * u)),
        direction("direction, as gains make it that differ by sign", by_axis(&|_, u| u * u.abs())),
    ];
    if memory {
        let before = |row: usize, axis: usize| directions[row.saturating_sub(1)][axis];
        let values = DMatrix::from_fn(rows, 3, |row, axis| directions[row][axis] * before(row, axis));
        all.push(direction("the direction before, as hysteresis makes it", values));
    }
    for (degree, harmonics) in [(3, &third as &dyn Fn(&Vector3<f64>) -> Vec<f64>), (4, &fourth)] {
        let count = 2 * degree + 1;
        if rows >= EACH * (count + 9) {
            let values: Vec<Vec<f64>> = directions.iter().map(harmonics).collect();
            let values = DMatrix::from_fn(rows, count, |row, k| values[row][k]);
            all.push(direction(&format!("direction, by harmonics of degree {degree}"), values));
        }
    }
    for course in courses {
        let of = |kind: &str, values| Columns {
            follows: course.follows,
            name: format!("{}, as a {kind} makes it that changes", course.name),
            values,
        };
        all.push(of("bias", by_axis(&|row, u| u * course.values[row])));
        all.push(of("gain", by_axis(&|row, u| u * u * course.values[row])));
    }
    all
}

/// A basis of degree 3, with some of degree 1 in it.
fn third(u: &Vector3<f64>) -> Vec<f64> {
    let (x, y, z) = (u.x, u.y, u.z);
    let (xx, yy, zz) = (x * x, y * y, z * z);
    vec![x * xx, y * yy, z * zz, x * (yy - zz), y * (zz - xx), z * (xx - yy), x * y * z]
}

/// A basis of degree 4, with some of degree 0 and 2 in it.
fn fourth(u: &Vector3<f64>) -> Vec<f64> {
    let (x, y, z) = (u.x, u.y, u.z);
    let (xx, yy, zz) = (x * x, y * y, z * z);
    let (xy, yz, zx) = (x * y, y * z, z * x);
    vec![xx * xx, yy * yy, zz * zz, xy * (xx - yy), yz * (yy - zz), zx * (zz - xx), xx * yz, yy * zx, zz * xy]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::random::{Purpose, Random};

    #[test]
    fn harmonics_are_independent_of_gain_and_bias_and_of_each_other() {
        let mut random = Random::new(1, Purpose::Schedule);
        let directions: Vec<_> = (0..200).map(|_| random.normals().normalize()).collect();
        let lower = |u: &Vector3<f64>| {
            vec![1.0, u.x, u.y, u.z, u.x * u.x, u.y * u.y, u.x * u.y, u.y * u.z, u.z * u.x]
        };
        let all: Vec<Vec<f64>> =
            directions.iter().map(|u| [lower(u), third(u), fourth(u)].concat()).collect();
        let matrix = DMatrix::from_fn(200, 25, |row, k| all[row][k]);
        let values = matrix.svd(false, false).singular_values;
        assert!(values.min() > 0.01 * values.max(), "{values}");
    }
}

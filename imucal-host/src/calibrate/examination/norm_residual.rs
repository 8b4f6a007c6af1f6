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

/// The columns of one test, made when they are wanted: of a long cloud all together would fill the memory.
pub type Maker<'a> = Box<dyn Fn() -> Columns + Sync + Send + 'a>;

/// All columns to test, of calibrated directions in the order of the courses.
/// With `memory` the direction before is tested as well.
pub fn columns<'a>(directions: &'a [Vector3<f64>], courses: &'a [Course], memory: bool) -> Vec<Maker<'a>> {
    let mut all = vec![
        of_direction(directions, "direction, as cubic terms make it", |u| u * u * u * u),
        of_direction(directions, "direction, as quadratic terms make it", |u| u * u * u),
        of_direction(directions, "direction, as gains make it that differ by sign", |u| u * u.abs()),
    ];
    if memory {
        all.push(Box::new(|| Columns {
            follows: Follows::Direction,
            name: "the direction before, as hysteresis makes it".into(),
            values: DMatrix::from_fn(directions.len(), 3, |row, axis| {
                directions[row][axis] * directions[row.saturating_sub(1)][axis]
            }),
        }));
    }
    all.extend(harmonics(directions, third));
    all.extend(harmonics(directions, fourth));
    for course in courses {
        all.push(of_course(directions, course, "bias", |value, u| u * value));
        all.push(of_course(directions, course, "gain", |value, u| u * u * value));
    }
    all
}

fn of_direction<'a>(
    directions: &'a [Vector3<f64>],
    name: &'a str,
    of: impl Fn(f64) -> f64 + Sync + Send + 'a,
) -> Maker<'a> {
    Box::new(move || Columns {
        follows: Follows::Direction,
        name: name.into(),
        values: by_axis(directions, |_, u| of(u)),
    })
}

fn of_course<'a>(
    directions: &'a [Vector3<f64>],
    course: &'a Course,
    kind: &'a str,
    of: impl Fn(f64, f64) -> f64 + Sync + Send + 'a,
) -> Maker<'a> {
    Box::new(move || Columns {
        follows: course.follows,
        name: format!("{}, as a {kind} makes it that changes", course.name),
        values: by_axis(directions, |row, u| of(course.values[row], u)),
    })
}

/// All harmonics of the degree that has so many, where there are observations enough.
fn harmonics<const COUNT: usize>(
    directions: &[Vector3<f64>],
    of: fn(&Vector3<f64>) -> [f64; COUNT],
) -> Option<Maker<'_>> {
    let make = move || {
        let values: Vec<[f64; COUNT]> = directions.iter().map(of).collect();
        Columns {
            follows: Follows::Direction,
            name: format!("direction, by harmonics of degree {}", COUNT / 2),
            values: DMatrix::from_fn(directions.len(), COUNT, |row, k| values[row][k]),
        }
    };
    (directions.len() >= EACH * (COUNT + 9)).then(|| Box::new(make) as Maker<'_>)
}

fn by_axis(directions: &[Vector3<f64>], of: impl Fn(usize, f64) -> f64) -> DMatrix<f64> {
    DMatrix::from_fn(directions.len(), 3, |row, axis| of(row, directions[row][axis]))
}

/// A basis of degree 3, with some of degree 1 in it.
fn third(u: &Vector3<f64>) -> [f64; 7] {
    let (x, y, z) = (u.x, u.y, u.z);
    let (xx, yy, zz) = (x * x, y * y, z * z);
    [x * xx, y * yy, z * zz, x * (yy - zz), y * (zz - xx), z * (xx - yy), x * y * z]
}

/// A basis of degree 4, with some of degree 0 and 2 in it.
fn fourth(u: &Vector3<f64>) -> [f64; 9] {
    let (x, y, z) = (u.x, u.y, u.z);
    let (xx, yy, zz) = (x * x, y * y, z * z);
    let (xy, yz, zx) = (x * y, y * z, z * x);
    [xx * xx, yy * yy, zz * zz, xy * (xx - yy), yz * (yy - zz), zx * (zz - xx), xx * yz, yy * zx, zz * xy]
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
            directions.iter().map(|u| [&lower(u)[..], &third(u), &fourth(u)].concat()).collect();
        let matrix = DMatrix::from_fn(200, 25, |row, k| all[row][k]);
        let values = matrix.svd(false, false).singular_values;
        assert!(values.min() > 0.01 * values.max(), "{values}");
    }
}

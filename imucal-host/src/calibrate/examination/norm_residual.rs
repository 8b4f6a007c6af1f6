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

use imucal_core::{observation::ShellPoint, triad::Triad};
use nalgebra::{DMatrix, Vector3};

use super::residual_driver::Course;
use crate::calibrate::suspicion::Follows;

/// Harmonics of a degree are tested where so many observations stand for each.
const EACH: usize = 5;

/// A norm fit as its evidence keeps it.
pub(super) struct Shell<'a> {
    pub points: &'a [ShellPoint<f64>],
    pub places: &'a [usize],
    pub norm: f64,
    pub triad: &'a Triad<f64>,
    pub std: &'a Triad<f64>,
    /// Parameters of temperature that were estimated with it.
    pub warm: usize,
}

impl Shell<'_> {
    /// Calibrated directions of some points.
    pub fn directions(&self, points: &[ShellPoint<f64>]) -> Vec<Vector3<f64>> {
        points.iter().map(|point| self.triad.correct(&point.value).normalize()).collect()
    }
}

/// What a residual does with its direction; see the module's equation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// δ = e_j u_j³.
    Cubic,
    /// δ = e_j u_j².
    Quadratic,
    /// δ = e_j |u_j|.
    BySign,
    /// δ = e_j u'_j.
    Hysteresis,
    /// Harmonics of degree 3.
    Third,
    /// Harmonics of degree 4.
    Fourth,
    /// δ = e_j.
    Bias,
    /// δ = e_j u_j.
    Gain,
}

impl Shape {
    /// A row a direction, in the order of time; for hysteresis, whose first row has none before it, all directions at once.
    pub fn columns(self, directions: &[Vector3<f64>]) -> DMatrix<f64> {
        match self {
            Self::Cubic => by_axis(directions, |u| u * u * u * u),
            Self::Quadratic => by_axis(directions, |u| u * u * u),
            Self::BySign => by_axis(directions, |u| u * u.abs()),
            Self::Hysteresis => DMatrix::from_fn(directions.len(), 3, |row, axis| {
                directions[row][axis] * directions[row.saturating_sub(1)][axis]
            }),
            Self::Third => harmonics(directions, third),
            Self::Fourth => harmonics(directions, fourth),
            Self::Bias => by_axis(directions, |u| u),
            Self::Gain => by_axis(directions, |u| u * u),
        }
    }
}

/// One test: a shape, and the course that it is multiplied with.
#[derive(Clone, Debug)]
pub struct Term<'a> {
    /// What a residual with it follows.
    pub follows: Follows,
    /// In words, after "follows".
    pub name: String,
    /// What it does with the direction.
    pub shape: Shape,
    /// What it does with the observation.
    pub course: Option<&'a Course>,
}

impl Term<'_> {
    /// Its columns at observations that follow each other, the first of them `first`.
    pub fn columns(&self, first: usize, directions: &[Vector3<f64>]) -> DMatrix<f64> {
        let mut columns = self.shape.columns(directions);
        if let Some(course) = self.course {
            for (row, mut values) in columns.row_iter_mut().enumerate() {
                values *= course.value(first + row);
            }
        }
        columns
    }
}

/// All terms to test of so many observations. With `memory` the direction before is tested as well.
pub fn terms(observations: usize, courses: &[Course], memory: bool) -> Vec<Term<'_>> {
    let of_direction = |shape: Shape, name: &str| {
        let name = name.to_owned();
        Term { follows: Follows::Direction, name, shape, course: None }
    };
    let mut all = vec![
        of_direction(Shape::Cubic, "direction, as cubic terms make it"),
        of_direction(Shape::Quadratic, "direction, as quadratic terms make it"),
        of_direction(Shape::BySign, "direction, as gains make it that differ by sign"),
    ];
    if memory {
        all.push(of_direction(Shape::Hysteresis, "the direction before, as hysteresis makes it"));
    }
    for (shape, degree) in [(Shape::Third, 3), (Shape::Fourth, 4)] {
        // A degree has 2n + 1 harmonics, next to nine of gain and bias.
        if observations >= EACH * (2 * degree + 1 + 9) {
            all.push(of_direction(shape, &format!("direction, by harmonics of degree {degree}")));
        }
    }
    for course in courses {
        for (shape, kind) in [(Shape::Bias, "bias"), (Shape::Gain, "gain")] {
            let name = course.changing(kind);
            all.push(Term { follows: course.follows, name, shape, course: Some(course) });
        }
    }
    all
}

fn harmonics<const COUNT: usize>(
    directions: &[Vector3<f64>],
    of: fn(&Vector3<f64>) -> [f64; COUNT],
) -> DMatrix<f64> {
    let mut columns = DMatrix::zeros(directions.len(), COUNT);
    for (row, direction) in directions.iter().enumerate() {
        for (column, value) in of(direction).into_iter().enumerate() {
            columns[(row, column)] = value;
        }
    }
    columns
}

fn by_axis(directions: &[Vector3<f64>], of: impl Fn(f64) -> f64) -> DMatrix<f64> {
    DMatrix::from_fn(directions.len(), 3, |row, axis| of(directions[row][axis]))
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

//! What the residual of a norm fit could follow: columns for [`crate::calibrate::fit::score_test`].
//!
//! ```text
//! r = uᵀ δ          δ: error of the calibrated output, unit of the radius;  u: its direction, sensor's axes
//! δ = e_j φ         a bias that follows φ (time, temperature)
//! δ = e_j u_j φ     a gain that does
//! δ = e_j u_j³, e_j u_j², e_j |u_j|     cubic and quadratic terms, and a gain that differs by sign
//! δ = e_j u'_j            hysteresis; u': the direction at the rest before
//! δ = Rᵀ G R ρ           a field that differs from place to place: r = ρᵀ Rᵀ G b
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | R | rotation from the sensor's axes to the Earth's |
//! | b, G | the field, and its gradient, Earth's axes |
//! | ρ | from the point about which the unit was turned to the sensor, sensor's axes |
//!
//! The vector G b is fixed to the Earth. Its part along b is a bias of the sensor; the others have the columns e_j g_j and
//! e_j (u × g)_j, where g points upward in the sensor's axes.
//!
//! and all spherical harmonics of degree 3 and 4 where there are observations enough; those of degree 0 to 2 are gain
//! and bias. Source: ours, from the norm form. Not tested: what a norm is blind to, that is any rotation, and a gradient
//! along the field.

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
    /// Directions upward at each of a magnetometer's points, sensor's axes, where an accelerometer shows them.
    pub upward: Option<Vec<Vector3<f64>>>,
}

impl Shell<'_> {
    /// Calibrated directions of some points.
    pub fn directions(&self, points: &[ShellPoint<f64>]) -> Vec<Vector3<f64>> {
        points.iter().map(|point| self.triad.correct(&point.value).normalize()).collect()
    }
}

/// What a residual does with its direction; see the module's equation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape<'a> {
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
    /// δ = Rᵀ G R ρ, by the directions upward at all observations.
    Gradient(&'a [Vector3<f64>]),
    /// δ = e_j.
    Bias,
    /// δ = e_j u_j.
    Gain,
}

impl Shape<'_> {
    /// A row a direction, in the order of time, of observations that follow each other, the first of them `first`; for
    /// hysteresis, whose first row has none before it, all directions at once.
    pub fn columns(self, first: usize, directions: &[Vector3<f64>]) -> DMatrix<f64> {
        match self {
            Self::Cubic => by_axis(directions, |u| u * u * u * u),
            Self::Quadratic => by_axis(directions, |u| u * u * u),
            Self::BySign => by_axis(directions, |u| u * u.abs()),
            Self::Hysteresis => DMatrix::from_fn(directions.len(), 3, |row, axis| {
                directions[row][axis] * directions[row.saturating_sub(1)][axis]
            }),
            Self::Third => harmonics(directions, third),
            Self::Fourth => harmonics(directions, fourth),
            Self::Gradient(upward) => {
                let upward = upward.get(first..).unwrap_or_default();
                DMatrix::from_fn(directions.len(), 6, |row, column| {
                    let (u, g) = (directions[row], upward.get(row).copied().unwrap_or_default());
                    if column < 3 { g[column] } else { u.cross(&g)[column - 3] }
                })
            }
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
    pub shape: Shape<'a>,
    /// What it does with the observation.
    pub course: Option<&'a Course>,
}

impl Term<'_> {
    /// Its columns at observations that follow each other, the first of them `first`.
    pub fn columns(&self, first: usize, directions: &[Vector3<f64>]) -> DMatrix<f64> {
        let mut columns = self.shape.columns(first, directions);
        if let Some(course) = self.course {
            for (row, mut values) in columns.row_iter_mut().enumerate() {
                values *= course.value(first + row);
            }
        }
        columns
    }
}

/// All terms to test of so many observations. With `memory` the direction before is tested as well, with directions upward a
/// magnetometer's field.
pub fn terms<'a>(
    observations: usize,
    courses: &'a [Course],
    upward: Option<&'a [Vector3<f64>]>,
    memory: bool,
) -> Vec<Term<'a>> {
    let of_direction = |shape: Shape<'a>, name: &str| {
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
    if let Some(upward) = upward {
        let name = "the attitude, as a field makes it that differs from place to place".to_owned();
        let shape = Shape::Gradient(upward);
        all.push(Term { follows: Follows::Attitude, name, shape, course: None });
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

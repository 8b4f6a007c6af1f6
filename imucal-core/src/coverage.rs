//! Which directions a set of observations has seen.
//!
//! | figure | meaning |
//! | --- | --- |
//! | share | of [`CELLS`] equal-area cells of the sphere, those with an observation within [`REACH`] of their centre |
//! | flatness | least variance of the unit vectors along any axis: ⅓ for the whole sphere, 0 in a plane |
//! | distinct | observations further than [`APART`] from each other, counted up to [`MOST_DISTINCT`] |
//!
//! Not seen here: how precise an observation is. That is the condition's and the standard errors' part.

use heapless::Vec;
use nalgebra::{Matrix3, Vector3};

use crate::scalar::Scalar;

/// Equal-area cells on the sphere (a Fibonacci spiral).
pub const CELLS: u16 = 128;
/// An observation covers the cells whose centre is this near, rad (30°).
pub const REACH: f64 = core::f64::consts::FRAC_PI_6;
/// Directions nearer than this count as one, rad (15°).
pub const APART: f64 = core::f64::consts::FRAC_PI_6 / 2.0;
/// Distinct directions are counted up to here.
pub const MOST_DISTINCT: usize = 24;

/// How well the sphere of directions is covered.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Coverage<T> {
    /// Observations looked at.
    pub observations: usize,
    /// Share of the cells within reach, 0 to 1.
    pub share: T,
    /// Least variance of the unit vectors along any axis, 0 to ⅓.
    pub flatness: T,
    /// Distinct directions, up to [`MOST_DISTINCT`].
    pub distinct: usize,
}

impl<T: Scalar> Coverage<T> {
    /// Coverage of unit vectors.
    pub fn of(directions: impl Iterator<Item = Vector3<T>> + Clone) -> Self {
        Self {
            observations: directions.clone().count(),
            share: share(directions.clone()),
            flatness: flatness(directions.clone()),
            distinct: distinct(directions),
        }
    }
}

/// cos and sin of the golden angle, π (3 − √5), by which each cell lies further round than the last.
const GOLDEN: (f64, f64) = (-0.737_368_878_078_319_7, 0.675_490_294_261_523_8);
/// cos of [`REACH`].
const COS_REACH: f64 = 0.866_025_403_784_438_6;
/// cos of [`APART`].
const COS_APART: f64 = 0.965_925_826_289_068_3;

/// Centres of the cells, by turning on from cell to cell: neither sine nor double precision is asked of a device.
fn centres<T: Scalar>() -> impl Iterator<Item = Vector3<T>> {
    let (cos, sin) = (T::of(GOLDEN.0), T::of(GOLDEN.1));
    let (mut x, mut y) = (T::one(), T::zero());
    (0..u32::from(CELLS)).map(move |index| {
        let z = T::one() - T::whole(2 * index + 1) / T::whole(CELLS.into());
        let radius = (T::one() - z * z).root();
        let centre = Vector3::new(radius * x, radius * y, z);
        (x, y) = (cos * x - sin * y, sin * x + cos * y);
        centre
    })
}

fn share<T: Scalar>(directions: impl Iterator<Item = Vector3<T>> + Clone) -> T {
    let is_reached = |centre: &Vector3<T>| directions.clone().any(|u| u.dot(centre) >= T::of(COS_REACH));
    let reached = centres().filter(is_reached).fold(0u32, |count, _| count.saturating_add(1));
    T::whole(reached) / T::whole(CELLS.into())
}

/// The direction, a cell's centre, that is furthest from all that have been seen: the pose that is missing most. With it the
/// cosine of the angle to the nearest one seen; −1 where none was.
pub fn missing<T: Scalar>(directions: impl Iterator<Item = Vector3<T>> + Clone) -> (Vector3<T>, T) {
    let nearest = |centre: &Vector3<T>| {
        let cosines = directions.clone().map(|u| u.dot(centre));
        cosines.fold(-T::one(), |most, cos| if cos > most { cos } else { most })
    };
    let none = (Vector3::z(), T::one() + T::one());
    centres()
        .map(|centre| (centre, nearest(&centre)))
        .fold(none, |furthest, cell| if cell.1 < furthest.1 { cell } else { furthest })
}

fn flatness<T: Scalar>(directions: impl Iterator<Item = Vector3<T>>) -> T {
    let (mut count, mut sum, mut squares) = (0u32, Vector3::zeros(), Matrix3::zeros());
    for u in directions {
        count = count.saturating_add(1);
        sum += u;
        squares += u * u.transpose();
    }
    if count == 0 {
        return T::zero();
    }
    let per = T::one() / T::whole(count);
    let mean = sum * per;
    least_eigenvalue(&(squares * per - mean * mean.transpose()))
}

/// Rounds of Newton's method; where two eigenvalues are equal, each halves the error.
const ROUNDS: usize = 40;

/// Least eigenvalue of a symmetric positive semi-definite 3×3 matrix.
///
/// Scaled to mean 0 and Σ λ² = 6, eigenvalues are the roots of t³ − 3t − det, of which the least lies in [−2, −1]:
/// Newton's method from −2 rises to it and never beyond. (The closed form of Smith 1961 takes an arc cosine.)
fn least_eigenvalue<T: Scalar>(m: &Matrix3<T>) -> T {
    let three = T::of(3.0);
    let mean = m.trace() * T::of(1.0 / 3.0);
    let off = m - Matrix3::identity() * mean;
    let p = (off.norm_squared() / T::of(6.0)).root();
    if p <= T::EPSILON {
        return mean;
    }
    let det = (off / p).determinant();
    let mut t = T::of(-2.0);
    for _ in 0..ROUNDS {
        let (value, slope) = (t * t * t - three * t - det, three * (t * t - T::one()));
        if value >= T::zero() || slope <= T::zero() {
            break;
        }
        t -= value / slope;
    }
    let least = mean + p * t;
    if least > T::zero() { least } else { T::zero() }
}

fn distinct<T: Scalar>(directions: impl Iterator<Item = Vector3<T>>) -> usize {
    let near = T::of(COS_APART);
    let mut found: Vec<Vector3<T>, MOST_DISTINCT> = Vec::new();
    for u in directions {
        if !found.iter().any(|other| other.dot(&u) > near) && found.push(u).is_err() {
            break;
        }
    }
    found.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec as List;

    fn cap(share: f64, count: u16) -> List<Vector3<f64>> {
        (0..count)
            .map(|k| {
                let z = 1.0 - 2.0 * share * (f64::from(k) + 0.5) / f64::from(count);
                let r = (1.0 - z * z).sqrt();
                let a = 2.4 * f64::from(k);
                Vector3::new(r * a.cos(), r * a.sin(), z)
            })
            .collect()
    }

    #[test]
    fn a_full_sphere_is_covered_and_round() {
        let c = Coverage::of(cap(1.0, 500).into_iter());
        assert_eq!((c.share, c.distinct), (1.0, MOST_DISTINCT));
        assert!((c.flatness - 1.0 / 3.0).abs() < 0.01);
    }

    #[test]
    fn a_cap_has_the_variance_of_its_height() {
        let c = Coverage::of(cap(0.1, 500).into_iter());
        assert!((c.flatness - 0.2f64.powi(2) / 12.0).abs() < 1e-4, "{}", c.flatness);
    }

    #[test]
    fn a_great_circle_is_flat_though_it_reaches_half_of_the_sphere() {
        let circle = (0..100).map(|k| {
            let a = f64::from(k) * 0.0628;
            Vector3::new(a.cos(), a.sin(), 0.0)
        });
        let c = Coverage::of(circle);
        assert!(c.flatness < 1e-12 && (c.share - 0.5).abs() < 0.05);
    }

    #[test]
    fn the_pose_that_is_missing_most_is_furthest_from_all_that_were_seen() {
        let faces = [Vector3::x(), -Vector3::x(), Vector3::y(), -Vector3::y(), Vector3::z()];
        let (direction, cos) = missing::<f64>(faces.into_iter());
        assert!(direction.z < -0.98 && cos < 0.2, "{direction} {cos}");
        assert_eq!(missing::<f32>(core::iter::empty()).1, -1.0);
        // Where all is seen, no cell is further off than they are apart.
        assert!(missing(cap(1.0, 500).into_iter()).1 > 0.97);
    }

    #[test]
    fn six_faces_visited_twice_are_six_directions() {
        let faces = [Vector3::x(), -Vector3::x(), Vector3::y(), -Vector3::y(), Vector3::z(), -Vector3::z()];
        assert_eq!(Coverage::<f32>::of(faces.into_iter().chain(faces)).distinct, 6);
    }
}

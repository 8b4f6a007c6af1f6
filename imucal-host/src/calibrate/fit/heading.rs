//! The heading of a rig's base against a field that is known.
//!
//! ```text
//! n · R_z(ψ) m = a cos ψ + b sin ψ + n_z m_z = 0,   a = n_x m_x + n_y m_y,   b = n_y m_x − n_x m_y
//! ```
//!
//! | symbol | meaning | unit |
//! | --- | --- | --- |
//! | m | the known field, n frame | µT |
//! | n | normal of the plane of the outer axis and the field that was found | µT |
//! | ψ | turn of the field about the vertical; the base's heading is the opposite | rad |
//!
//! A source on the outer gimbal hides the field's component along the outer axis, so that only the plane in which the field lies is
//! found, and on which side of the axis. Not modelled: a base that is tilted by more than the accelerometer shows.

use nalgebra::{Rotation3, Vector3};

/// Headings from which a fit is started: one is within 23° of the base's.
const STARTS: usize = 8;
/// What the known field would have to be a multiple by where what was found lies on the other side of the outer axis.
const REVERSED: f64 = -1.0;

/// A heading of the base that turns the known field into the measured one, as far as this is determined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Heading {
    /// Of the field about the vertical, rad; the base's is the opposite.
    Found(f64),
    /// None does: across the outer axis the field would have to be so many times as large.
    None(f64),
}

/// The turns about the vertical that bring the known field into the plane of the outer axis and the `found` one, on the side of the axis
/// where that is: two or one.
///
/// # Errors
///
/// Where there is none: how many times as large the known field would have to be across the axis, negative where reversed.
pub fn headings(known: &Vector3<f64>, outer: &Vector3<f64>, found: &Vector3<f64>) -> Result<Vec<f64>, f64> {
    let normal = outer.cross(found);
    let a = normal.xy().dot(&known.xy());
    let b = normal.y * known.x - normal.x * known.y;
    let share = -normal.z * known.z / a.hypot(b);
    if share.is_nan() || share.abs() > 1.0 {
        return Err(if share.is_nan() { f64::INFINITY } else { share.abs() });
    }
    let (middle, half) = (b.atan2(a), share.acos());
    let across = found - outer * outer.dot(found);
    let wrapped = |angle: f64| angle.sin().atan2(angle.cos());
    let turns = [middle - half, middle + half].map(wrapped);
    let turns: Vec<f64> =
        turns.into_iter().filter(|angle| turned(known, *angle).dot(&across) > 0.0).collect();
    if turns.is_empty() { Err(REVERSED) } else { Ok(turns) }
}

/// The known field, turned about the vertical.
pub fn turned(known: &Vector3<f64>, angle: f64) -> Vector3<f64> {
    Rotation3::from_axis_angle(&Vector3::z_axis(), angle) * known
}

/// The known field, turned about the vertical by equal steps.
pub fn starts(known: Vector3<f64>) -> impl Iterator<Item = Vector3<f64>> {
    let step = std::f64::consts::TAU / STARTS as f64;
    (0..STARTS).map(move |k| turned(&known, step * k as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_heading_of_a_base_is_found_by_what_its_outer_axis_does_not_hide() {
        let known = Vector3::new(25.0, 2.0, 40.0);
        for degrees in [-170.0f64, -60.0, -29.0, 0.0, 0.3, 28.0, 45.0, 100.0, 180.0] {
            let measured = turned(&known, degrees.to_radians());
            for (axis, hidden) in [(0, -30.0), (0, 12.0), (1, 0.0), (1, 7.0), (2, -90.0), (2, 12.0)] {
                let outer = Vector3::ith(axis, 1.0);
                let found = headings(&known, &outer, &(measured + outer * hidden)).expect("there is one");
                assert_eq!(found.len(), if axis == 2 { 1 } else { 2 }, "only a horizontal axis leaves two");
                let off = |angle: f64| (turned(&known, angle) - measured).norm();
                assert!(found.iter().any(|angle| off(*angle) < 1e-9), "{degrees} {axis} {hidden}: {found:?}");
            }
        }
        // 25 µT cannot have a part of 50 µT across the axis.
        let found = headings(&known, &Vector3::x(), &Vector3::new(0.0, 50.0, 40.0));
        assert!(found.as_ref().is_err_and(|share| (share - 2.0).abs() < 0.01), "{found:?}");
        // Nor can one that dips downwards point up.
        assert_eq!(headings(&known, &Vector3::x(), &Vector3::new(25.0, -2.0, -40.0)), Err(-1.0));
        // A field without a horizontal part has no heading.
        let found = headings(&(Vector3::z() * 40.0), &Vector3::x(), &Vector3::new(0.0, 3.0, 40.0));
        assert_eq!(found, Err(f64::INFINITY));
    }
}

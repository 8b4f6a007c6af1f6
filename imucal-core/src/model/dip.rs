//! The rotation from a magnetometer's axes to an accelerometer's, from the dip of the field, which is the same in
//! every pose.
//!
//! ```text
//! r = u_fᵀ R u_b − s,   R = exp([φ]×)
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | u_f, u_b | directions of specific force and field at rest, each in its own sensor's calibrated axes |
//! | φ | rotation from the magnetometer's axes to the accelerometer's, rad |
//! | s | cosine of the angle between both: minus the sine of the dip, as specific force points up |
//!
//! A norm is blind to rotation, so an ellipsoid leaves the magnetometer in axes of its own; the angle to gravity is
//! what ties them. Source: Kok & Schön 2016 (IEEE Sensors J. 16(14)), there within one likelihood. Not observed: a
//! rotation about the field, from poses that all keep gravity at one place; not modelled: a field that varies over
//! the poses.

use nalgebra::{Matrix3, SVector, Vector3};

use super::{Model, RowSink};
use crate::{rotation::exp_with_jacobian, scalar::Scalar};

/// Poses at least: four parameters, and some to check them.
pub const LEAST_POSES: usize = 8;
/// Largest standard error of the rotation, rad (2°).
pub const LARGEST_ERROR: f64 = 0.035;
/// A field less steep than this, rad (10°), may point either way indoors.
pub const LEAST_DIP: f64 = 0.175;
/// Its sine.
pub const LEAST_SINE: f64 = 0.174_108_138;
/// A mount turned by more than this from every order of the axes has none, rad (30°).
pub const OBLIQUE: f64 = 0.52;
/// Sum of a rotation's entries along an order of the axes that is as far from it: `1 + 2 cos OBLIQUE`.
pub const LEAST_ALONG: f64 = 2.735_638_359;
/// The 24 ways in which axes can be relabelled without a mirror, as a magnetometer may lie on its board: directions of the
/// turns, and angles in twelfths of a turn. A fit starts from each of them ([`relabelling`]), the nearest to none first.
#[rustfmt::skip]
pub const RELABELLINGS: [([i8; 3], i8); 24] = [
    ([0, 0, 0], 0),
    ([1, 0, 0], 3), ([1, 0, 0], -3), ([0, 1, 0], 3), ([0, 1, 0], -3), ([0, 0, 1], 3), ([0, 0, 1], -3),
    ([1, 1, 1], 4), ([1, 1, 1], -4), ([1, 1, -1], 4), ([1, 1, -1], -4),
    ([1, -1, 1], 4), ([1, -1, 1], -4), ([-1, 1, 1], 4), ([-1, 1, 1], -4),
    ([1, 0, 0], 6), ([0, 1, 0], 6), ([0, 0, 1], 6),
    ([1, 1, 0], 6), ([1, -1, 0], 6), ([1, 0, 1], 6), ([1, 0, -1], 6), ([0, 1, 1], 6), ([0, 1, -1], 6),
];

/// Rotation vector of one of [`RELABELLINGS`], rad.
pub fn relabelling<T: Scalar>(([x, y, z], twelfths): ([i8; 3], i8)) -> Vector3<T> {
    let direction = Vector3::new(x, y, z).map(|component| T::of(component.into()));
    let length = direction.norm_squared().root();
    let angle = T::of(f64::from(twelfths) * core::f64::consts::FRAC_PI_6);
    if length > T::zero() { direction * (angle / length) } else { direction }
}

/// Whether a fit ends lower than the lowest so far, by their costs: of two that rounding alone distinguishes the first one counts.
pub fn is_lower<T: Scalar>(cost: T, lowest: T) -> bool {
    cost < T::of(0.99) * lowest
}

/// Directions of one pose, unit vectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionPair<T: Scalar> {
    /// Specific force, calibrated accelerometer axes.
    pub u_f: Vector3<T>,
    /// Field, calibrated magnetometer axes.
    pub u_b: Vector3<T>,
}

impl<T: Scalar> DirectionPair<T> {
    /// Row of the Jacobian, given R u_b and the derivative of the rotation by φ.
    #[inline]
    pub(super) fn derivative(&self, turned: &Vector3<T>, jacobian: &Matrix3<T>) -> SVector<T, 4> {
        let by_phi = jacobian.tr_mul(&turned.cross(&self.u_f));
        SVector::<T, 4>::new(by_phi.x, by_phi.y, by_phi.z, -T::one())
    }
}

/// Poses with both directions; parameters φ (3) and s.
#[derive(Clone, Copy, Debug)]
pub struct DipModel<'a, T: Scalar> {
    /// The poses.
    pub pairs: &'a [DirectionPair<T>],
}

impl<T: Scalar> Model<T, 4> for DipModel<'_, T> {
    fn rows<S: RowSink<T, 4>>(&self, theta: &SVector<T, 4>, sink: &mut S) {
        let (rotation, jacobian) = exp_with_jacobian(&theta.xyz());
        for pair in self.pairs {
            let turned = rotation * pair.u_b;
            sink.row(pair.u_f.dot(&turned) - theta.w, &pair.derivative(&turned, &jacobian));
        }
    }

    fn independent_rows(&self) -> usize {
        self.pairs.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        rotation::exp,
        solver::{LevenbergMarquardt, jacobian_check::largest_jacobian_error},
    };
    use proptest::prelude::*;
    use std::vec::Vec;

    fn direction(k: u32) -> Vector3<f64> {
        let k = f64::from(k);
        Vector3::new((1.3 * k).sin(), (2.1 * k + 0.4).cos(), (0.7 * k + 1.0).sin()).normalize()
    }

    proptest! {
        #[test]
        fn the_analytic_jacobian_is_the_numerical_one(v in prop::array::uniform4(-1.0f64..1.0)) {
            let pairs: Vec<_> = (0..5).map(|k| DirectionPair { u_f: direction(k), u_b: direction(k + 9) }).collect();
            let model = DipModel { pairs: &pairs };
            prop_assert!(largest_jacobian_error(&model, &SVector::from(v)) < 1e-8);
        }
    }

    #[test]
    fn sine_and_sum_are_those_of_the_angles() {
        assert!((LEAST_SINE - LEAST_DIP.sin()).abs() < 1e-9, "{}", LEAST_DIP.sin());
        let along = 1.0 + 2.0 * OBLIQUE.cos();
        assert!((LEAST_ALONG - along).abs() < 1e-9, "{along}");
    }

    #[test]
    fn relabellings_are_all_turns_that_map_axes_to_axes_and_no_two_are_the_same() {
        let turns: Vec<_> = RELABELLINGS.iter().map(|way| exp(&relabelling::<f64>(*way))).collect();
        for (at, turn) in turns.iter().enumerate() {
            let rounded = turn.map(f64::round);
            assert!((turn - rounded).amax() < 1e-12 && rounded.determinant() == 1.0, "{at}: {turn}");
            assert!(turns[..at].iter().all(|other| (other - turn).amax() > 0.5), "{at}");
        }
    }

    #[test]
    fn a_known_rotation_and_dip_are_found() {
        let (phi, field_n) = (Vector3::new(0.1, -0.2, 0.3), Vector3::new(0.5, 0.05, 0.85).normalize());
        let pairs: Vec<_> = (0..20)
            .map(|k| {
                let c_n_s = exp(&(direction(k) * f64::from(k)));
                DirectionPair { u_f: c_n_s * -Vector3::z(), u_b: exp(&-phi) * (c_n_s * field_n) }
            })
            .collect();
        let mut fit = LevenbergMarquardt::new(SVector::zeros(), Default::default());
        assert!(fit.run(&DipModel { pairs: &pairs }).termination.was_successful());
        assert!((fit.theta().xyz() - phi).norm() < 1e-9);
        assert!((fit.theta().w + field_n.z).abs() < 1e-9);
    }
}

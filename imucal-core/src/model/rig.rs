//! Poses of a sensor whose attitude is known: the geometry of a three-gimbal rig, from encoder angles to the rotations
//! between its frames, and attitudes that a reference gives as they are.
//!
//! ```text
//! C_t_p = R_0(outer) · R_1(middle) · R_2(inner)
//! C_o_t = (R_1 · R_2)ᵀ,   C_m_t = R_2ᵀ
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | p, o, m, t | base, outer gimbal, middle gimbal, table (inner gimbal) |
//! | R_k(angle) | active rotation about the rig's k-th axis, right-handed |
//!
//! Source: recording.md, frames. Not modelled: axes that are not at right angles, wobble, encoder errors: those are
//! effects, not geometry.

use nalgebra::{Matrix3, Quaternion, Vector3};

use crate::{
    rotation::{matrix, product},
    scalar::Scalar,
};

/// An axis of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Axis {
    /// First axis.
    X,
    /// Second axis.
    Y,
    /// Third axis.
    Z,
}

/// Gimbal axes, outermost first, in the parent's frame at zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RigAxes(pub [Axis; 3]);

/// What a sensor put out at an attitude that is known.
pub trait Pose<T: Scalar> {
    /// What its rotations follow from in addition to the pose itself.
    type Axes: Copy;

    /// Mean sensor output, nominal SI, sensor axes.
    fn value(&self) -> &Vector3<T>;

    /// Rotations between base, gimbals and table.
    fn rotations(&self, axes: &Self::Axes) -> PoseRotations<T>;
}

/// What a sensor put out at an attitude that an optical reference, or another, gives: 28 bytes in `f32`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferencePose<T: Scalar> {
    /// Sensor output, nominal SI, sensor axes.
    pub value: Vector3<T>,
    /// Takes components from the table (the body that the reference tracks) to the reference's frame, of unit length.
    pub attitude: Quaternion<T>,
}

impl<T: Scalar> ReferencePose<T> {
    /// The same pose in another precision.
    pub fn cast<U: Scalar>(&self) -> ReferencePose<U> {
        let cast = |x: T| U::of(x.wide());
        ReferencePose {
            value: self.value.map(cast),
            attitude: Quaternion::from(self.attitude.coords.map(cast)),
        }
    }
}

impl<T: Scalar> Pose<T> for ReferencePose<T> {
    type Axes = ();

    fn value(&self) -> &Vector3<T> {
        &self.value
    }

    /// There are no gimbals: what they would carry is nothing.
    fn rotations(&self, (): &()) -> PoseRotations<T> {
        let none = Matrix3::zeros();
        PoseRotations { c_p_t: matrix(&self.attitude).transpose(), c_o_t: none, c_m_t: none }
    }
}

/// What a sensor put out while the gimbals stood at some angles: 36 bytes in `f32`.
///
/// Sines and cosines are kept instead of the angles, so that a pass over poses needs no trigonometry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GimbalPose<T: Scalar> {
    /// Mean sensor output, nominal SI, sensor axes.
    pub value: Vector3<T>,
    sin: Vector3<T>,
    cos: Vector3<T>,
}

/// Rotations of one pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseRotations<T: Scalar> {
    /// Components from the base to the table.
    pub c_p_t: Matrix3<T>,
    /// Components from the outer gimbal to the table.
    pub c_o_t: Matrix3<T>,
    /// Components from the middle gimbal to the table.
    pub c_m_t: Matrix3<T>,
}

impl<T: Scalar> GimbalPose<T> {
    /// A pose at encoder angles (outer, middle, inner), rad.
    pub fn new(value: Vector3<T>, angles: &Vector3<T>) -> Self {
        Self { value, sin: angles.map(|a| a.sin()), cos: angles.map(|a| a.cos()) }
    }

    /// A pose at the sines and cosines of its encoder angles.
    pub fn turned(value: Vector3<T>, sin: Vector3<T>, cos: Vector3<T>) -> Self {
        Self { value, sin, cos }
    }

    /// The encoders' angles (outer, middle, inner), rad, in (−π, π].
    pub fn angles(&self) -> Vector3<T> {
        self.sin.zip_map(&self.cos, |sin, cos| sin.atan2(cos))
    }

    /// The same pose in another precision.
    pub fn cast<U: Scalar>(&self) -> GimbalPose<U> {
        let cast = |v: &Vector3<T>| v.map(|x| U::of(x.wide()));
        GimbalPose { value: cast(&self.value), sin: cast(&self.sin), cos: cast(&self.cos) }
    }
}

impl<T: Scalar> Pose<T> for GimbalPose<T> {
    type Axes = RigAxes;

    fn value(&self) -> &Vector3<T> {
        &self.value
    }

    fn rotations(&self, axes: &RigAxes) -> PoseRotations<T> {
        let [outer, middle, inner] = axes.0;
        let r_0 = about(outer, self.sin.x, self.cos.x);
        let r_1 = about(middle, self.sin.y, self.cos.y);
        let r_2 = about(inner, self.sin.z, self.cos.z);
        let c_t_o = product(&r_1, &r_2);
        PoseRotations {
            c_p_t: product(&r_0, &c_t_o).transpose(),
            c_o_t: c_t_o.transpose(),
            c_m_t: r_2.transpose(),
        }
    }
}

/// Active rotation about an axis.
fn about<T: Scalar>(axis: Axis, sin: T, cos: T) -> Matrix3<T> {
    let (o, i) = (T::zero(), T::one());
    match axis {
        Axis::X => Matrix3::new(i, o, o, o, cos, -sin, o, sin, cos),
        Axis::Y => Matrix3::new(cos, o, sin, o, i, o, -sin, o, cos),
        Axis::Z => Matrix3::new(cos, -sin, o, sin, cos, o, o, o, i),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    #[test]
    fn the_table_s_attitude_is_the_contract_s_product() {
        let angles = Vector3::new(0.4, -1.1, 2.3);
        let pose = GimbalPose::new(Vector3::zeros(), &angles);
        let r = pose.rotations(&RigAxes([Axis::Z, Axis::Y, Axis::X]));
        let c_t_p = Rotation3::from_axis_angle(&Vector3::z_axis(), angles.x)
            * Rotation3::from_axis_angle(&Vector3::y_axis(), angles.y)
            * Rotation3::from_axis_angle(&Vector3::x_axis(), angles.z);
        assert!((r.c_p_t - c_t_p.into_inner().transpose()).norm() < 1e-15);
    }

    #[test]
    fn along_the_inner_axis_middle_gimbal_and_table_look_the_same() {
        let pose = GimbalPose::new(Vector3::zeros(), &Vector3::new(0.4, -1.1, 2.3));
        let r = pose.rotations(&RigAxes([Axis::Z, Axis::Y, Axis::X]));
        assert!((r.c_m_t * Vector3::x() - Vector3::x()).norm() < 1e-15);
        assert!((r.c_o_t * Vector3::y() - r.c_m_t * Vector3::y()).norm() < 1e-15);
    }
}

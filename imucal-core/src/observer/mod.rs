//! Observations while samples arrive: nothing of the past is kept but sums.
//!
//! | observer | gives |
//! | --- | --- |
//! | [`rest`] | a [`Rest`](crate::observation::Rest) when it has ended |
//! | [`turn`] | a turn between two rests, in a fixed number of blocks |
//! | [`inertial`] | both, in the order in which they come about |
//! | [`thermometer`] | whether a thermometer jumps or is stuck |
//! | [`cloud`] | points of a magnetometer that are far apart, in a fixed number of slots |
//!
//! An observer is plain data of fixed size: it can be stopped after any sample, kept, and gone on with.

pub mod cloud;
pub mod inertial;
pub mod rest;
mod ring;
pub mod thermometer;
pub mod turn;

use nalgebra::Vector3;

use crate::scalar::Scalar;

/// What the sensors say at one time; nominal SI, sensor frame `s`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<T: Scalar> {
    /// Time on the IMU's clock, µs.
    pub time: u64,
    /// Specific force `f_s`, m/s². Not finite where it was missed, clipped or is stuck.
    pub acc: Vector3<T>,
    /// Rate `w_ns_s`, rad/s, likewise; `None` without a gyroscope.
    pub gyr: Option<Vector3<T>>,
    /// Temperature, °C, where this sample has one.
    pub temperature: Option<T>,
}

impl<T: Scalar> Sample<T> {
    /// Every sensor has a value.
    #[inline]
    pub fn is_whole(&self) -> bool {
        is_finite(&self.acc) && self.gyr.as_ref().is_none_or(is_finite)
    }
}

/// By components: at a device's `opt-level = "s"` iterators are loops. What is not finite times zero is NaN: one comparison for three.
#[inline]
fn is_finite<T: Scalar>(v: &Vector3<T>) -> bool {
    let none = T::zero();
    v.x * none + v.y * none + v.z * none == none
}

/// Likewise.
#[inline]
fn squared_distance<T: Scalar>(a: &Vector3<T>, b: &Vector3<T>) -> T {
    let (x, y, z) = (a.x - b.x, a.y - b.y, a.z - b.z);
    x * x + y * y + z * z
}

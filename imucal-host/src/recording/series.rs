//! A triad's samples in time, and which of them count.

use nalgebra::Vector3;

/// Samples of a triad, a row each.
#[derive(Clone, Copy, Debug)]
pub struct Series<'a> {
    /// Time, s; empty where rows are the clock.
    pub time: &'a [f64],
    /// Samples, nominal SI (µT).
    pub values: &'a [Vector3<f64>],
    /// Rows in which they are usable.
    pub usable: &'a [bool],
    /// Usual interval, s.
    pub interval: f64,
}

//! What the thresholds of the rest test came to, as reports show it; [`segmentation`](super::segmentation) tries them.

use std::ops::Range;

use nalgebra::Vector3;

/// How the recording was cut into rests.
#[derive(Clone, Debug)]
pub struct SegmentationReport {
    /// Rows of each rest, half-open.
    pub rests: Vec<Range<usize>>,
    /// Chosen multiple of the initial rest's variance.
    pub multiplier: f64,
    /// The threshold it makes, (m/s²)².
    pub threshold: f64,
    /// The reference was the initial rest.
    pub from_initial_rest: bool,
    /// What each threshold tried came to.
    pub trials: Vec<ThresholdTrial>,
    /// Largest relative move of a diagonal gain, of any sensor, over the thresholds.
    pub gain_spread: f64,
}

/// One threshold of the rest test.
#[derive(Clone, Debug)]
pub struct ThresholdTrial {
    /// Multiple of the reference variance.
    pub multiplier: f64,
    /// Rests found.
    pub rests: usize,
    /// Accelerometer gain's diagonal, where it could be fitted.
    pub acc_gain: Option<Vector3<f64>>,
    /// Its rms residual, m/s².
    pub acc_rms: Option<f64>,
    /// Gyroscope gain's diagonal, where it could be fitted.
    pub gyr_gain: Option<Vector3<f64>>,
}

/// Largest relative move of any diagonal gain among those given.
pub fn gain_spread(gains: impl Iterator<Item = Vector3<f64>> + Clone) -> f64 {
    (0..3)
        .map(|axis| {
            let (low, high) = gains.clone().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), g| {
                (low.min(g[axis].abs()), high.max(g[axis].abs()))
            });
            if high > low { (high - low) / (0.5 * (high + low)) } else { 0.0 }
        })
        .fold(0.0, f64::max)
}

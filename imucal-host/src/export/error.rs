//! Why nothing was exported.

use crate::recording::{SensorKind, Unit};

/// Why a target's file cannot be written.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExportError {
    /// The target consists of noise.
    #[error(
        "{target}: found no noise, expected that of the unit; add --noise with the file of `imucal noise --json`"
    )]
    NoNoise {
        /// The target.
        target: &'static str,
    },
    /// The target consists of a calibration.
    #[error("{target}: found no calibration, expected one; name the file of `imucal calibrate --out`")]
    NoCalibration {
        /// The target.
        target: &'static str,
    },
    /// The noise of a sensor that the target needs is not known.
    #[error(
        "{target}: found no {what} of {sensor} ({why}), expected it; record the unit untouched for longer, and run `imucal noise` again"
    )]
    NotKnown {
        /// The target.
        target: &'static str,
        /// Which sensor.
        sensor: SensorKind,
        /// What is not known.
        what: &'static str,
        /// Why.
        why: String,
    },
    /// The calibration lacks a sensor that the target needs.
    #[error("{target}: found no calibration of {sensor}, expected one; calibrate it")]
    NoSensor {
        /// The target.
        target: &'static str,
        /// Which sensor.
        sensor: SensorKind,
    },
    /// Raw values are in a unit that the target does not take.
    #[error(
        "{target}: the calibration of {sensor} takes {found}, the target {expected}; calibrate a recording in {expected}"
    )]
    WrongUnit {
        /// The target.
        target: &'static str,
        /// Which sensor.
        sensor: SensorKind,
        /// Unit of the calibration.
        found: Unit,
        /// What the target takes.
        expected: Unit,
    },
    /// The noise is in units of no known size, or in others than calibrated values.
    #[error(
        "{target}: the noise of {sensor} is in {found}, expected {expected}; estimate it from a recording in {expected}"
    )]
    NoiseUnit {
        /// The target.
        target: &'static str,
        /// Which sensor.
        sensor: SensorKind,
        /// Unit of the noise.
        found: String,
        /// What is expected.
        expected: Unit,
    },
    /// Calibrated axes are not the raw ones but for small angles.
    #[error(
        "{target}: the gain of {sensor} swaps, mirrors or turns its axes, which the target's parameters cannot; bring the raw \
         values into the unit's axes and calibrate again"
    )]
    OtherAxes {
        /// The target.
        target: &'static str,
        /// Which sensor.
        sensor: SensorKind,
    },
    /// The rate is not one.
    #[error("--rate: found {found}, expected a number of samples a second from 0.01 to 1000000")]
    Rate {
        /// What was found, Hz.
        found: f64,
    },
}

//! Why a triad is not corrected in integers, with the figures that say by how much.

use core::fmt;

use crate::record::RawUnit;

/// Why a triad is not corrected in integers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum IntegerRefusal {
    /// The record's raw samples are in another unit: [`Triad::in_unit`](crate::triad::Triad::in_unit) and
    /// [`TemperatureTerms::in_unit`](crate::temperature::TemperatureTerms::in_unit) take a triad to counts.
    NotCounts {
        /// The record's.
        unit: RawUnit,
    },
    /// A figure of the triad, or of its temperature terms, is infinite or NaN.
    NotFinite,
    /// What the sensor puts out at zero input lies beyond three quarters of the range. Words of an unsigned converter
    /// become counts by `(word ^ 0x8000) as i16`, and its triad by `in_unit(-32768.0, 1.0)`.
    BiasOutOfRange {
        /// Sensor axis, from 0.
        axis: usize,
        /// Its bias, counts.
        bias: f64,
    },
    /// A result could overflow 32 bits.
    TooFine {
        /// Bits behind the point that were asked for.
        fraction: i8,
        /// Most bits with which none can.
        finest: i8,
    },
    /// A result could overflow 32 bits at any scale.
    TooLarge {
        /// Power of two that a calibrated axis could come near, calibrated unit.
        power: i32,
    },
    /// A temperature term is larger than any of a sensor.
    TermOutOfRange {
        /// The slope, in counts or 1 per kelvin, or the reference, °C.
        value: f64,
        /// Most that it may be, by magnitude.
        most: f64,
    },
}

impl fmt::Display for IntegerRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotCounts { unit } => write!(f, "raw samples are in {}, not in counts", unit.symbol()),
            Self::NotFinite => write!(f, "a figure of the triad is not finite"),
            Self::BiasOutOfRange { axis, bias } => {
                write!(f, "the bias of axis {axis} is {bias:.1} counts, expected -24576 to 24576")
            }
            Self::TooFine { fraction, finest } => {
                write!(f, "{fraction} bits behind the point overflow 32 bits, {finest} do not")
            }
            Self::TooLarge { power } => write!(f, "values up to 2^{power} fit no scale of 32 bits"),
            Self::TermOutOfRange { value, most } => {
                write!(f, "a temperature term is {value}, expected at most {most} by magnitude")
            }
        }
    }
}

impl core::error::Error for IntegerRefusal {}

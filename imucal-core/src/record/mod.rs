//! The calibration record: what a sensor carries with it, a few hundred bytes in its flash or next to its log.
//!
//! # Layout
//!
//! All numbers little-endian.
//!
//! ```text
//! 0        4       5       6          8                  8+n       12+n
//! ├────────┼───────┼───────┼──────────┼───────────────────┼─────────┤
//! │ "IMUC" │ major │ minor │ n, u16   │ payload, n bytes  │ CRC-32  │  rest of the flash page: ignored
//! └────────┴───────┴───────┴──────────┴───────────────────┴─────────┘
//! ```
//!
//! * **magic** first: an erased page (all ones or zeros) is distinguished from a damaged record.
//! * **major, minor** before the length: a reader knows whether the rest means what it thinks it means.
//! * **n** frames the payload, so that an older reader can step over fields appended after its time.
//! * **payload**: [`CalibrationRecord`] in postcard 1, fields in the order of declaration. `f32` is 4 bytes,
//!   integers wider than a byte and lengths are LEB128 varints, an `Option` is a byte 0 or 1 and then the value, a
//!   unit is a byte, text is a length and UTF-8. Arrays carry no length. What is appended to it:
//!
//!   | from | three options each, in the order of [`Sensor::ALL`] |
//!   | --- | --- |
//!   | 1.1 | [`Provenance`] |
//!   | 1.2 | [`TemperatureQuality`] |
//!   | 2.0 | [`CurvatureRecord`], then [`NonlinearRecord`] |
//!
//! * **CRC-32** (ISO-HDLC: polynomial 0x04C11DB7 reflected, initial value and final xor 0xFFFF_FFFF, as in zlib)
//!   over everything before it. It finds damage, not forgery.
//!
//! # Stability policy
//!
//! * The **major** rises when the layout, the order or the meaning of a field changes, or where a record cannot be
//!   applied without what was added ([`order`](Order)). A newer major is refused.
//! * The **minor** rises when fields are appended to [`CalibrationRecord`] (never to a struct inside it), or variants
//!   to [`RawUnit`]. An older reader steps over appended fields and refuses, as malformed, only a record that uses a
//!   variant it does not know.
//! * A newer reader still reads every older version.
//! * A record is written in the lowest version that holds it: one of first order whose triads have one provenance is
//!   1.0, byte for byte.
//! * The golden bytes of each version stay in `tests/golden` and are decoded for ever.
//!
//! # What is refused
//!
//! [`CalibrationRecord::check`] judges every record that is read or written: units, gain, bias, temperature terms and
//! figures of merit against what sensors are like. Its limits stand in `plausibility.rs`.
//!
//! A record holds what belongs to the sensor. What belongs to the rig (levelling tilt, gimbal iron) is not stored.

mod codec;
mod date;
mod identity;
mod order;
mod payload;
mod plausibility;
mod provenance;
mod validity;

pub use codec::{DecodeError, EncodeError, MAX_LEN, VERSION, decode, decode_as, decode_into, encode};
pub use date::Date;
pub use identity::{Match, SensorIdentity, WrongSensor};
pub use order::{CurvatureRecord, FirstOrder, HigherOrder, NonlinearRecord, Order, TemperatureQuality};
pub use provenance::Provenance;
pub use validity::{Defect, Figures};

use heapless::String;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::scalar::Scalar;
use crate::temperature::TemperatureTerms;
use crate::triad::Triad;

/// Name of a calibration model, such as `"T9"` or `"I14"`; at most 8 bytes. Made by `"T9".parse()`.
pub type ModelName = String<8>;

/// The calibration of one unit: whose it is, when it was made, and one triad for each sensor calibrated.
///
/// `O` says how far its terms go: a [`CalibrationRecord`] without further word is of [`FirstOrder`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "", deserialize = "O: Default"))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CalibrationRecord<O = FirstOrder> {
    /// The unit that was calibrated.
    pub sensor: SensorIdentity,
    /// The day of the last calibration that the record took, UTC.
    pub date: Date,
    /// Accelerometer.
    pub acc: Option<TriadRecord<O>>,
    /// Gyroscope.
    pub gyr: Option<TriadRecord<O>>,
    /// Magnetometer.
    pub mag: Option<TriadRecord<O>>,
    /// Of each triad in the order of [`Sensor::ALL`], where it comes from; `None` where that is as `sensor` and `date`
    /// say. Appended in minor 1.
    #[serde(skip)]
    pub provenance: [Option<Provenance>; 3],
}

impl<O> CalibrationRecord<O> {
    /// A record without a triad.
    pub fn empty(sensor: SensorIdentity, date: Date) -> Self {
        Self { sensor, date, acc: None, gyr: None, mag: None, provenance: [const { None }; 3] }
    }

    /// The calibration of one triad; `None` where the record has none.
    pub fn triad(&self, sensor: Sensor) -> Option<&TriadRecord<O>> {
        match sensor {
            Sensor::Accelerometer => self.acc.as_ref(),
            Sensor::Gyroscope => self.gyr.as_ref(),
            Sensor::Magnetometer => self.mag.as_ref(),
        }
    }

    /// The triads the record holds, in the order of [`Sensor::ALL`].
    pub fn triads(&self) -> impl Iterator<Item = (Sensor, &TriadRecord<O>)> {
        Sensor::ALL.into_iter().filter_map(|sensor| Some((sensor, self.triad(sensor)?)))
    }
}

/// One of the three triads of a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Sensor {
    /// Specific force.
    Accelerometer,
    /// Angular rate.
    Gyroscope,
    /// Magnetic field.
    Magnetometer,
}

impl Sensor {
    /// All, in the record's order.
    pub const ALL: [Self; 3] = [Self::Accelerometer, Self::Gyroscope, Self::Magnetometer];

    /// `acc`, `gyr` or `mag`.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Accelerometer => "acc",
            Self::Gyroscope => "gyr",
            Self::Magnetometer => "mag",
        }
    }
}

/// The calibration of one triad: to first order `calibrated = gain · (raw − bias)`, and how well it was found.
///
/// Axes: raw values in the sensor's own, calibrated ones in the frame of the accelerometer's orthogonal axes. Plain
/// arrays, row by row, as they are stored; [`TriadRecord::triad`] computes with them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "", deserialize = "O: Default"))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TriadRecord<O = FirstOrder> {
    /// `unit_out` per `unit_in`; one row for each calibrated axis. Finite and not singular.
    pub gain: [[f32; 3]; 3],
    /// Raw output at zero input, `unit_in`, sensor axes. Finite.
    pub bias: [f32; 3],
    /// Unit of raw samples.
    pub unit_in: RawUnit,
    /// Unit of calibrated values.
    pub unit_out: RawUnit,
    /// The model fitted.
    pub model: ModelName,
    /// Temperature dependence of bias (`unit_in`/K) and scale (1/K); `None` where it was not calibrated.
    pub temperature: Option<TemperatureTerms<f32>>,
    /// How good the fit was.
    pub quality: FitQuality,
    /// Terms beyond these; nothing for [`FirstOrder`]. Appended after the triads.
    #[serde(skip)]
    pub order: O,
}

impl<O> TriadRecord<O> {
    /// The same triad with these terms in place of its own beyond the first order.
    pub fn with_order<P>(self, order: P) -> TriadRecord<P> {
        let Self { gain, bias, unit_in, unit_out, model, temperature, quality, order: _ } = self;
        TriadRecord { gain, bias, unit_in, unit_out, model, temperature, quality, order }
    }

    /// Gain and bias to compute with, in either precision; `f64` holds the stored numbers exactly.
    #[inline]
    pub fn triad<T: Scalar>(&self) -> Triad<T> {
        let of = |entry: f32| T::of(f64::from(entry));
        let [[a, b, c], [d, e, f], [g, h, i]] = self.gain.map(|row| row.map(of));
        Triad { gain: Matrix3::new(a, b, c, d, e, f, g, h, i), bias: Vector3::from(self.bias.map(of)) }
    }
}

/// How well a triad was determined by the observations it was fitted to. All figures finite.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FitQuality {
    /// Standard error of each entry of the gain, `unit_out` per `unit_in`, ≥ 0; 0 for an entry held fixed.
    pub gain_std: [[f32; 3]; 3],
    /// Standard error of the bias, `unit_in`, ≥ 0.
    pub bias_std: [f32; 3],
    /// Root mean square residual of the fit, ≥ 0: `unit_out`, for a gyroscope the attitude error in rad.
    pub rms: f32,
    /// The same over observations held out of the fit; `None` where none were.
    pub held_out_rms: Option<f32>,
    /// Observations fitted to (rests, turns or field samples).
    pub observations: u32,
    /// Parameters fitted, those of the rig included.
    pub parameters: u8,
    /// Condition of the column-normalised Jacobian, ≥ 1; beyond some hundreds the parameters are not separable.
    pub condition: f32,
    /// Share of equal-area cells of the sphere of directions within reach of a sample, 0 to 1.
    pub coverage: f32,
    /// Magnitude of the field in `unit_out` where the field was not known (gain of determinant 1); `None` elsewhere.
    pub field_norm: Option<f32>,
}

/// Unit of a triad's raw or calibrated values.
///
/// The order of the variants is the record's format: append only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(into = "u8", try_from = "u8")]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RawUnit {
    /// Metre per second squared.
    MetrePerSecondSquared,
    /// Standard gravity, 9.80665 m/s².
    StandardGravity,
    /// Thousandth of standard gravity.
    MilliGravity,
    /// Converter counts, whatever the sensor's scale.
    Counts,
    /// Radian per second.
    RadianPerSecond,
    /// Degree per second.
    DegreePerSecond,
    /// Microtesla.
    MicroTesla,
    /// Milligauss, 0.1 µT.
    MilliGauss,
    /// Gauss, 100 µT.
    Gauss,
    /// Nanotesla.
    NanoTesla,
    /// No unit: a field relative to its own magnitude.
    Arbitrary,
}

impl RawUnit {
    /// All, in the order of the format.
    pub const ALL: [Self; 11] = [
        Self::MetrePerSecondSquared,
        Self::StandardGravity,
        Self::MilliGravity,
        Self::Counts,
        Self::RadianPerSecond,
        Self::DegreePerSecond,
        Self::MicroTesla,
        Self::MilliGauss,
        Self::Gauss,
        Self::NanoTesla,
        Self::Arbitrary,
    ];

    /// How recordings and calibrations write it.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::MetrePerSecondSquared => "m/s^2",
            Self::StandardGravity => "g",
            Self::MilliGravity => "mg",
            Self::Counts => "counts",
            Self::RadianPerSecond => "rad/s",
            Self::DegreePerSecond => "deg/s",
            Self::MicroTesla => "uT",
            Self::MilliGauss => "mG",
            Self::Gauss => "G",
            Self::NanoTesla => "nT",
            Self::Arbitrary => "a.u.",
        }
    }

    /// The unit of a symbol; `None` for an unknown one. Case counts: `mg` accelerates, `mG` magnetises.
    pub fn from_symbol(symbol: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|unit| unit.symbol() == symbol)
    }
}

impl From<RawUnit> for u8 {
    /// The position in [`RawUnit::ALL`], as the record has it.
    fn from(unit: RawUnit) -> Self {
        unit as Self
    }
}

impl TryFrom<u8> for RawUnit {
    type Error = &'static str;

    fn try_from(position: u8) -> Result<Self, Self::Error> {
        Self::ALL.get(usize::from(position)).copied().ok_or("no unit of this version")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unit_is_found_by_its_symbol_and_its_position() {
        for unit in RawUnit::ALL {
            assert_eq!(RawUnit::from_symbol(unit.symbol()), Some(unit));
            assert_eq!(RawUnit::try_from(u8::from(unit)), Ok(unit));
        }
        assert_eq!(RawUnit::from_symbol("MG"), None);
    }
}

//! Messages of a calibration session on board: raw samples in, advice out, and what came of it.

use heapless::Vec;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::{
    accept::Refusal,
    fit::Units,
    observer::Sample,
    record::{Defect, RawUnit, Sensor},
    session::{Session, SessionSettings, guide::Guide},
};

/// Samples of one message at the most.
pub const SAMPLES: usize = 8;
/// How long a pose may have to be held, s: less than how long a rest is timed for.
const LONGEST_HOLD: f32 = 60.0;

/// A session to begin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CaptureTask {
    /// Local gravity, m/s².
    pub gravity: f32,
    /// Length of the field, µT, where it is known.
    pub field: Option<f32>,
    /// Whether the field points down at this place, where it is known.
    pub field_down: Option<bool>,
    /// How long a pose is to be held, s.
    pub hold: f32,
    /// Accelerometer, gyroscope, magnetometer.
    pub sensors: [CaptureSensor; 3],
}

/// One of the sensors of a session.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CaptureSensor {
    /// Error of a calibrated vector at which it is done, as a share of its length; zero: it is not asked for.
    pub target: f32,
    /// Nominal value beyond which it clips, SI (µT).
    pub full_scale: f32,
    /// Unit of its raw samples.
    pub unit_in: RawUnit,
    /// `raw = offset + per_unit · nominal SI`.
    pub offset: f32,
    /// See `offset`; not zero.
    pub per_unit: f32,
}

impl CaptureSensor {
    /// A raw value in nominal SI (µT).
    #[inline]
    pub fn nominal(&self, raw: [f32; 3]) -> Vector3<f32> {
        Vector3::from(raw).map(|value| (value - self.offset) / self.per_unit)
    }

    /// Units to restate a fit by.
    pub fn units(&self, sensor: Sensor) -> Units {
        let calibrated = match sensor {
            Sensor::Accelerometer => RawUnit::MetrePerSecondSquared,
            Sensor::Gyroscope => RawUnit::RadianPerSecond,
            Sensor::Magnetometer => RawUnit::MicroTesla,
        };
        Units { raw: self.unit_in, calibrated, offset: self.offset, per_unit: self.per_unit }
    }
}

impl CaptureTask {
    /// As the session takes it; `None` for figures that cannot be.
    pub fn settings(&self) -> Option<SessionSettings> {
        let usable = |sensor: &CaptureSensor| {
            let finite =
                sensor.target.is_finite() && sensor.offset.is_finite() && sensor.per_unit.is_finite();
            finite && sensor.target >= 0.0 && sensor.full_scale > 0.0 && sensor.per_unit != 0.0
        };
        let field = self.field.unwrap_or(1.0);
        let sized = [self.gravity, field, self.hold].iter().all(|size| size.is_finite() && *size > 0.0);
        let possible = sized && self.hold <= LONGEST_HOLD && self.sensors.iter().all(usable);
        possible.then(|| SessionSettings {
            gravity: self.gravity,
            field: self.field,
            field_down: self.field_down,
            target: self.sensors.map(|sensor| sensor.target),
            full_scale: self.sensors.map(|sensor| sensor.full_scale),
            hold: self.hold,
            ..SessionSettings::default()
        })
    }

    /// Takes a raw sample into a session of this task.
    #[inline(never)]
    pub fn push<const N: usize, const B: usize, const M: usize>(
        &self,
        session: &mut Session<N, B, M>,
        sample: &RawSample,
    ) {
        let [acc, gyr, mag] = sample.raw;
        let [of_acc, of_gyr, of_mag] = &self.sensors;
        let acc = acc.map_or(Vector3::repeat(f32::NAN), |raw| of_acc.nominal(raw));
        let gyr = gyr.map(|raw| of_gyr.nominal(raw));
        let temperature = Some(sample.temperature).filter(|value| value.is_finite());
        session.push(&Sample { time: sample.time, acc, gyr, temperature });
        if let Some(field) = mag.map(|raw| of_mag.nominal(raw)) {
            session.push_field(&field);
        }
    }
}

/// A raw sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RawSample {
    /// Time on the IMU's clock, µs.
    pub time: u64,
    /// Accelerometer, gyroscope, magnetometer; `None` where the sample has none. NaN: it was missed.
    pub raw: [Option<[f32; 3]>; 3],
    /// °C; NaN where it is not measured.
    pub temperature: f32,
}

/// How far a session on board is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CaptureState {
    /// Samples taken so far; the index of the next in a message is this, modulo 65 536.
    pub samples: u32,
    /// What its guide says.
    pub guide: Guide,
}

/// What a session came to for one sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum CaptureOutcome {
    /// Its calibration is accepted, surer than the one before, and in use.
    Adopted,
    /// There were too few observations for a fit.
    TooLittle,
    /// The fit is not accepted.
    Refused(Refusal),
    /// The one in use is surer: expected errors of a calibrated vector, as shares of its length.
    Surer {
        /// Of the one in use.
        stored: f32,
        /// Of the new one.
        new: f32,
    },
    /// No sensor can be like that.
    Implausible(Defect),
    /// The one in use has terms that a session does not fit: nonlinear ones, or of temperature to second order.
    HigherOrder,
    /// The magnetometer in use is in the accelerometer's axes, the new one in its own.
    OwnAxes,
    /// The record in use is in axes that are not known: its accelerometer and the new one differ by more than a rotation.
    OtherAxes {
        /// The largest share by which they do; infinite in other units, and where one is a mirror image.
        strain: f32,
        /// Allowed at most.
        most: f32,
    },
    /// The one in use gives its values in another unit.
    OtherUnit,
}

/// Samples of a message.
pub type RawSamples = Vec<RawSample, SAMPLES>;

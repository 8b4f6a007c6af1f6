//! Whether a new calibration takes the place of the stored one: only if it is accepted, and surer by its own errors.
//!
//! The gyroscope's bias at start-up is apart from that: where the sensor lies still, the bias of the day is better known than any
//! record's.

use nalgebra::{Matrix3, Vector3};

use super::{
    Session,
    bias::{MeanRate, RestBias},
};
use crate::{
    accept::{Refusal, relative_error},
    fit::Units,
    observation::Rest,
    record::{Sensor, TriadRecord},
    triad::Triad,
};

/// Why a calibration does not take the place of the stored one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NotStored {
    /// There were too few observations for a fit.
    NoEstimate,
    /// The fit is not accepted.
    Refused(Refusal),
    /// The stored one is surer: expected errors of a calibrated vector, as shares of its length.
    Surer {
        /// Of the stored one.
        stored: f32,
        /// Of the new one.
        new: f32,
    },
}

impl<const N: usize, const B: usize, const M: usize> Session<N, B, M> {
    /// A sensor's calibration for the record, if it is accepted and surer than the one `stored`.
    ///
    /// # Errors
    ///
    /// [`NotStored`]; then the stored one is to be kept.
    pub fn better(
        &self,
        sensor: Sensor,
        units: &Units,
        stored: Option<&TriadRecord>,
    ) -> Result<TriadRecord, NotStored> {
        let estimate = self.estimate(sensor).ok_or(NotStored::NoEstimate)?;
        estimate.verdict.map_err(NotStored::Refused)?;
        let new = estimate.record(model_of(sensor), units);
        if let Some(stored) = stored {
            let length = self.length(sensor);
            let (old, now) = (stated_error(stored, length), stated_error(&new, length));
            let surer = now < old;
            if !surer {
                return Err(NotStored::Surer { stored: old, new: now });
            }
        }
        Ok(new)
    }

    /// Length of a calibrated vector that errors are compared at.
    fn length(&self, sensor: Sensor) -> f32 {
        match sensor {
            Sensor::Accelerometer => self.settings.gravity,
            Sensor::Gyroscope => 1.0,
            Sensor::Magnetometer => {
                let seen = self.estimate(sensor).and_then(|mag| mag.field_norm);
                self.settings.field.or(seen).unwrap_or(1.0)
            }
        }
    }
}

/// Name of the model that a session fits.
pub fn model_of(sensor: Sensor) -> &'static str {
    match sensor {
        Sensor::Accelerometer => "T9",
        Sensor::Gyroscope => "K9",
        Sensor::Magnetometer => "E9",
    }
}

/// Error of a calibrated vector of that length to be expected from what a record states, as a share of it.
#[inline]
pub fn stated_error(record: &TriadRecord, length: f32) -> f32 {
    let rows = |rows: &[[f32; 3]; 3]| Matrix3::from(*rows).transpose();
    let gain = rows(&record.gain);
    let std = Triad { gain: rows(&record.quality.gain_std), bias: Vector3::from(record.quality.bias_std) };
    relative_error(&gain, &std, length * libm::sqrtf(3.0 / gain.norm_squared()))
}

/// The gyroscope's bias of the day from a rest at start-up, raw unit of the record: less `stored` where it differs by more than
/// three standard errors of both, `None` where it does not, or where the rest turned (its rates spread more than `most`, rad/s).
///
/// A bias that is further off than a record may be wrong by is none: the sensor is turned steadily, or is another one.
#[inline]
pub fn bias_of_the_day(rest: &Rest<f32>, stored: &TriadRecord, units: &Units, most: f32) -> Option<[f32; 3]> {
    let count = rest.gyr.count();
    let variance = rest.gyr.variance();
    let mean = RestBias::of(core::iter::once(MeanRate {
        mean: rest.gyr.mean(),
        variance: variance / (count.max(1) as f32),
        count,
    }))?;
    let now = mean.mean * units.per_unit + Vector3::repeat(units.offset);
    let off = now - Vector3::from(stored.bias);
    let error = Vector3::from(stored.quality.bias_std).zip_map(&(mean.std() * units.per_unit), libm::hypotf);
    let moved = off.iter().zip(error.iter()).any(|(off, error)| libm::fabsf(*off) > 3.0 * error);
    let limit = libm::fabsf(most * units.per_unit);
    let possible = off.iter().all(|off| libm::fabsf(*off) <= limit);
    (moved && possible).then(|| now.into())
}

//! Whether a new calibration takes the place of the stored one: only if it is accepted, and surer by its own errors.
//!
//! The gyroscope's bias at start-up is apart from that: where the sensor lies still, the bias of the day is better known than any
//! record's.

use nalgebra::{Matrix3, Vector3};

use super::{
    Session,
    axes::{Axes, LARGEST_STRAIN},
    bias::{MeanRate, RestBias},
};
use crate::{
    accept::{Quantity, Refusal, relative_error},
    fit::Units,
    record::{FitQuality, Order, RawUnit, Sensor, TriadRecord},
    temperature::TemperatureTerms,
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
    /// The stored one has terms that a session does not fit: nonlinear ones, or of temperature to second order.
    HigherOrder,
    /// The stored magnetometer is in the accelerometer's axes, the new one in its own.
    OwnAxes,
    /// The record is in axes that are not known from its accelerometer and the session's, which differ by more than a rotation.
    OtherAxes {
        /// The largest share by which they do; infinite in other units, and where one is a mirror image.
        strain: f32,
        /// Allowed at most.
        most: f32,
    },
    /// The stored one gives its values in another unit, on which what reads them relies.
    OtherUnit,
}

impl<const N: usize, const B: usize, const M: usize> Session<N, B, M> {
    /// A sensor's calibration for the record, in the `axes` of that, if it is accepted and surer than the one `stored`, in whose unit it
    /// is: that of the raw values, where a field of unknown length was kept so, or the calibrated one of `units`. Terms of
    /// temperature are those of the stored one, from the mean temperature of the session's rests on. One with terms beyond the first
    /// order stays, since gain and bias were fitted with them, and a session fits none.
    ///
    /// # Errors
    ///
    /// [`NotStored`]; then the stored one is to be kept.
    pub fn better<O: Order>(
        &self,
        sensor: Sensor,
        units: &Units,
        stored: Option<&TriadRecord<O>>,
        axes: &Axes,
    ) -> Result<TriadRecord, NotStored> {
        let estimate = self.estimate(sensor).ok_or(NotStored::NoEstimate)?;
        estimate.verdict.map_err(NotStored::Refused)?;
        let mut new = estimate.record(model_of(sensor), units);
        // What warmth does is not seen here, and stays as it is known.
        new.temperature = known_terms(&new, stored, self.poses.temperature());
        self.surer(sensor, new, units, stored, axes)
    }

    /// A new calibration, if it is surer than the one `stored`. A magnetometer in the accelerometer's axes takes the place of one in axes
    /// of its own, whose errors do not say how it lies, and not the other way round.
    #[inline(never)]
    pub(super) fn surer<O: Order>(
        &self,
        sensor: Sensor,
        mut new: TriadRecord,
        units: &Units,
        stored: Option<&TriadRecord<O>>,
        axes: &Axes,
    ) -> Result<TriadRecord, NotStored> {
        if sensor != Sensor::Magnetometer || self.is_aligned() {
            brought(sensor, &mut new, axes)?;
        }
        if let Some(stored) = stored {
            if !stored.order.is_first_order() {
                return Err(NotStored::HigherOrder);
            }
            give_in(stored.unit_out, &mut new, units)?;
            match (is_turned(sensor, &stored.gain), is_turned(sensor, &new.gain)) {
                (true, false) => return Err(NotStored::OwnAxes),
                (false, true) => return Ok(new),
                _ => {}
            }
            let length = |record: &FitQuality| record.field_norm.unwrap_or(self.length(sensor));
            let old = stated_error(stored, length(&stored.quality));
            let now = stated_error(&new, length(&new.quality));
            let surer = now < old;
            if !surer {
                return Err(NotStored::Surer { stored: old, new: now });
            }
        }
        Ok(new)
    }

    /// Terms of temperature make no sensor's axes better that are mirrored.
    pub(super) fn not_mirrored(&self, sensor: Sensor) -> Result<(), NotStored> {
        match self.estimate(sensor).map(|estimate| estimate.verdict) {
            Some(Err(refusal @ Refusal::Implausible { what: Quantity::Axes, .. })) => {
                Err(NotStored::Refused(refusal))
            }
            _ => Ok(()),
        }
    }

    /// The magnetometer is in the accelerometer's axes.
    fn is_aligned(&self) -> bool {
        self.estimate(Sensor::Magnetometer).is_some_and(|mag| mag.alignment_error.is_some())
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

/// Gives a triad's values in the unit of the stored one. An arbitrary unit has no size that anything relies on.
#[inline]
fn give_in(unit: RawUnit, new: &mut TriadRecord, units: &Units) -> Result<(), NotStored> {
    if unit == new.unit_out || unit == RawUnit::Arbitrary {
        return Ok(());
    }
    if unit != units.raw {
        return Err(NotStored::OtherUnit);
    }
    let size = libm::fabsf(units.per_unit);
    new.unit_out = unit;
    new.gain = new.gain.map(|row| row.map(|entry| entry * units.per_unit));
    new.quality.gain_std = new.quality.gain_std.map(|row| row.map(|std| std * size));
    new.quality.rms *= size;
    new.quality.field_norm = new.quality.field_norm.map(|norm| norm * size);
    Ok(())
}

/// Brings a triad from the session's axes into those of the record.
#[inline]
fn brought(sensor: Sensor, new: &mut TriadRecord, axes: &Axes) -> Result<(), NotStored> {
    let other = |strain: f32| NotStored::OtherAxes { strain, most: LARGEST_STRAIN };
    match axes {
        Axes::Own => Ok(()),
        Axes::Of(rotated) => rotated.turn(sensor, new).then_some(()).ok_or(other(f32::INFINITY)),
        Axes::Unknown { strain } => Err(other(*strain)),
    }
}

/// A magnetometer's gain is in the accelerometer's axes: in those of its own it is upper triangular.
fn is_turned(sensor: Sensor, gain: &[[f32; 3]; 3]) -> bool {
    sensor == Sensor::Magnetometer && !is_upper_triangular(gain)
}

/// A gain, by rows, is in axes of the sensor's own.
#[inline]
pub(super) fn is_upper_triangular([_, second, third]: &[[f32; 3]; 3]) -> bool {
    let ([y, ..], [z, w, _]) = (second, third);
    *y == 0.0 && *z == 0.0 && *w == 0.0
}

/// Terms of temperature of the `stored` calibration, from a reference temperature, °C, on; `None` without any, or in another raw unit.
pub(super) fn known_terms<O>(
    new: &TriadRecord,
    stored: Option<&TriadRecord<O>>,
    reference: f32,
) -> Option<TemperatureTerms<f32>> {
    let known = stored.filter(|stored| stored.unit_in == new.unit_in)?.temperature?;
    Some(known.from_reference(reference))
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
pub fn stated_error<O>(record: &TriadRecord<O>, length: f32) -> f32 {
    let rows = |rows: &[[f32; 3]; 3]| Matrix3::from(*rows).transpose();
    let gain = rows(&record.gain);
    let std = Triad { gain: rows(&record.quality.gain_std), bias: Vector3::from(record.quality.bias_std) };
    relative_error(&gain, &std, length * libm::sqrtf(3.0 / gain.norm_squared()))
}

/// What a gyroscope shows at rest after a start beyond its record: the calibrated rate to take off, rad/s; `None` where it is
/// within three standard errors of the record and of the rest, or beyond `most` on any axis, rad/s.
///
/// A rate that is further off than a bias moves from day to day is none: the sensor is turned steadily, or is another one.
/// Earth's rate is part of what is taken off. `still`: calibrated by `stored`.
#[inline]
pub fn bias_of_the_day<O>(still: &MeanRate<f32>, stored: &TriadRecord<O>, most: f32) -> Option<Vector3<f32>> {
    let bias = RestBias::of(core::iter::once(*still))?;
    let gain = stored.triad::<f32>().gain;
    let stated = Vector3::from(stored.quality.bias_std);
    let squares = gain.component_mul(&gain) * stated.component_mul(&stated);
    let error = bias.std().zip_map(&squares, |rest, stated| libm::sqrtf(rest * rest + stated));
    let moved = bias.mean.iter().zip(error.iter()).any(|(rate, error)| libm::fabsf(*rate) > 3.0 * error);
    let possible = bias.mean.iter().all(|rate| libm::fabsf(*rate) <= most);
    (moved && possible).then_some(bias.mean)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A gyroscope in counts, a thousand a rad/s, whose bias is known to 2 counts.
    fn stored() -> TriadRecord {
        let quality = FitQuality {
            gain_std: [[0.0; 3]; 3],
            bias_std: [2.0; 3],
            rms: 0.0,
            held_out_rms: None,
            observations: 9,
            parameters: 9,
            condition: 1.0,
            coverage: 1.0,
            field_norm: None,
        };
        TriadRecord {
            gain: [[1e-3, 0.0, 0.0], [0.0, 1e-3, 0.0], [0.0, 0.0, 1e-3]],
            bias: [0.0; 3],
            unit_in: RawUnit::Counts,
            unit_out: RawUnit::RadianPerSecond,
            model: "K9".parse().unwrap_or_default(),
            temperature: None,
            quality,
            order: Default::default(),
        }
    }

    fn still(z: f32, variance: f32) -> MeanRate<f32> {
        MeanRate { mean: Vector3::new(0.0, 0.0, z), variance: Vector3::repeat(variance), count: 1 }
    }

    #[test]
    fn a_rate_at_rest_beyond_three_standard_errors_of_both_is_taken_off() {
        // Of the record 2e-3 rad/s, of the rest 1.5e-3: together 2.5e-3.
        assert_eq!(bias_of_the_day(&still(7.4e-3, 2.25e-6), &stored(), 0.02), None);
        let rate = bias_of_the_day(&still(7.6e-3, 2.25e-6), &stored(), 0.02);
        assert_eq!(rate, Some(Vector3::new(0.0, 0.0, 7.6e-3)));
    }

    #[test]
    fn a_rate_that_no_bias_reaches_is_a_turn_and_not_taken_off() {
        assert_eq!(bias_of_the_day(&still(0.021, 1e-8), &stored(), 0.02), None);
        assert_eq!(bias_of_the_day(&still(f32::NAN, 1e-8), &stored(), 0.02), None);
    }
}

//! Apply: a recording corrected by the core, in `f32`, as the device would.

use std::{convert::Infallible, ops::RangeInclusive};

mod stream;
mod thermometer;

pub use self::{
    stream::{Applied, StreamError, stream},
    thermometer::Thermometer,
};

use imucal_core::{
    corrector::{Compensator, FullCorrector},
    nonlinearity::TooSteep,
    record::{CalibrationRecord, HigherOrder, Match},
};
use nalgebra::Vector3;

use crate::{
    recording::{Nominal, Recording, SensorKind, Triple, Unit},
    store::{StoredCalibration, StoredTriad},
};

/// Why a calibration does not fit a recording.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ApplyError {
    /// It was made for another sensor.
    #[error(
        "{recording}: recorded with serial `{connected}`, but the calibration was made for `{recorded}`; use the \
         calibration of this sensor, or --other-serial"
    )]
    WrongSensor {
        /// The recording.
        recording: String,
        /// Serial of the calibration.
        recorded: String,
        /// Serial of the recording.
        connected: String,
    },
    /// Raw values are in another unit than the calibration expects.
    #[error(
        "{recording}: {sensor} is in {found}, the calibration takes {expected}; calibrate a recording in {found}, or \
         export this one in {expected}"
    )]
    WrongUnit {
        /// The recording.
        recording: String,
        /// Which sensor.
        sensor: SensorKind,
        /// Unit of the recording.
        found: Unit,
        /// Unit of the calibration.
        expected: Unit,
    },
    /// A count is another part of a unit than the manifest says.
    #[error(
        "{recording}: {sensor}: in the calibration a count is {ratio:.2} times what [counts] of the recording says, \
         expected {least} to {most} times; the calibration was made at another full scale: calibrate at this one, or \
         correct [counts]",
        least = COUNT.start(),
        most = COUNT.end()
    )]
    OtherCounts {
        /// The recording.
        recording: String,
        /// Which sensor.
        sensor: SensorKind,
        /// The count of the calibration over that of the manifest.
        ratio: f64,
    },
    /// The recording is what this calibration has made of another one.
    #[error(
        "{recording}: {sensor} was corrected by this calibration before, as [calibrated] of the manifest says; take the recording \
         as the sensor gave it"
    )]
    AlreadyCorrected {
        /// The recording.
        recording: String,
        /// Which sensor.
        sensor: SensorKind,
    },
    /// Nothing in the recording is calibrated.
    #[error(
        "{recording}: holds none of the sensors that the calibration is for; check that both belong together"
    )]
    NothingToApply {
        /// The recording.
        recording: String,
    },
}

/// A calibrated count over a nominal one: sensors differ by some percent, full scales by a factor of two.
const COUNT: RangeInclusive<f64> = 0.67..=1.5;

/// The calibration's count over the manifest's; `None` where either is unknown, and of a magnetometer, whose nominal scale nothing checks.
fn count_ratio(triple: &Triple, triad: &StoredTriad, kind: SensorKind) -> Option<f64> {
    let known = triple.unit == Unit::Counts && kind != SensorKind::Mag;
    let per_si = triad.unit_out.per_si().filter(|_| known)?;
    Some(triad.triad().gain.determinant().abs().cbrt() / per_si * triple.nominal.per_unit.abs())
}

/// Whether a calibration belongs to a recording; a warning where nobody can know. `other_serial` turns the
/// refusal of another serial into a warning.
///
/// # Errors
/// [`ApplyError`] for another serial, another unit, another full scale, samples that the calibration has corrected before, or nothing in
/// common.
pub fn check(
    recording: &Recording,
    stored: &StoredCalibration,
    record: &CalibrationRecord<HigherOrder>,
    other_serial: bool,
) -> Result<Option<String>, ApplyError> {
    let serial = recording.manifest.sensor.serial.as_deref().unwrap_or_default();
    let warning = match record.made_for(serial) {
        Ok(Match::Confirmed) => None,
        Ok(Match::Unknown) => Some(format!(
            "{}: no serial on one side, so nobody can know whether the calibration is this sensor's; name it below \
             [sensor] before calibrating",
            recording.name
        )),
        Err(wrong) if other_serial => {
            Some(format!("{}: {wrong}; taken all the same by --other-serial", recording.name))
        }
        Err(wrong) => {
            return Err(ApplyError::WrongSensor {
                recording: recording.name.clone(),
                recorded: wrong.recorded.into(),
                connected: wrong.connected.into(),
            });
        }
    };
    let mut any = false;
    for kind in SensorKind::ALL {
        let (Some(triple), Some(triad)) = (recording.sensor(kind), stored.triad(kind)) else {
            continue;
        };
        any = true;
        if recording.manifest.is_calibrated_by(kind, &triad.identity()) {
            return Err(ApplyError::AlreadyCorrected { recording: recording.name.clone(), sensor: kind });
        }
        if triple.unit != triad.unit_in {
            return Err(ApplyError::WrongUnit {
                recording: recording.name.clone(),
                sensor: kind,
                found: triple.unit,
                expected: triad.unit_in,
            });
        }
        if let Some(ratio) = count_ratio(triple, triad, kind).filter(|ratio| !COUNT.contains(ratio)) {
            return Err(ApplyError::OtherCounts { recording: recording.name.clone(), sensor: kind, ratio });
        }
    }
    if any { Ok(warning) } else { Err(ApplyError::NothingToApply { recording: recording.name.clone() }) }
}

/// The recording with every calibrated sensor corrected, in calibrated units; the others as they were.
///
/// # Errors
/// [`TooSteep`] for nonlinear terms that cannot be undone, which no record that was read holds.
pub fn apply(
    recording: &Recording,
    stored: &StoredCalibration,
    record: &CalibrationRecord<HigherOrder>,
) -> Result<Recording, TooSteep> {
    Ok(Correction::new(stored, record)?.correct(recording.clone()))
}

/// A calibration that corrects a recording part after part; what a sensor's correction keeps from row to row goes on
/// from one part to the next.
pub struct Correction<'a> {
    stored: &'a StoredCalibration,
    /// Of each sensor that is calibrated.
    cores: [Option<Compensator<f32, FullCorrector<f32>>>; 3],
    thermometer: Thermometer,
}

impl<'a> Correction<'a> {
    /// A correction that begins with the first row.
    ///
    /// # Errors
    /// As [`apply`].
    pub fn new(
        stored: &'a StoredCalibration,
        record: &CalibrationRecord<HigherOrder>,
    ) -> Result<Self, TooSteep> {
        let [acc, gyr, mag] = SensorKind::ALL.map(|kind| corrector(record, kind));
        Ok(Self { stored, cores: [acc?, gyr?, mag?], thermometer: Thermometer::new(stored) })
    }

    /// The next rows as [`apply`] gives them.
    #[must_use]
    pub fn correct(&mut self, part: Recording) -> Recording {
        let warmth = self.thermometer.readings(&part);
        let cores = &mut self.cores;
        let corrected = corrected_by(part, self.stored, &warmth, |kind, raw, warmth| {
            let Some(core) = &mut cores[kind as usize] else { return Ok(raw.to_vec()) };
            Ok(raw.iter().zip(warmth).map(|(raw, warmth)| core.apply_at(raw, *warmth)).collect())
        });
        corrected.unwrap_or_else(|never: Infallible| match never {})
    }

    /// What of the temperatures so far is not as the calibration's terms want it, a sentence each.
    #[must_use]
    pub fn remarks(&self) -> Vec<String> {
        self.thermometer.remarks()
    }
}

/// What corrects samples of a sensor in `f32`, one after another, as a device does: raw values in the calibration's
/// `unit_in`, °C or NaN next to each, calibrated values in its `unit_out`. `None` for a sensor that has no calibration.
///
/// # Errors
/// As [`apply`].
pub fn corrector(
    record: &CalibrationRecord<HigherOrder>,
    kind: SensorKind,
) -> Result<Option<Compensator<f32, FullCorrector<f32>>>, TooSteep> {
    let Some(triad) = record.triad(kind.into()) else { return Ok(None) };
    Ok(Some(Compensator::new(FullCorrector::<f32>::try_from(triad)?)))
}

/// The same, corrected by whoever is called: with a sensor, its raw samples, and the temperature of each, °C, the last that was read, or NaN.
///
/// # Errors
/// Those of `correct`.
pub fn apply_by<E>(
    recording: &Recording,
    stored: &StoredCalibration,
    correct: impl FnMut(SensorKind, &[Vector3<f32>], &[f32]) -> Result<Vec<Vector3<f32>>, E>,
) -> Result<Recording, E> {
    let warmth = Thermometer::new(stored).readings(recording);
    corrected_by(recording.clone(), stored, &warmth, correct)
}

fn corrected_by<E>(
    mut corrected: Recording,
    stored: &StoredCalibration,
    warmth: &[f32],
    mut correct: impl FnMut(SensorKind, &[Vector3<f32>], &[f32]) -> Result<Vec<Vector3<f32>>, E>,
) -> Result<Recording, E> {
    for kind in SensorKind::ALL {
        let Some(stored) = stored.triad(kind) else { continue };
        let triple = match kind {
            SensorKind::Acc => &mut corrected.acc,
            SensorKind::Gyr => &mut corrected.gyr,
            SensorKind::Mag => &mut corrected.mag,
        };
        let Some(triple) = triple else { continue };
        let raw: Vec<_> = triple.raw_samples().collect();
        let nominal = nominal_out(stored, triple.nominal);
        for (value, calibrated) in triple.values.iter_mut().zip(correct(kind, &raw, warmth)?) {
            *value = calibrated.map(|x| nominal.to_si(f64::from(x)));
        }
        triple.unit = stored.unit_out;
        triple.full_scale = triple.full_scale_si().map(|scale| scale * nominal.per_unit.abs());
        triple.nominal = nominal;
        triple.single = true;
        set_unit(&mut corrected, kind, stored.unit_out);
        corrected.manifest.calibrated.of_mut(kind).get_or_insert_default().push(stored.identity());
    }
    Ok(corrected)
}

/// Conversion of calibrated values; counts without their offset, which the calibration took out.
fn nominal_out(stored: &StoredTriad, before: Nominal) -> Nominal {
    match stored.unit_out.per_si() {
        Some(per_unit) => Nominal { offset: 0.0, per_unit },
        None => Nominal { offset: 0.0, per_unit: before.per_unit },
    }
}

fn set_unit(recording: &mut Recording, kind: SensorKind, unit: Unit) {
    let units = &mut recording.manifest.units;
    let counts = &mut recording.manifest.counts;
    let ranges = &mut recording.manifest.ranges;
    let (slot, counts, range) = match kind {
        SensorKind::Acc => (&mut units.acc, &mut counts.acc, &mut ranges.acc),
        SensorKind::Gyr => (&mut units.gyr, &mut counts.gyr, &mut ranges.gyr),
        SensorKind::Mag => (&mut units.mag, &mut counts.mag, &mut ranges.mag),
    };
    let before = slot.per_si().or(counts.map(|c| c.per_unit));
    *slot = unit;
    let after = unit.per_si().or(counts.map(|c| c.per_unit));
    if let (Some(range), Some(before), Some(after)) = (range.as_mut(), before, after) {
        *range *= (after / before).abs();
    }
    match (unit, counts.as_mut()) {
        (Unit::Counts, Some(counts)) => counts.offset = 0.0,
        _ => *counts = None,
    }
}

//! The calibration in use, and what of it is in flash.

use imucal_core::{
    corrector::{Compensator, Corrector},
    link::{Fault, RecordState},
    record::{self, CalibrationRecord, Date, DecodeError, Match, Sensor, SensorIdentity, TriadRecord},
};
use nalgebra::Vector3;

#[derive(Clone, Debug)]
pub(super) struct Calibration {
    /// The unit at hand.
    pub(super) unit: SensorIdentity,
    record: CalibrationRecord,
    correctors: [Option<Compensator<f32>>; 3],
    /// What is in flash.
    pub(super) state: RecordState,
    /// What is in use is not what is in flash.
    pub(super) unsaved: bool,
}

impl Calibration {
    /// Of a unit, before its flash was looked at.
    pub(super) fn new(unit: SensorIdentity) -> Self {
        let record = CalibrationRecord {
            sensor: unit.clone(),
            date: Date::from_days(0),
            acc: None,
            gyr: None,
            mag: None,
        };
        Self { unit, record, correctors: [None; 3], state: RecordState::Empty, unsaved: false }
    }

    /// Uses a record, if it is this unit's; says what it is.
    #[inline(never)]
    pub(super) fn load(&mut self, bytes: &[u8]) -> RecordState {
        let record = match record::decode(bytes) {
            Ok(record) => record,
            Err(DecodeError::UnsupportedVersion { .. }) => return RecordState::NewerFormat,
            Err(_) => return RecordState::Unusable,
        };
        let state = match record.made_for(&self.unit.serial) {
            Ok(Match::Confirmed) => RecordState::InUse,
            Ok(Match::Unknown) => RecordState::Unconfirmed,
            Err(_) => return RecordState::OtherSensor,
        };
        self.put_in_use(&record);
        state
    }

    /// By reference, and out of line: a record takes 0.7 KiB of stack wherever it is passed by value.
    #[inline(never)]
    fn put_in_use(&mut self, record: &CalibrationRecord) {
        for (corrector, sensor) in self.correctors.iter_mut().zip(Sensor::ALL) {
            *corrector = record.triad(sensor).map(|triad| Compensator::new(Corrector::from(triad)));
        }
        self.record.clone_from(record);
    }

    /// Why a record is not this unit's to use, if it is not.
    #[inline(never)]
    pub(super) fn refusal(&self, bytes: &[u8]) -> Option<Fault> {
        match record::decode(bytes) {
            Ok(record) => record.made_for(&self.unit.serial).is_err().then_some(Fault::OtherSensor),
            Err(DecodeError::UnsupportedVersion { .. }) => Some(Fault::NewerFormat),
            Err(_) => Some(Fault::BadRecord),
        }
    }

    /// What is in flash must not be overwritten unasked.
    pub(super) fn is_occupied(&self) -> bool {
        matches!(self.state, RecordState::OtherSensor | RecordState::NewerFormat)
    }

    /// Takes a triad that was fitted here.
    #[inline(never)]
    pub(super) fn adopt(&mut self, sensor: Sensor, triad: &TriadRecord, date: Date) {
        let corrector = Some(Compensator::new(Corrector::from(triad)));
        let (slot, place) = match sensor {
            Sensor::Accelerometer => (&mut self.record.acc, 0),
            Sensor::Gyroscope => (&mut self.record.gyr, 1),
            Sensor::Magnetometer => (&mut self.record.mag, 2),
        };
        *slot = Some(triad.clone());
        if let Some(place) = self.correctors.get_mut(place) {
            *place = corrector;
        }
        self.record.date = date;
        self.record.sensor = self.unit.clone();
        self.unsaved = true;
    }

    /// The record in use, as bytes.
    #[inline(never)]
    pub(super) fn encode<'b>(&self, buffer: &'b mut [u8; record::MAX_LEN]) -> Result<&'b [u8], Fault> {
        record::encode(&self.record, buffer).map_err(|_| Fault::BadRecord)
    }

    /// Corrects a sample; `None` without a calibration of that sensor.
    #[inline]
    pub(super) fn correct(&mut self, sensor: Sensor, raw: [f32; 3], temperature: f32) -> Option<[f32; 3]> {
        let corrector = self.correctors.get_mut(sensor as usize)?.as_mut()?;
        Some(corrector.apply_at(&Vector3::from(raw), temperature).into())
    }
}

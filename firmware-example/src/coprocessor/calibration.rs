//! The calibration in use, and what of it is in flash.

use imucal_core::{
    corrector::Corrector,
    link::{Fault, RecordState},
    record::{self, CalibrationRecord, Date, DecodeError, Match, Sensor, SensorIdentity, TriadRecord},
};
use nalgebra::Vector3;

#[derive(Clone, Debug)]
pub(super) struct Calibration {
    /// The unit at hand.
    pub(super) unit: SensorIdentity,
    record: CalibrationRecord,
    correctors: [Option<Corrector<f32>>; 3],
    /// What is in flash.
    pub(super) state: RecordState,
    /// What is in use is not what is in flash.
    pub(super) unsaved: bool,
}

impl Calibration {
    /// Of a unit, with what its flash holds; empty where it holds nothing.
    pub(super) fn stored(unit: SensorIdentity, bytes: &[u8]) -> Self {
        let record = CalibrationRecord {
            sensor: unit.clone(),
            date: Date::from_days(0),
            acc: None,
            gyr: None,
            mag: None,
        };
        let mut calibration =
            Self { unit, record, correctors: [None; 3], state: RecordState::Empty, unsaved: false };
        if !bytes.is_empty() {
            calibration.state = calibration.load(bytes);
        }
        calibration
    }

    /// Uses a record, if it is this unit's; says what it is.
    pub(super) fn load(&mut self, bytes: &[u8]) -> RecordState {
        match self.check(bytes) {
            Ok((record, confirmed)) => {
                self.correctors = Sensor::ALL.map(|sensor| record.triad(sensor).map(Corrector::from));
                self.record = record;
                match confirmed {
                    Match::Confirmed => RecordState::InUse,
                    Match::Unknown => RecordState::Unconfirmed,
                }
            }
            Err(Fault::OtherSensor) => RecordState::OtherSensor,
            Err(Fault::NewerFormat) => RecordState::NewerFormat,
            Err(_) => RecordState::Unusable,
        }
    }

    /// Reads a record, and asks whether it is this unit's.
    #[inline(never)]
    pub(super) fn check(&self, bytes: &[u8]) -> Result<(CalibrationRecord, Match), Fault> {
        let record = record::decode(bytes).map_err(|error| match error {
            DecodeError::UnsupportedVersion { .. } => Fault::NewerFormat,
            _ => Fault::BadRecord,
        })?;
        let confirmed = record.made_for(&self.unit.serial).map_err(|_| Fault::OtherSensor)?;
        Ok((record, confirmed))
    }

    /// What is in flash must not be overwritten unasked.
    pub(super) fn is_occupied(&self) -> bool {
        matches!(self.state, RecordState::OtherSensor | RecordState::NewerFormat)
    }

    /// Takes a triad that was fitted here.
    pub(super) fn adopt(&mut self, sensor: Sensor, triad: TriadRecord, date: Date) {
        let corrector = Some(Corrector::from(&triad));
        let (slot, place) = match sensor {
            Sensor::Accelerometer => (&mut self.record.acc, 0),
            Sensor::Gyroscope => (&mut self.record.gyr, 1),
            Sensor::Magnetometer => (&mut self.record.mag, 2),
        };
        *slot = Some(triad);
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
    pub(super) fn correct(&self, sensor: Sensor, raw: [f32; 3], temperature: f32) -> Option<[f32; 3]> {
        let corrector = self.correctors.get(sensor as usize)?.as_ref()?;
        Some(corrector.apply_at(&Vector3::from(raw), temperature).into())
    }
}

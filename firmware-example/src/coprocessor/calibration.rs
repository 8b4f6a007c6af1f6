//! The calibration in use, and what of it is in flash.
//!
//! Records of every order are used, in as many bytes as one of the first order may have; on the micro:bit, whose memory is small,
//! only those of the first order.

use imucal_core::{
    corrector::Compensator,
    link::{Fault, RecordState},
    record::{
        self, CalibrationRecord, Date, DecodeError, Match, Order, RawUnit, Sensor, SensorIdentity,
        TriadRecord,
    },
};
#[cfg(microbit)]
use imucal_core::{corrector::Corrector as OfOrder, record::FirstOrder as Held};
#[cfg(not(microbit))]
use imucal_core::{corrector::FullCorrector as OfOrder, record::HigherOrder as Held};
use nalgebra::Vector3;

/// A record as this board holds it.
pub(super) type HeldRecord = CalibrationRecord<Held>;
/// A triad of it.
pub(super) type HeldTriad = TriadRecord<Held>;
type Compensating = Compensator<f32, OfOrder<f32>>;

/// The newest version that this board uses.
pub(super) const VERSION: (u8, u8) = Held::VERSION;

/// What corrects by a triad; `None` for terms that cannot be undone, which no record that was read holds.
#[cfg_attr(microbit, expect(clippy::unnecessary_fallible_conversions, reason = "other boards' can fail"))]
fn compensating(triad: &HeldTriad) -> Option<Compensating> {
    OfOrder::try_from(triad).ok().map(Compensator::new)
}

#[derive(Clone, Debug)]
pub(super) struct Calibration {
    /// The unit at hand.
    pub(super) unit: SensorIdentity,
    /// Of the board's own samples.
    units: [Option<RawUnit>; 3],
    record: HeldRecord,
    correctors: [Option<Compensating>; 3],
    /// What is in flash.
    pub(super) state: RecordState,
    /// What is in use is not what is in flash.
    pub(super) unsaved: bool,
}

impl Calibration {
    /// Of a unit, before its flash was looked at.
    pub(super) fn new(unit: SensorIdentity, units: [Option<RawUnit>; 3]) -> Self {
        let record = CalibrationRecord::empty(unit.clone(), Date::from_days(0));
        Self { unit, units, record, correctors: [None; 3], state: RecordState::Empty, unsaved: false }
    }

    /// Uses a record, if it is this unit's; says what it is.
    #[inline(never)]
    pub(super) fn load(&mut self, bytes: &[u8]) -> RecordState {
        let mut record = HeldRecord::empty(SensorIdentity::default(), Date::from_days(0));
        // By reference: each copy of a record takes 0.7 to 1.4 KiB of stack.
        let record = match record::decode_into(bytes, &mut record) {
            Ok(()) => &record,
            Err(DecodeError::UnsupportedVersion { .. }) => return RecordState::NewerFormat,
            Err(_) => return RecordState::Unusable,
        };
        let state = match record.made_for(&self.unit.serial) {
            Ok(Match::Confirmed) => RecordState::InUse,
            Ok(Match::Unknown) => RecordState::Unconfirmed,
            Err(_) => return RecordState::OtherSensor,
        };
        if self.other_unit(record).is_some() {
            return RecordState::Unusable;
        }
        self.put_in_use(record);
        state
    }

    /// By reference, and out of line: a record takes 0.7 to 1.4 KiB of stack wherever it is passed by value.
    #[inline(never)]
    fn put_in_use(&mut self, record: &HeldRecord) {
        for (corrector, sensor) in self.correctors.iter_mut().zip(Sensor::ALL) {
            *corrector = record.triad(sensor).and_then(compensating);
        }
        self.record.clone_from(record);
    }

    /// Why a record is not this unit's to use, if it is not.
    #[inline(never)]
    pub(super) fn refusal(&self, bytes: &[u8]) -> Option<Fault> {
        let mut record = HeldRecord::empty(SensorIdentity::default(), Date::from_days(0));
        match record::decode_into(bytes, &mut record) {
            Ok(()) if record.made_for(&self.unit.serial).is_err() => Some(Fault::OtherSensor),
            Ok(()) => self.other_unit(&record),
            Err(DecodeError::UnsupportedVersion { .. }) => Some(Fault::NewerFormat),
            Err(DecodeError::Unusable(defect)) => Some(Fault::Implausible(defect)),
            Err(_) => Some(Fault::BadRecord),
        }
    }

    /// The first triad of a record for another unit than the board puts out.
    fn other_unit(&self, record: &HeldRecord) -> Option<Fault> {
        record.triads().find_map(|(sensor, triad)| self.check_unit(sensor, triad.unit_in).err())
    }

    /// The board puts out samples of that unit, or none of that sensor.
    ///
    /// # Errors
    ///
    /// [`Fault::OtherUnit`].
    pub(super) fn check_unit(&self, sensor: Sensor, unit_in: RawUnit) -> Result<(), Fault> {
        match self.units.get(sensor as usize) {
            Some(Some(expected)) if *expected != unit_in => {
                Err(Fault::OtherUnit { sensor, expected: *expected })
            }
            _ => Ok(()),
        }
    }

    /// There is a calibration in use, of whatever sensor.
    pub(super) fn is_in_use(&self) -> bool {
        self.correctors.iter().any(Option::is_some)
    }

    /// What is in flash must not be overwritten unasked.
    pub(super) fn is_occupied(&self) -> bool {
        matches!(self.state, RecordState::OtherSensor | RecordState::NewerFormat)
    }

    /// Takes a triad that was fitted here.
    ///
    /// # Errors
    ///
    /// [`Fault::Implausible`]; what was in use still is.
    #[inline(never)]
    pub(super) fn adopt(&mut self, sensor: Sensor, triad: &TriadRecord, date: Date) -> Result<(), Fault> {
        triad.check(sensor).map_err(Fault::Implausible)?;
        #[cfg(not(microbit))]
        let triad = &triad.clone().with_order(Held::default());
        self.record.adopt(sensor, triad, &self.unit, date);
        if let Some(place) = self.correctors.get_mut(sensor as usize) {
            *place = compensating(triad);
        }
        self.unsaved = true;
        Ok(())
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

    /// Corrects a sample of all sensors.
    pub(super) fn correct_all(
        &mut self,
        raw: &[Option<[f32; 3]>; 3],
        temperature: f32,
    ) -> [Option<[f32; 3]>; 3] {
        let mut values = [None; 3];
        for ((value, sensor), raw) in values.iter_mut().zip(Sensor::ALL).zip(raw) {
            *value = raw.and_then(|raw| self.correct(sensor, raw, temperature));
        }
        values
    }

    /// The record in use.
    pub(super) fn record(&self) -> &HeldRecord {
        &self.record
    }
}

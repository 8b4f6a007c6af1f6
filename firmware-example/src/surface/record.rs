//! The record: bytes, days, identity, units.

use core::fmt::Display;

use imucal_core::record::{
    self, CalibrationRecord, Defect, Figures, MAX_LEN, RawUnit, Sensor, TriadRecord, WrongSensor,
};

use super::write;
use crate::RECORD;

#[inline(never)]
pub(super) fn reach_all() {
    dates();
    units();
    refusals();
    if let Ok(record) = reach!(record::decode(RECORD)) {
        whole(&record);
    }
}

#[inline(never)]
fn whole(record: &CalibrationRecord) {
    let mut page = [0xFF; MAX_LEN];
    // The result borrows the page: looked at here, it need not leave the call.
    let _bytes = reach!(record::encode(record, &mut page));
    let _usable = reach!(record::CalibrationRecord::check(record));
    let _whose = reach!(record::CalibrationRecord::made_for(record, "00300017"));
    let _triad = reach!(record::CalibrationRecord::triad(record, Sensor::Magnetometer));
    for (sensor, triad) in reach!(record::CalibrationRecord::triads(record)) {
        reach!(record::Sensor::symbol(sensor));
        let _usable = reach!(record::TriadRecord::check(triad, sensor));
        reach!(record::CalibrationRecord::serial_of(record, sensor));
        reach!(record::CalibrationRecord::date_of(record, sensor));
        adopt(record, sensor, triad);
        let _triad: imucal_core::triad::Triad<f32> = reach!(record::TriadRecord::triad(triad));
    }
}

#[inline(never)]
fn adopt(record: &CalibrationRecord, sensor: Sensor, triad: &TriadRecord) {
    let (unit, date) = (record.sensor.clone(), record.date);
    let mut record = reach!(record::CalibrationRecord::empty(unit.clone(), date));
    reach!(record::CalibrationRecord::adopt(&mut record, sensor, triad, &unit, date));
}

#[inline(never)]
fn dates() {
    let date = reach!(record::Date::from_days(20_000));
    reach!(record::Date::from_unix(1_700_000_000));
    reach!(record::Date::days(date));
    reach!(record::Date::ymd(date));
    write(|f| reach!(record::Date::fmt(&date, f)));
}

#[inline(never)]
fn units() {
    let unit = reach!(record::RawUnit::from_symbol("mG")).unwrap_or(RawUnit::Gauss);
    reach!(record::RawUnit::symbol(unit));
    let position = reach!(u8::from(unit));
    let _unit = reach!(record::RawUnit::try_from(position));
}

#[inline(never)]
fn refusals() {
    let figures = Figures::Gain;
    let defect = Defect::NotFinite { sensor: Sensor::Gyroscope, figures };
    reach!(record::Defect::sensor(&defect));
    reach!(record::Figures::name(figures));
    let wrong = WrongSensor { recorded: "a", connected: "b" };
    write(|f| reach!(record::WrongSensor::fmt(&wrong, f)));
}

//! The record: bytes, days, identity, units.

use core::fmt::Display;

use imucal_core::record::{
    self, CalibrationRecord, DecodeError, Defect, Figures, FirstOrder, HigherOrder, MAX_LEN, Order, RawUnit,
    Sensor, TriadRecord, WrongSensor,
};

use super::write;
use crate::{RECORD, RECORD_2};

#[inline(never)]
pub(super) fn reach_all() {
    dates();
    units();
    refusals();
    if let Ok(record) = reach!(record::decode(RECORD)) {
        whole(&record);
    }
}

/// By itself, since such a record takes kilobytes of stack.
#[inline(never)]
pub(super) fn reach_higher_order() {
    reach!(record::decode_as(RECORD_2), decoded);
    into();
}

#[inline(never)]
fn into() {
    let mut record = CalibrationRecord::<HigherOrder>::empty(Default::default(), record::Date::from_days(0));
    let _whole = reach!(record::decode_into(RECORD_2, &mut record));
}

#[inline(never)]
fn decoded(decoded: &Result<CalibrationRecord<HigherOrder>, DecodeError>) {
    let Ok(record) = decoded else { return };
    pack_higher_order(record);
    for (sensor, triad) in record.triads() {
        order_of(sensor, triad);
    }
}

#[inline(never)]
fn pack_higher_order(record: &CalibrationRecord<HigherOrder>) {
    let mut page = [0xFF; HigherOrder::MAX_LEN];
    let _bytes = reach!(record::encode(record, &mut page));
}

#[inline(never)]
fn order_of(sensor: Sensor, triad: &TriadRecord<HigherOrder>) {
    if let Some(bent) = &triad.order.nonlinearity {
        reach!(record::NonlinearRecord::nonlinearity(bent));
    }
    if let Some(warmth) = &triad.order.warmth {
        reach!(record::TemperatureQuality::covers(warmth, 20.0));
    }
    let _usable = reach!(record::TriadRecord::check(triad, sensor));
    let _first = reach!(record::TriadRecord::with_order(triad.clone(), FirstOrder));
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

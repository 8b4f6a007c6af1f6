//! The least a device does: read its record once, then correct samples; in integers, where it has no floating-point unit.

use imucal_core::corrector::{Compensator, Corrector};
use imucal_core::integer::{IntegerCompensator, IntegerCorrector};
use imucal_core::record::{self, CalibrationRecord, Match};
use nalgebra::Vector3;

/// Bits behind the point of the accelerometer's samples in integers: steps of 2.4e-7 m/s² up to ±512 m/s².
pub const FRACTION: i8 = 22;

/// The record; `None` where it cannot be used or was made for another unit.
///
/// A record without a serial is used. A real device would warn.
fn usable(bytes: &[u8], serial: &str) -> Option<CalibrationRecord> {
    let record = record::decode(bytes).ok()?;
    match record.made_for(serial) {
        Ok(Match::Confirmed | Match::Unknown) => Some(record),
        Err(_) => None,
    }
}

/// The accelerometer's corrector from a record; `None` where there is no usable one.
#[inline(never)]
pub fn accelerometer(bytes: &[u8], serial: &str) -> Option<Corrector<f32>> {
    usable(bytes, serial)?.acc.as_ref().map(Corrector::from)
}

/// One sample. Kept apart from its caller, so that its instructions can be counted.
#[inline(never)]
pub fn apply(corrector: &Corrector<f32>, raw: &Vector3<f32>) -> Vector3<f32> {
    corrector.apply(raw)
}

/// One sample of a stream with its temperature, °C.
#[inline(never)]
pub fn apply_at(compensator: &mut Compensator<f32>, raw: &Vector3<f32>, temperature: f32) -> Vector3<f32> {
    compensator.apply_at(raw, temperature)
}

/// The accelerometer's corrector in integers from a record; `None` where there is no usable one.
#[inline(never)]
pub fn accelerometer_in_integers(bytes: &[u8], serial: &str) -> Option<IntegerCompensator> {
    let record = usable(bytes, serial)?;
    let acc = record.acc.as_ref()?;
    // The words of this converter are unsigned.
    let triad = acc.triad::<f32>().in_unit(-32_768.0, 1.0);
    IntegerCompensator::new(&triad, acc.temperature.as_ref(), FRACTION).ok()
}

/// One sample of words in integers, units of 2^−[`FRACTION`] m/s². Kept apart, so that it can be looked for what it calls.
#[inline(never)]
pub fn apply_in_integers(corrector: &IntegerCorrector, words: [u16; 3]) -> [i32; 3] {
    corrector.apply(words.map(|word| (word ^ 0x8000) as i16))
}

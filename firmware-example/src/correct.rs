//! The least a device does: read its record once, then correct samples.

use imucal_core::corrector::{Compensator, Corrector};
use imucal_core::record::{self, Match};
use nalgebra::Vector3;

/// The accelerometer's corrector from a record; `None` where the record cannot be used or was made for another unit.
///
/// A record without a serial is used. A real device would warn.
#[inline(never)]
pub fn accelerometer(bytes: &[u8], serial: &str) -> Option<Corrector<f32>> {
    let record = record::decode(bytes).ok()?;
    match record.made_for(serial) {
        Ok(Match::Confirmed | Match::Unknown) => record.acc.as_ref().map(Corrector::from),
        Err(_) => None,
    }
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

//! Capture: a calibration session, guided while it goes on.
//!
//! The session is the core's ([`imucal_core::session`]), in `f32`, as on a device; here a recording is replayed through it, sample
//! by sample, and its result put into a calibration. What a session does not do stands there.

use imucal_core::{
    fit::Units,
    observer::Sample,
    record::{Date, HigherOrder, Sensor},
    session::{Session, SessionSettings, guide::Guide, store::NotStored},
};
use nalgebra::Vector3;

use crate::{
    recording::{
        Recording, SensorKind, Unit,
        check::integrity::{self, Integrity},
        unit::STANDARD_GRAVITY,
    },
    store::{FORMAT, StoredCalibration, StoredSensor, StoredTriad, record_form::raw_unit},
};

/// The session of a device: 38 poses, their turns of 4 blocks, 64 places of the field.
pub type Capture = Session<38, 4, 64>;

/// What a recording's manifest says of a session; the rest is as on a device.
pub fn settings(recording: &Recording) -> SessionSettings {
    let gravity = recording.manifest.site.gravity().unwrap_or(STANDARD_GRAVITY) as f32;
    SessionSettings { gravity, ..Default::default() }
}

/// A session over a whole recording. `seen` is called after each sample with its time since the first, s.
///
/// A sample that the recording's integrity leaves out, such as a clipped one, is missing. Fits are done as soon as they are due.
pub fn replay(
    recording: &Recording,
    settings: SessionSettings,
    seen: &mut dyn FnMut(f64, &Capture),
) -> Box<Capture> {
    let integrity = integrity::inspect(recording);
    let mut session = Box::new(Capture::new(settings));
    let begin = recording.time.first().copied().unwrap_or_default();
    for (row, time) in recording.time.iter().enumerate() {
        let since = time - begin;
        let temperature = recording.temperature.as_ref().and_then(|rows| rows.get(row)).map(|t| *t as f32);
        let value = |kind| value(recording, &integrity, kind, row);
        let acc = value(SensorKind::Acc).unwrap_or(Vector3::repeat(f32::NAN));
        let sample =
            Sample { time: (since * 1e6).round() as u64, acc, gyr: value(SensorKind::Gyr), temperature };
        session.push(&sample);
        if let Some(field) = value(SensorKind::Mag) {
            session.push_field(&field);
        }
        while session.work() {}
        seen(since, &session);
    }
    session.finish();
    while session.work() {}
    session
}

/// A row of a sensor, nominal SI; NaN where it cannot be used, `None` without the sensor.
fn value(recording: &Recording, integrity: &Integrity, kind: SensorKind, row: usize) -> Option<Vector3<f32>> {
    let value = recording.sensor(kind)?.values.get(row)?.cast();
    let usable =
        integrity.sensor(kind).and_then(|sensor| sensor.usable.get(row)).is_none_or(|usable| *usable);
    Some(if usable { value } else { Vector3::repeat(f32::NAN) })
}

/// The sensors that a session calibrated, of a recording's raw values; of the others why not.
pub fn calibration(
    session: &Capture,
    recording: &Recording,
    date: Date,
) -> (StoredCalibration, Vec<(SensorKind, NotStored)>) {
    let mut refused = Vec::new();
    let mut triad = |kind: SensorKind, sensor: Sensor| {
        let triple = recording.sensor(kind)?;
        let units = Units {
            raw: raw_unit(triple.unit),
            calibrated: raw_unit(Unit::of(kind)[0]),
            offset: triple.nominal.offset as f32,
            per_unit: triple.nominal.per_unit as f32,
        };
        match session.better(sensor, &units, None) {
            Ok(record) => Some(StoredTriad::from_record(&record.with_order(HigherOrder::default()))),
            Err(why) => {
                refused.push((kind, why));
                None
            }
        }
    };
    let of = &recording.manifest.sensor;
    let stored = StoredCalibration {
        format: FORMAT.into(),
        recording: recording.name.clone(),
        date,
        sensor: StoredSensor {
            name: of.name.clone().unwrap_or_default(),
            serial: of.serial.clone().unwrap_or_default(),
        },
        acc: triad(SensorKind::Acc, Sensor::Accelerometer),
        gyr: triad(SensorKind::Gyr, Sensor::Gyroscope),
        mag: triad(SensorKind::Mag, Sensor::Magnetometer),
    };
    (stored, refused)
}

/// Whether two states of a guide call for different lines: another advice, another verdict, or something left out.
pub fn differ(a: &Guide, b: &Guide) -> bool {
    a.advice != b.advice || a.accepted != b.accepted || a.thrown != b.thrown
}

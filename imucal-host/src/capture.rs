//! Capture: a calibration session, guided while it goes on.
//!
//! The session is the core's ([`imucal_core::session`]), in `f32`, as on a device; here a recording is replayed through it, sample
//! by sample, and its result put into a calibration. What a session does not do stands there.

use imucal_core::{
    link::{CaptureSensor, CaptureTask, RawSample},
    record::{Date, HigherOrder, Sensor, TriadRecord},
    session::{Session, SessionSettings, alignment::NotAligned, axes::Axes, guide::Guide, store::NotStored},
};

use crate::{
    recording::{
        Manifest, Nominal, Recording, SensorKind,
        check::integrity::{self, Integrity},
        manifest::fault::ManifestFault,
        unit::STANDARD_GRAVITY,
    },
    store::{FORMAT, StoredCalibration, StoredSensor, StoredTriad, record_form::raw_unit},
};

/// The session of a device: 38 poses, their turns of 4 blocks, 64 places of the field.
pub type Capture = Session<38, 4, 64>;

/// A session of the units that a manifest gives; `target`: error at which a sensor is done, as a share of a vector's length, zero
/// for one that is not there.
///
/// # Errors
///
/// A sensor that is asked for in counts without their conversion.
pub fn task(manifest: &Manifest, target: [f32; 3]) -> Result<CaptureTask, ManifestFault> {
    let sensor = |kind: SensorKind| -> Result<CaptureSensor, ManifestFault> {
        let target = target[kind as usize];
        let nominal = match manifest.nominal(kind) {
            Err(_) if target == 0.0 => Nominal::IDENTITY,
            nominal => nominal?,
        };
        let full_scale = manifest.ranges.of(kind).map(|range| range / nominal.per_unit.abs());
        Ok(CaptureSensor {
            target,
            full_scale: full_scale.map_or(f32::INFINITY, |range| range as f32),
            unit_in: raw_unit(manifest.units.of(kind)),
            offset: nominal.offset as f32,
            per_unit: nominal.per_unit as f32,
        })
    };
    Ok(CaptureTask {
        gravity: manifest.site.gravity().unwrap_or(STANDARD_GRAVITY) as f32,
        field: None,
        field_down: manifest.site.field_points_down(),
        hold: SessionSettings::default().hold,
        sensors: [sensor(SensorKind::Acc)?, sensor(SensorKind::Gyr)?, sensor(SensorKind::Mag)?],
    })
}

/// The sensors' raw values of a recording, in its order. What the recording's integrity leaves out, such as a clipped row, is
/// missing.
pub fn samples(recording: &Recording) -> impl Iterator<Item = RawSample> {
    let integrity = integrity::inspect(recording);
    let begin = recording.time.first().copied().unwrap_or_default();
    recording.time.iter().enumerate().map(move |(row, time)| RawSample {
        time: ((time - begin) * 1e6).round() as u64,
        raw: SensorKind::ALL.map(|kind| raw(recording, &integrity, kind, row)),
        temperature: recording
            .temperature
            .as_ref()
            .and_then(|rows| rows.get(row))
            .map_or(f32::NAN, |t| *t as f32),
    })
}

/// A row of a sensor, raw; NaN where it cannot be used, `None` without the sensor.
fn raw(recording: &Recording, integrity: &Integrity, kind: SensorKind, row: usize) -> Option<[f32; 3]> {
    let triple = recording.sensor(kind)?;
    let value = triple.values.get(row)?.map(|value| triple.nominal.to_raw(value) as f32);
    let usable =
        integrity.sensor(kind).and_then(|sensor| sensor.usable.get(row)).is_none_or(|usable| *usable);
    Some(if usable { value.into() } else { [f32::NAN; 3] })
}

/// A session over a whole recording, as a device would have it: each sample is followed by one slice of work. `seen` is called
/// after each with its time since the first, s. `None` for a task whose figures cannot be.
pub fn replay(
    recording: &Recording,
    task: &CaptureTask,
    seen: &mut dyn FnMut(f64, &Capture),
) -> Option<Box<Capture>> {
    let mut session = Box::new(Capture::new(task.settings()?));
    for sample in samples(recording) {
        task.push(&mut session, &sample);
        session.work();
        seen(sample.time as f64 * 1e-6, &session);
    }
    session.finish();
    while session.work() {}
    // Without rests that show how it lies, the magnetometer stays in its own axes.
    let _own_axes = session.align_axes();
    Some(session)
}

/// Errors at which the sensors of a recording are done, as shares of a vector's length: a device's own, and zero where there is no
/// such sensor.
pub fn targets(recording: &Recording) -> [f32; 3] {
    let of = |kind: SensorKind, target| if recording.sensor(kind).is_some() { target } else { 0.0 };
    let [acc, gyr, mag] = SessionSettings::default().target;
    [of(SensorKind::Acc, acc), of(SensorKind::Gyr, gyr), of(SensorKind::Mag, mag)]
}

/// The standard error of a session's magnetometer's rotation into the accelerometer's axes, rad.
///
/// # Errors
///
/// Why it is in axes of its own.
pub fn axes_of_magnetometer(session: &Capture) -> Result<f32, NotAligned> {
    let estimate = session.estimate(Sensor::Magnetometer);
    match estimate.and_then(|estimate| estimate.alignment_error) {
        Some(error) => Ok(error),
        None => Err(session.clone().align_axes().err().unwrap_or(NotAligned::Already)),
    }
}

/// The sensors that a session calibrated, of a recording's raw values, with terms of temperature where its rests bear them out; of the
/// others why not.
pub fn calibration(
    session: &Capture,
    task: &CaptureTask,
    recording: &Recording,
    date: Date,
) -> (StoredCalibration, Vec<(SensorKind, NotStored)>) {
    let mut refused = Vec::new();
    let mut triad = |kind: SensorKind, sensor: Sensor| {
        recording.sensor(kind)?;
        let units = task.sensors[kind as usize].units(sensor);
        match session.better_at_temperatures(sensor, &units, None::<&TriadRecord>, &Axes::Own) {
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

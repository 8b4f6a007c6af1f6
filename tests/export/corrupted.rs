//! The forward model: what is corrupted and corrected is the ideal stream, and its noise is the one that was asked for.

use std::path::Path;

use imucal_host::allan::{self, coefficients::Coefficient};
use imucal_host::apply;
use imucal_host::corrupt::{self, Drawing};
use imucal_host::recording::{Manifest, Nominal, Recording, SensorKind, Triple, Unit};
use nalgebra::Vector3;

use super::{everything, noise, plain};

fn ideal(rows: usize) -> Recording {
    let time = (0..rows).map(|row| row as f64 * 0.01).collect();
    let mut recording = Recording::new("sim.csv", Manifest::default(), time);
    let triple = |size: f64, unit| Triple {
        values: (0..rows)
            .map(|row| {
                Vector3::new((row as f64).sin(), (0.7 * row as f64).cos(), (0.3 * row as f64).sin()) * size
            })
            .collect(),
        unit,
        nominal: Nominal::IDENTITY,
        full_scale: None,
        single: false,
    };
    recording.acc = Some(triple(12.0, Unit::MetrePerSecondSquared));
    recording.gyr = Some(triple(3.0, Unit::RadianPerSecond));
    recording.mag = Some(triple(45.0, Unit::MicroTesla));
    recording.temperature = Some((0..rows).map(|row| -20.0 + row as f64 * 0.05).collect());
    recording
}

#[test]
fn what_is_corrupted_and_applied_is_the_ideal_stream_but_for_rounding() {
    let calibration = everything();
    let record = calibration.to_record(Path::new("cal.toml")).expect("a record");
    let sim = ideal(1500);
    let read = corrupt::corrupt(&sim, &calibration, &record, None).expect("corrupted");
    let folder = tempfile::tempdir().expect("room");
    read.write(&folder.path().join("read.csv")).expect("written");
    let read = Recording::read(&folder.path().join("read.csv")).expect("read back");
    assert_eq!(read.manifest.units.mag, Unit::Counts);
    let back = apply::apply(&read, &calibration, &record).expect("applied");
    for kind in SensorKind::ALL {
        let (found, expected) = (back.sensor(kind).expect("there"), sim.sensor(kind).expect("there"));
        let size = expected.median_norm().expect("samples");
        for (found, expected) in found.values.iter().zip(&expected.values) {
            assert!((found - expected).norm() < 3e-6 * size, "{kind} {found} {expected}");
        }
    }
    let bare = Recording { acc: None, gyr: None, mag: None, ..sim };
    let nothing = corrupt::corrupt(&bare, &calibration, &record, None);
    assert!(matches!(nothing, Err(corrupt::CorruptError::Nothing { .. })));
}

#[test]
fn a_corrupted_still_stream_has_the_noise_that_was_asked_for() {
    let calibration = plain();
    let record = calibration.to_record(Path::new("cal.toml")).expect("a record");
    let rows = 200_000;
    let mut still =
        Recording::new("sim.csv", Manifest::default(), (0..rows).map(|row| f64::from(row) * 0.01).collect());
    let triple = |unit| Triple {
        values: vec![Vector3::zeros(); rows as usize],
        unit,
        nominal: Nominal::IDENTITY,
        full_scale: None,
        single: false,
    };
    still.gyr = Some(triple(Unit::RadianPerSecond));
    let noise = noise();
    let drawing = Some(Drawing { noise: &noise, seed: 4 });
    let read = corrupt::corrupt(&still, &calibration, &record, drawing).expect("corrupted");
    assert_eq!(read, corrupt::corrupt(&still, &calibration, &record, drawing).expect("corrupted"));
    let back = apply::apply(&read, &calibration, &record).expect("applied");
    let folder = tempfile::tempdir().expect("room");
    back.write(&folder.path().join("back.csv")).expect("written");
    let found = allan::noise(&folder.path().join("back.csv"), &Default::default(), &Default::default())
        .expect("noise");
    let sensor = found
        .sensors
        .into_iter()
        .find(|(kind, _)| *kind == SensorKind::Gyr)
        .expect("there")
        .1
        .expect("still");
    for (axis, factor) in sensor.axes.iter().flatten().zip([1.0, 2.0, 3.0]) {
        let white = axis.white.value().expect("seen");
        assert!((white / (factor * 1e-4) - 1.0).abs() < 0.02, "{white}");
        let Coefficient::Known(walk) = &axis.random_walk else { panic!("{axis:?}") };
        assert!(walk.interval.0 < 2.2e-5 && 1.8e-5 < walk.interval.1, "{walk:?}");
    }
}

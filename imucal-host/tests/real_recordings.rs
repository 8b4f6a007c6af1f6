//! The reader and the integrity report on recordings of real sensors.

use std::{
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
};

use imucal_host::{
    calibrate::{Options, calibrate},
    recording::{
        Recording, SensorKind, Warning,
        check::integrity::{Integrity, inspect},
    },
};

/// The data's folder, or nothing, which is said loudly; a failure where the data must be there.
fn data(folder: &str) -> Option<PathBuf> {
    let root = std::env::var_os("IMUCAL_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    let path = root.join(folder);
    if path.is_dir() {
        return Some(path);
    }
    let ci = std::env::var("CI").is_ok_and(|value| value == "true");
    assert!(!ci, "{} is missing; set IMUCAL_DATA to the folder of the recordings", path.display());
    // Not eprintln!, which a passing test keeps to itself.
    let _ = writeln!(
        io::stderr(),
        "SKIPPED: {} is missing; set IMUCAL_DATA to the folder of the recordings",
        path.display()
    );
    None
}

fn recordings(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut paths: Vec<PathBuf> = entries.filter(|path| path.to_string_lossy().contains(".csv")).collect();
    paths.sort();
    paths
}

fn read(path: &Path) -> (Recording, Integrity) {
    let recording = Recording::read(path).unwrap_or_else(|error| panic!("{error}"));
    // Positions of a reference are data of the recording that nothing uses yet.
    let known = |warning: &Warning| match warning {
        Warning::UnitsAssumed { .. } => true,
        Warning::UnknownColumn { column, .. } => column.starts_with("ref_p"),
        _ => false,
    };
    assert!(recording.warnings.iter().all(known), "{}: {:?}", recording.name, recording.warnings);
    let integrity = inspect(&recording);
    (recording, integrity)
}

#[test]
fn real_recordings_read_clean_and_only_the_clipped_one_is_found_so() {
    let Some(folder) = data("real") else { return };
    let paths = recordings(&folder);
    assert!(paths.len() >= 11, "{paths:?}");
    for path in paths {
        let (recording, integrity) = read(&path);
        assert!(integrity.gaps.is_empty(), "{}: {:?}", recording.name, integrity.gaps);
        for sensor in &integrity.sensors {
            let name = (&recording.name, sensor.sensor);
            assert_eq!(sensor.missing, 0, "{name:?}");
            assert!(sensor.stuck.is_empty(), "{name:?}: {:?}", sensor.stuck);
            // This gyroscope does reach both ends of its converter.
            let clipped = recording.name.starts_with("mpu6050") && sensor.sensor == SensorKind::Gyr;
            assert_eq!(!sensor.saturated.is_empty(), clipped, "{name:?}: {:?}", sensor.saturated);
            let lost = sensor.usable.iter().filter(|usable| !**usable).count();
            assert_eq!(lost, if clipped { 18 } else { 0 }, "{name:?}");
        }
    }
}

#[test]
fn simulated_recordings_read_clean() {
    let Some(folder) = data("blind") else { return };
    for name in ["open-01.csv.gz", "open-05.csv.gz"] {
        let (recording, integrity) = read(&folder.join(name));
        assert!(recording.gimbal.is_some() && recording.temperature.is_some());
        assert_eq!(integrity.sensors.len(), 3);
        for sensor in integrity.sensors {
            assert!(sensor.usable.iter().all(|usable| *usable), "{name}: {}", sensor.sensor);
        }
    }
}

#[test]
fn the_first_sample_of_a_recording_in_counts_is_converted() {
    let Some(folder) = data("real") else { return };
    let (recording, _) = read(&folder.join("xsens-mti.csv.gz"));
    assert_eq!(recording.rows(), 51_175);
    assert_eq!(recording.time[0], 0.029_84);
    let acc = recording.acc.as_ref().unwrap();
    assert!((acc.values[0].x - (33_108.0 - 32_768.0) / 415.0).abs() < 1e-15);
    assert_eq!(recording.manifest.site.gravity(), Some(9.81744));
}

#[test]
fn a_real_recording_written_again_holds_the_same_values() {
    let Some(folder) = data("real") else { return };
    let (recording, _) = read(&folder.join("mpu6050-unobservable.csv.gz"));
    let target = tempfile::tempdir().unwrap();
    let path = target.path().join("again.csv.gz");
    recording.write(&path).unwrap();
    let (again, _) = read(&path);
    assert_eq!(again.time, recording.time);
    assert_eq!((again.acc, again.gyr), (recording.acc, recording.gyr));
}

#[test]
fn a_factory_calibrated_gyroscope_agrees_with_its_optical_reference() {
    let Some(folder) = data("real") else { return };
    let (recording, _) = read(&folder.join("broad-01-undisturbed.csv.gz"));
    let options = Options { skip: vec![SensorKind::Acc, SensorKind::Mag], ..Options::default() };
    let calibration = calibrate(&recording, &options, &|_| ());
    let outcome = calibration.sensor(SensorKind::Gyr).unwrap();
    assert_eq!(outcome.model, "G12");
    let fit = outcome.accepted().unwrap();
    println!("{:.4} rms {:.3}°", fit.triad.gain, fit.rms.to_degrees());
    assert!((fit.triad.gain - nalgebra::Matrix3::identity()).amax() < 0.01, "{}", fit.triad.gain);
    assert!(fit.rms.to_degrees() < 0.6 && fit.observations > 120);
}

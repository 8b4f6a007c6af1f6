//! The core in `f32` against the reference in `f64`: every sensor of every recording, sample by sample, and every
//! fit that was accepted, parameter by parameter.

use std::path::PathBuf;

use imucal_core::record::{Date, TriadRecord};
use imucal_host::calibrate::{Calibration, Options, calibrate};
use imucal_host::equivalence::{SampleEquivalence, fits, samples};
use imucal_host::recording::{Recording, SensorKind, Triple, Unit};
use imucal_host::simulator::{Programme, Simulation, UnitKind};
use imucal_host::store::{StoredCalibration, StoredTriad};
use imucal_tests::{data, simulated};
use rayon::prelude::*;

/// The samples files of all real recordings.
fn real() -> Vec<PathBuf> {
    let Some(folder) = data::folder() else { return Vec::new() };
    let entries = std::fs::read_dir(folder.join("real")).expect("the folder is there");
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.to_string_lossy().contains(".csv"))
        .collect();
    paths.sort();
    assert!(paths.len() >= 11, "{paths:?}");
    paths
}

/// A calibration such as a sensor of this kind might have, for those whose own was refused.
fn plausible(triple: &Triple, kind: SensorKind) -> StoredTriad {
    let per_unit = triple.nominal.per_unit;
    let gain = [[1.013, -0.021, 0.008], [0.0042, 0.987, -0.017], [-0.0063, 0.0125, 1.004]];
    let bias = [0.021, -0.034, 0.017].map(|share| triple.nominal.to_raw(share * 9.0));
    StoredTriad {
        model: "hand".into(),
        unit_in: triple.unit,
        unit_out: Unit::of(kind)[0],
        gain: gain.map(|row| row.map(|entry| entry / per_unit)),
        bias,
        gain_std: [[0.0; 3]; 3],
        bias_std: [0.0; 3],
        rms: 0.0,
        held_out_rms: None,
        observations: 12,
        parameters: 12,
        condition: 1.0,
        coverage: 1.0,
        field_norm: None,
        temperature: None,
    }
}

fn with(mut stored: StoredCalibration, kind: SensorKind, triad: StoredTriad) -> StoredCalibration {
    match kind {
        SensorKind::Acc => stored.acc = Some(triad),
        SensorKind::Gyr => stored.gyr = Some(triad),
        SensorKind::Mag => stored.mag = Some(triad),
    }
    stored
}

/// What the device holds of a calibration.
fn on_device(stored: &StoredCalibration, kind: SensorKind) -> TriadRecord {
    let record = stored.to_record(&PathBuf::from("record")).expect("it fits the record");
    record.triad(kind.into()).expect("it was put there").clone()
}

fn calibrated(recording: &Recording) -> Calibration {
    calibrate(recording, &Options::default(), &|_| {})
}

/// Compares every sensor; gives how many, and how many fits.
fn compare(recording: &Recording) -> (usize, usize) {
    let calibration = calibrated(recording);
    let mut sensors = 0;
    for kind in SensorKind::ALL {
        let Some(triple) = recording.sensor(kind) else { continue };
        let own = StoredCalibration::of(&calibration, Date::from_days(20_000));
        let triad = own.triad(kind).cloned().unwrap_or_else(|| plausible(triple, kind));
        let stored = with(own, kind, triad.clone());
        let result = samples::compare(kind, triple, &triad, &on_device(&stored, kind));
        assert!(result.samples > 0 && result.passes(), "{}: {result:?}", recording.name);
        sensors += 1;
    }
    let accepted = calibration.sensors.iter().filter(|outcome| outcome.accepted().is_some());
    let fitted = accepted
        .map(|outcome| {
            let fit = fits::compare(recording, outcome);
            let fit = fit.unwrap_or_else(|| panic!("{}, {}: no reference", recording.name, outcome.kind));
            assert!(fit.passes(), "{}: {fit:#?}", recording.name);
        })
        .count();
    (sensors, fitted)
}

#[test]
fn every_sensor_of_every_real_recording_is_corrected_and_fitted_alike() {
    let paths = real();
    let counts: Vec<(usize, usize)> = paths
        .par_iter()
        .map(|path| compare(&Recording::read(path).unwrap_or_else(|error| panic!("{error}"))))
        .collect();
    let (sensors, fitted) = counts.iter().fold((0, 0), |sum, each| (sum.0 + each.0, sum.1 + each.1));
    if !paths.is_empty() {
        assert!(sensors >= 20 && fitted >= 10, "{sensors} sensors, {fitted} fits in {paths:?}");
    }
}

#[test]
fn simulated_recordings_are_corrected_and_fitted_alike() {
    for seed in [5, 6, 7] {
        assert_eq!(compare(&simulated::tumbled(20, seed)), (3, 3), "seed {seed}");
    }
}

#[test]
fn recordings_of_a_rig_are_corrected_and_fitted_alike_by_the_rig_s_models() {
    for (seed, unit) in [(1, UnitKind::ALL[0]), (2, UnitKind::ALL[1])] {
        let programme = Programme::MultiPosition;
        let simulation = Simulation { programme, unit, rate: 50.0, seed, ..Simulation::default() };
        let recording = simulation.record("rig.csv").expect("a possible recording");
        assert_eq!(compare(&recording), (3, 3), "seed {seed}");
        for (acc, gyr, mag) in [("T12", "G21", "X18"), ("I20", "G12", "M15")] {
            let options = Options {
                rig_acc: Some(acc),
                rig_gyr: Some(gyr),
                rig_mag: Some(mag),
                multipliers: vec![4.0],
                ..Options::default()
            };
            let calibration = calibrate(&recording, &options, &|_| {});
            for outcome in &calibration.sensors {
                let Some(accepted) = outcome.accepted() else { continue };
                let fit = fits::compare(&recording, outcome).expect("a reference");
                assert_eq!(fit.parameters.len(), accepted.parameters, "{}", outcome.model);
                assert!(fit.passes(), "seed {seed}, {}: {fit:#?}", outcome.model);
                let mut wrong = fit.clone();
                let last = wrong.parameters.last_mut().expect("some");
                last.device += (0.25 * last.std).max(2.5 * fits::FLOOR * last.scale);
                assert!(!wrong.passes(), "{}: {wrong:#?}", outcome.model);
            }
        }
    }
}

/// The comparison of the device's corrections after something has gone wrong on the way to it.
fn faulty(kind: SensorKind, fault: impl Fn(&mut StoredTriad, &SampleEquivalence)) -> SampleEquivalence {
    let recording = simulated::small();
    let stored = StoredCalibration::of(&calibrated(&recording), Date::from_days(20_000));
    let (triple, triad) = (recording.sensor(kind).expect("recorded"), stored.triad(kind).expect("accepted"));
    let sound = samples::compare(kind, triple, triad, &on_device(&stored, kind));
    assert!(sound.passes(), "{sound:?}");
    let mut wrong = triad.clone();
    fault(&mut wrong, &sound);
    samples::compare(kind, triple, triad, &on_device(&with(stored.clone(), kind, wrong), kind))
}

#[test]
fn a_gain_wrong_by_a_ten_thousandth_fails_the_comparison() {
    for kind in SensorKind::ALL {
        for axis in 0..3 {
            let result = faulty(kind, |triad, _| triad.gain[axis][axis] *= 1.0 + 1e-4);
            assert!(!result.passes(), "{kind} {axis}: {result:?}");
        }
    }
}

#[test]
fn a_bias_wrong_by_twenty_millionths_of_full_scale_fails_the_comparison() {
    for kind in SensorKind::ALL {
        for axis in 0..3 {
            let result = faulty(kind, |triad, sound| {
                triad.bias[axis] += 20e-6 * sound.full_scale / triad.gain[axis][axis];
            });
            assert!(!result.passes(), "{kind} {axis}: {result:?}");
        }
    }
}

#[test]
fn a_fit_that_ends_elsewhere_fails_the_comparison() {
    let recording = simulated::small();
    let calibration = calibrated(&recording);
    for outcome in &calibration.sensors {
        let sound = fits::compare(&recording, outcome).expect("all are accepted");
        assert!(sound.passes(), "{sound:#?}");
        for index in 0..sound.parameters.len() {
            let mut wrong = sound.clone();
            let parameter = &mut wrong.parameters[index];
            parameter.device += (0.25 * parameter.std).max(2.5 * fits::FLOOR * parameter.scale);
            assert!(!wrong.passes(), "{}: {wrong:#?}", outcome.kind);
        }
    }
}

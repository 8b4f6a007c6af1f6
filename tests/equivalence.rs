//! The core in `f32` against the reference in `f64`: every sensor of every recording, sample by sample, and every
//! fit that was accepted, parameter by parameter.

use std::{path::PathBuf, sync::LazyLock};

use imucal_core::{
    corrector::{Compensator, FullCorrector},
    record::{Date, HigherOrder, TriadRecord},
    temperature::TemperatureTerms,
};
use imucal_host::{
    calibrate::{Calibration, Options, calibrate},
    equivalence::{
        SampleEquivalence, fit_equivalence, fits,
        samples::{self, Samples},
    },
    recording::{Recording, SensorKind, Triple, Unit},
    simulator::{Programme, Simulation, UnitKind},
    store::{StoredCalibration, StoredTemperature, StoredTriad},
};
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
        provenance: None,
        nonlinearity: None,
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
fn on_device(stored: &StoredCalibration, kind: SensorKind) -> TriadRecord<HigherOrder> {
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
        let replayed = Samples::of(recording, kind).expect("recorded");
        let record = on_device(&stored, kind);
        let result = samples::compare(replayed, &triad, &record);
        assert!(result.passes(), "{}: {result:?}", recording.name);
        let mut wrong = record.clone();
        wrong.gain.as_flattened_mut().iter_mut().for_each(|entry| *entry *= 1.0 + 1e-6);
        let core = FullCorrector::<f32>::try_from(&wrong).expect("no steep terms");
        let result = samples::compare_by(replayed, &triad, &record, |raw, _| core.apply(raw));
        assert!(!result.passes(), "{}: a gain wrong by a millionth passes: {result:?}", recording.name);
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
                last.device += (0.25 * last.std).max(2.5 * fit_equivalence::FLOOR * last.scale);
                assert!(!wrong.passes(), "{}: {wrong:#?}", outcome.model);
            }
        }
    }
}

/// Terms of temperature such as a sensor might have: of the raw unit and 1 per kelvin.
fn warm(triple: &Triple) -> StoredTemperature {
    let drift = |per_kelvin: f64| per_kelvin * triple.nominal.per_unit;
    StoredTemperature {
        reference: 22.5,
        bias_slope: [drift(1.3e-3), drift(-0.7e-3), drift(0.9e-3)],
        scale_slope: [1.1e-4, -0.6e-4, 0.8e-4],
        quality: None,
        curvature: None,
    }
}

/// The small recording with a course of temperature, and its calibration with terms of it.
static HEATED: LazyLock<(Recording, StoredCalibration)> = LazyLock::new(heated);

fn heated() -> (Recording, StoredCalibration) {
    let mut recording = simulated::small();
    let mut stored = StoredCalibration::of(&calibrated(&recording), Date::from_days(20_000));
    let reading = |row: usize| if row.is_multiple_of(7) { f64::NAN } else { 20.0 + 1e-3 * row as f64 };
    recording.temperature = Some((0..recording.rows()).map(reading).collect());
    for kind in SensorKind::ALL {
        let triad = stored.triad(kind).cloned().expect("accepted");
        let temperature = Some(warm(recording.sensor(kind).expect("recorded")));
        stored = with(stored, kind, StoredTriad { temperature, ..triad });
    }
    (recording, stored)
}

/// The comparison with a core that computes by other figures than the record's: by what has become of them.
fn faulty(kind: SensorKind, fault: impl Fn(&mut TriadRecord<HigherOrder>)) -> SampleEquivalence {
    let (recording, stored) = &*HEATED;
    let record = on_device(stored, kind);
    let mut wrong = record.clone();
    fault(&mut wrong);
    let mut core = Compensator::new(FullCorrector::<f32>::try_from(&wrong).expect("no steep terms"));
    let replayed = Samples::of(recording, kind).expect("recorded");
    let triad = stored.triad(kind).expect("accepted");
    samples::compare_by(replayed, triad, &record, |raw, temperature| core.apply_at(raw, temperature))
}

#[test]
fn a_sound_core_passes_with_temperature_and_without() {
    for kind in SensorKind::ALL {
        let sound = faulty(kind, |_| ());
        assert!(sound.passes(), "{kind}: {sound:?}");
        assert_eq!((sound.warm, sound.samples), (sound.samples - sound.samples.div_ceil(7), sound.samples));
        let cold = faulty(kind, |record| record.temperature = None);
        assert!(!cold.passes() && cold.record_is_nearest, "{kind}: {cold:?}");
    }
}

#[test]
fn a_gain_wrong_by_a_millionth_fails_the_comparison() {
    for kind in SensorKind::ALL {
        for axis in 0..3 {
            for millionth in [1e-6, -1e-6] {
                let result = faulty(kind, |triad| triad.gain[axis][axis] *= 1.0 + millionth);
                assert!(!result.passes() && result.record_is_nearest, "{kind} {axis}: {result:?}");
            }
        }
    }
}

#[test]
fn a_bias_wrong_by_a_millionth_of_full_scale_fails_the_comparison() {
    for kind in SensorKind::ALL {
        for axis in 0..3 {
            let full_scale = faulty(kind, |_| ()).full_scale;
            let result = faulty(kind, |triad| {
                triad.bias[axis] += (1e-6 * full_scale) as f32 / triad.gain[axis][axis];
            });
            assert!(!result.passes(), "{kind} {axis}: {result:?}");
        }
    }
}

#[test]
fn a_temperature_term_wrong_by_a_hundredth_fails_the_comparison() {
    type Fault = fn(&mut TemperatureTerms<f32>, usize);
    let faults: [(&str, Fault); 3] = [
        ("reference", |terms, _| terms.reference += 0.05),
        ("bias", |terms, axis| terms.bias_slope[axis] *= 1.01),
        ("scale", |terms, axis| terms.scale_slope[axis] *= 1.01),
    ];
    for kind in SensorKind::ALL {
        for (name, fault) in faults {
            for axis in 0..3 {
                let result = faulty(kind, |triad| fault(triad.temperature.as_mut().expect("terms"), axis));
                assert!(!result.passes(), "{kind} {name} {axis}: {result:?}");
            }
        }
    }
}

#[test]
fn a_record_that_is_one_ulp_from_what_was_stored_fails_the_comparison() {
    type Fault = fn(&mut TriadRecord<HigherOrder>) -> &mut f32;
    let faults: [Fault; 5] = [
        |triad| &mut triad.gain[0][1],
        |triad| &mut triad.bias[2],
        |triad| &mut triad.temperature.as_mut().expect("terms").reference,
        |triad| &mut triad.temperature.as_mut().expect("terms").bias_slope[0],
        |triad| &mut triad.temperature.as_mut().expect("terms").scale_slope[1],
    ];
    let (recording, stored) = &*HEATED;
    for kind in SensorKind::ALL {
        let (replayed, triad) =
            (Samples::of(recording, kind).expect("recorded"), stored.triad(kind).expect("accepted"));
        for (number, fault) in faults.into_iter().enumerate() {
            let mut record = on_device(stored, kind);
            let figure = fault(&mut record);
            *figure = figure.next_up();
            let result = samples::compare(replayed, triad, &record);
            assert!(!result.passes() && result.of_bound <= samples::LIMIT, "{kind} {number}: {result:?}");
        }
        let forgotten = TriadRecord { temperature: None, ..on_device(stored, kind) };
        assert!(!samples::compare(replayed, triad, &forgotten).passes(), "{kind}");
    }
}

#[test]
fn a_sensor_without_a_sample_fails_the_comparison() {
    let (mut recording, stored) = HEATED.clone();
    let gyr = recording.gyr.as_mut().expect("recorded");
    gyr.values.iter_mut().for_each(|value| value.y = f64::NAN);
    let replayed = Samples::of(&recording, SensorKind::Gyr).expect("recorded");
    let result = samples::compare(
        replayed,
        stored.triad(SensorKind::Gyr).expect("accepted"),
        &on_device(&stored, SensorKind::Gyr),
    );
    assert!(result.samples == 0 && !result.passes(), "{result:?}");
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
            parameter.device += (0.25 * parameter.std).max(2.5 * fit_equivalence::FLOOR * parameter.scale);
            assert!(!wrong.passes(), "{}: {wrong:#?}", outcome.kind);
        }
    }
}

//! Quadratic, cubic and cross terms of an accelerometer, fitted on a rig, stored and undone by the device's corrector.

use std::path::Path;

use imucal_core::record::{CalibrationRecord, Date, HigherOrder, Order, decode_as, encode};
use imucal_host::{
    apply, calibrate,
    calibrate::{Calibration, FitSummary, Options, Status},
    compare::{CompareFault, compare},
    effect,
    observe::pose,
    recording::{Recording, SensorKind},
    simulator::{Dose, Programme, Simulation},
    store::StoredCalibration,
};
use nalgebra::Vector3;
use rayon::prelude::*;

/// q, 1/(m/s²); c, 1/(m/s²)²; and of each axis the product of the two others: up to 10 mm/s² at 1 g.
const QUADRATIC: [f64; 3] = [4e-5, -6e-5, 8e-5];
const CUBIC: [f64; 3] = [6e-6, -4e-6, 9e-6];
const PRODUCT: [f64; 3] = [-5e-5, 7e-5, 6e-5];
/// Recordings of each kind.
const SEEDS: std::ops::Range<u64> = 300..340;

fn recording(seed: u64, bent: bool) -> Recording {
    let dose = |id: &str, values: &[f64]| Dose {
        effect: effect::find(id).expect("an effect"),
        values: values.to_vec(),
    };
    let [x, y, z] = PRODUCT;
    let doses = vec![
        dose("acc.scale_quadratic", &QUADRATIC),
        dose("acc.scale_cubic", &CUBIC),
        dose("acc.cross_axis_product", &[0.0, x, 0.0, 0.0, 0.0, y, z, 0.0, 0.0]),
    ];
    let doses = if bent { doses } else { Vec::new() };
    let programme = Programme::MultiPosition;
    let simulation = Simulation { programme, rate: 50.0, seed, doses, ..Simulation::default() };
    simulation.record("bent.csv").expect("a possible recording")
}

fn calibrated(recording: &Recording, model: &'static str) -> Calibration {
    let options = Options {
        rig_acc: Some(model),
        skip: vec![SensorKind::Gyr, SensorKind::Mag],
        multipliers: vec![4.0],
        ..Options::default()
    };
    calibrate::calibrate(recording, &options, &|_| {})
}

fn fit(calibration: &Calibration) -> &FitSummary {
    let outcome = calibration.sensor(SensorKind::Acc).expect("recorded");
    outcome.passed().unwrap_or_else(|| panic!("{:?}", outcome.verdict))
}

fn stored(calibration: &Calibration) -> (StoredCalibration, CalibrationRecord<HigherOrder>) {
    let stored = StoredCalibration::of(calibration, Date::from_days(20_000));
    let record = stored.to_record(Path::new("bent.bin")).expect("a record");
    (stored, record)
}

/// Rms of what the lengths of corrected rests are off gravity by, m/s².
fn off(recording: &Recording, calibration: &Calibration) -> f64 {
    let (stored, record) = stored(calibration);
    let corrected = apply::apply(recording, &stored, &record).expect("terms that can be undone");
    let acc = corrected.sensor(SensorKind::Acc).expect("corrected");
    let usable = vec![true; recording.time.len()];
    let poses = pose::poses(&corrected, acc, &usable).expect("a rig");
    let gravity = recording.manifest.site.gravity.expect("of the simulator's site");
    let square = |value: &Vector3<f64>| (value.norm() - gravity).powi(2);
    (poses.poses.iter().map(|pose| square(&pose.value)).sum::<f64>() / poses.poses.len() as f64).sqrt()
}

#[test]
fn nonlinear_terms_are_off_by_what_their_standard_errors_say() {
    let scores: Vec<f64> = SEEDS
        .into_par_iter()
        .flat_map_iter(|seed| {
            let calibration = calibrated(&recording(seed, true), "I23");
            let found = fit(&calibration).nonlinear.clone().expect("estimated");
            let [a, b, c] = [found.terms.cross[0][1], found.terms.cross[1][2], found.terms.cross[2][0]];
            let [d, e, f] = [found.std.cross[0][1], found.std.cross[1][2], found.std.cross[2][0]];
            let all = [
                (found.terms.quadratic, QUADRATIC, found.std.quadratic),
                (found.terms.cubic, CUBIC, found.std.cubic),
                ([a, b, c], PRODUCT, [d, e, f]),
            ];
            all.into_iter().flat_map(|(found, truth, std)| {
                (0..3).map(move |axis| (found[axis] - truth[axis]) / std[axis])
            })
        })
        .collect();
    let rms = (scores.iter().map(|score| score * score).sum::<f64>() / scores.len() as f64).sqrt();
    println!("nonlinear terms off by {rms:.3} standard errors rms, {} terms", scores.len());
    assert_eq!(scores.len(), 9 * SEEDS.count());
    assert!((0.85..=1.15).contains(&rms), "{rms}");
}

#[test]
fn the_record_s_terms_bring_corrected_rests_to_the_length_of_gravity() {
    for seed in [1, 2, 3] {
        let recording = recording(seed, true);
        let (linear, bent) = (calibrated(&recording, "I14"), calibrated(&recording, "I23"));
        let (without, with) = (off(&recording, &linear), off(&recording, &bent));
        let straight = self::recording(seed, false);
        let floor = off(&straight, &calibrated(&straight, "I14"));
        println!(
            "seed {seed}: off by {without:.5} m/s² with I14, {with:.5} with I23; {floor:.5} if it were linear"
        );
        // What stops scatter by and the noise of a rest remain.
        assert!(without > 2.5 * with && with < 1.15 * floor, "seed {seed}: {without}, {with}, {floor}");
        let (_, record) = stored(&bent);
        let mut page = [0; HigherOrder::MAX_LEN];
        let back = decode_as::<HigherOrder>(encode(&record, &mut page).expect("room")).expect("intact");
        assert_eq!(back, record);
        let held = back.acc.expect("stored").order.nonlinearity.expect("stored");
        // The largest value seen is gravity's, in counts.
        let scale = recording.sensor(SensorKind::Acc).expect("recorded").nominal.per_unit.abs();
        assert!((f64::from(held.range) / (9.8 * scale) - 1.0).abs() < 0.05, "{}", held.range);
    }
}

#[test]
fn a_linear_model_of_a_sensor_that_is_not_is_not_accepted_in_silence() {
    let warned = |seed: u64, bent: bool| {
        let calibration = calibrated(&recording(seed, bent), "I14");
        assert!(fit(&calibration).nonlinear.is_none(), "a linear model has no such terms");
        assert_ne!(calibration.sensor(SensorKind::Acc).expect("recorded").status(), Status::Refused);
        calibration.warnings.iter().any(|warning| warning.contains("the poses contradict I14"))
    };
    let count = |bent: bool| SEEDS.into_par_iter().filter(|seed| warned(*seed, bent)).count();
    let (bent, straight) = (count(true), count(false));
    println!(
        "warned of {bent} of {0} sensors that are not linear, and of {straight} of {0} that are",
        SEEDS.count()
    );
    assert_eq!(bent, SEEDS.count());
    // At 1 in 1000 for each of three kinds of terms, two of forty come once in 200.
    assert!(straight <= 1, "{straight}");
}

#[test]
fn calibrations_are_compared_only_where_they_estimate_the_same_terms() {
    let recording = recording(1, true);
    let (linear, (bent, _)) =
        (stored(&calibrated(&recording, "I14")).0, stored(&calibrated(&recording, "I23")));
    assert!(matches!(compare(&linear, &bent, false), Err(CompareFault::Nothing { .. })));
    let mut moved = bent.clone();
    let terms = moved.acc.as_mut().and_then(|acc| acc.nonlinearity.as_mut()).expect("stored");
    terms.cubic[2] += 20.0 * terms.cubic_std[2];
    terms.cross[0][1] += 20.0 * terms.cross_std[0][1];
    let comparison = compare(&bent, &moved, false).expect("the same terms");
    let parameters = &comparison.sensors[0].parameters;
    let names: Vec<&str> = parameters.iter().filter(|p| p.moved).map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["cubic_z", "cross_x_yz"]);
    assert_eq!(parameters.len(), 12 + 9);
}

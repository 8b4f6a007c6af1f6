//! Temperature from a fit: what it finds is off by what its standard errors say, held-out temperatures are predicted
//! better, and what does not tell temperature is refused.

use imucal_core::record::{Date, Sensor};
use imucal_host::{
    calibrate::{
        Calibration, FitSummary, Options, calibrate,
        temperature::{TemperatureRefusal, finding::Part},
    },
    capture, effect,
    recording::{Recording, SensorKind},
    simulator::{Dose, Programme, Simulation},
    store::StoredCalibration,
};
use rayon::prelude::*;

/// Growth of the bias, SI per kelvin, of accelerometer and gyroscope; and of the scale, 1 per kelvin: alike on all axes,
/// so that it does not matter whether it belongs to what an axis senses or to a calibrated one.
const BIAS: [[f64; 3]; 2] = [[2.1e-3, -1.3e-3, 0.8e-3], [2.4e-4, -1.6e-4, 3.1e-4]];
const SCALE: f64 = 1.5e-4;
const KINDS: [SensorKind; 2] = [SensorKind::Acc, SensorKind::Gyr];
/// Recordings of each kind.
const SEEDS: std::ops::Range<u64> = 100..140;
/// With the rig's attitudes, and without them as of a sensor on a table, which needs more poses than the thermal programme has.
const PLACES: [(&str, Programme, bool); 2] =
    [("on the rig", Programme::Thermal, true), ("at rest", Programme::Full, false)];

fn recording(seed: u64, programme: Programme, warm: bool) -> Recording {
    let dose = |id: String, values: &[f64]| Dose {
        effect: effect::find(&id).expect("an effect"),
        values: values.to_vec(),
    };
    let doses = KINDS.iter().zip(BIAS).flat_map(|(kind, bias)| {
        [dose(format!("{kind}.temp_bias"), &bias), dose(format!("{kind}.temp_scale"), &[SCALE; 3])]
    });
    let doses = if warm { doses.collect() } else { Vec::new() };
    let simulation = Simulation { programme, rate: 50.0, seed, doses, ..Simulation::default() };
    simulation.record("thermal.csv").expect("a possible recording")
}

/// Without the rig's attitudes, as of a sensor on a table; or with them.
fn calibrated(recording: &Recording, on_rig: bool) -> Calibration {
    let options = Options { skip: vec![SensorKind::Mag], multipliers: vec![4.0], ..Options::default() };
    let of_rests = Options { rig_acc: None, rig_gyr: None, rig_mag: None, ..options.clone() };
    calibrate(recording, if on_rig { &options } else { &of_rests }, &|_| {})
}

fn fit(calibration: &Calibration, kind: SensorKind) -> &FitSummary {
    let outcome = calibration.sensors.iter().find(|outcome| outcome.kind == kind).expect("recorded");
    // A suspect fit is judged as well.
    outcome.passed().unwrap_or_else(|| panic!("{kind} is refused: {:?}", outcome.verdict))
}

/// Errors of the terms that are kept, in standard errors: of biases, and of scales.
fn scores(calibration: &Calibration) -> [Vec<f64>; 2] {
    let mut all = [Vec::new(), Vec::new()];
    for (kind, bias) in KINDS.into_iter().zip(BIAS) {
        let fit = fit(calibration, kind);
        let Some((terms, std)) = fit.terms() else { continue };
        // The scale is one at 25 °C in the simulator, and at the reference in the calibration.
        let scale = SCALE / (1.0 + SCALE * (terms.linear.reference - 25.0));
        for (axis, bias) in bias.into_iter().enumerate() {
            let pairs = [
                (terms.linear.bias_slope[axis] - bias, std.linear.bias_slope[axis]),
                (terms.linear.scale_slope[axis] - scale, std.linear.scale_slope[axis]),
            ];
            let kept = all.iter_mut().zip(pairs).filter(|(_, (_, std))| *std > 0.0);
            kept.for_each(|(scores, (error, std))| scores.push(error / std));
        }
    }
    all
}

/// Errors of one part of the scores are one standard error rms, and there are as many as are needed.
fn assert_as_stated(of: &str, all: &[[Vec<f64>; 2]], part: usize, need: usize) {
    let scores: Vec<f64> = all.iter().flat_map(|of| of[part].iter().copied()).collect();
    let rms = (scores.iter().map(|score| score * score).sum::<f64>() / scores.len() as f64).sqrt();
    println!("{of} off by {rms:.3} standard errors rms, {} terms", scores.len());
    assert!(scores.len() >= need, "{of}: {}", scores.len());
    assert!((0.8..=1.1).contains(&rms), "{of}: {rms}");
}

#[test]
fn terms_are_off_by_what_their_standard_errors_say() {
    for (place, programme, on_rig) in PLACES {
        let all: Vec<[Vec<f64>; 2]> = SEEDS
            .into_par_iter()
            .map(|seed| scores(&calibrated(&recording(seed, programme, true), on_rig)))
            .collect();
        for (part, name) in ["biases", "scales"].into_iter().enumerate() {
            assert_as_stated(&format!("{place}: {name}"), &all, part, 60);
        }
    }
}

#[test]
fn held_out_temperatures_are_never_predicted_worse_with_the_terms_that_are_kept() {
    // Parts whose temperature is not refused: those with terms, and all.
    let kept = |warm: bool| -> (usize, usize) {
        let of = |seed: u64| {
            let calibration = calibrated(&recording(seed, Programme::Thermal, warm), true);
            let parts =
                KINDS.map(|kind| fit(&calibration, kind).temperature.clone().expect("looked for").parts);
            let any = |part: &&Part| part.tried.iter().any(|tried| tried.kept);
            for part in parts.iter().flatten().filter(any) {
                let (Some(without), Some(with)) = part.held_out else { panic!("seed {seed}: {part:?}") };
                assert!(with < without, "seed {seed}: {with} of {without}, {part:?}");
            }
            (parts.iter().flatten().filter(any).count(), parts.iter().flatten().count())
        };
        SEEDS.into_par_iter().map(of).reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1))
    };
    let (warm, cold) = (kept(true), kept(false));
    println!(
        "terms are kept of {} of {} parts that drift, and of {} of {} that do not",
        warm.0, warm.1, cold.0, cold.1
    );
    assert!(warm.1 >= 30 && 2 * warm.0 >= warm.1, "{warm:?}");
    assert!(cold.1 >= 30 && cold.0 as f64 <= 0.05 * cold.1 as f64, "{cold:?}");
}

#[test]
fn the_terms_go_into_the_record_with_their_errors_and_span() {
    let mut found = 0;
    for seed in SEEDS.take(8) {
        let calibration = calibrated(&recording(seed, Programme::Thermal, true), true);
        let Some((terms, std)) = fit(&calibration, SensorKind::Acc).raw_terms() else { continue };
        let stored = StoredCalibration::of(&calibration, Date::from_days(20_000));
        let record = stored.to_record("record".as_ref()).expect("it fits the record");
        let acc = record.acc.as_ref().expect("accepted");
        assert_eq!(acc.temperature.expect("terms"), terms.linear.cast());
        let quality = acc.order.warmth.expect("their errors");
        assert_eq!(quality.bias_slope_std, std.linear.bias_slope.map(|error| error as f32));
        assert!(quality.covers(terms.linear.reference as f32), "{quality:?}");
        found += 1;
    }
    assert!(found > 0, "no recording with terms");
}

fn refusal(recording: &Recording) -> TemperatureRefusal {
    let calibration = calibrated(recording, true);
    let found = fit(&calibration, SensorKind::Acc).temperature.as_ref().expect("looked for");
    assert!(found.terms.is_none(), "{found:?}");
    found.refusal.unwrap_or_else(|| panic!("not refused: {found:?}"))
}

/// With temperatures of one's own, of time as a share of the recording.
fn at(temperature: impl Fn(f64) -> f64) -> Recording {
    let mut recording = recording(3, Programme::Thermal, false);
    let end = recording.time.last().copied().expect("rows");
    recording.temperature = Some(recording.time.iter().map(|time| temperature(time / end)).collect());
    recording
}

/// Up and down again, °C.
fn hill(share: f64) -> f64 {
    20.0 + 30.0 * (std::f64::consts::PI * share).sin()
}

#[test]
fn a_constant_temperature_is_refused() {
    assert!(matches!(
        refusal(&at(|share| 25.0 + 0.3 * (90.0 * share).sin())),
        TemperatureRefusal::Narrow { .. }
    ));
}

#[test]
fn a_temperature_that_runs_with_time_alone_is_refused() {
    assert!(matches!(refusal(&at(|share| 20.0 + 25.0 * share)), TemperatureRefusal::AloneWithTime { .. }));
}

#[test]
fn a_thermometer_that_is_stuck_or_jumps_is_refused() {
    let stuck = at(|share| if share > 0.4 { hill(0.4) } else { hill(share) });
    assert!(matches!(refusal(&stuck), TemperatureRefusal::Stuck { .. }), "{:?}", refusal(&stuck));
    let jump = at(|share| hill(share) + if share > 0.6 { 15.0 } else { 0.0 });
    assert!(matches!(refusal(&jump), TemperatureRefusal::Jump { .. }), "{:?}", refusal(&jump));
}

/// Errors of the terms that a session of a device finds, in its standard errors, as [`scores`] has them.
fn scores_of_session(recording: &Recording) -> [Vec<f64>; 2] {
    let task = capture::task(&recording.manifest, capture::targets(recording)).expect("a task");
    let session = capture::replay(recording, &task, &mut |_, _| {}).expect("a session");
    let mut all = [Vec::new(), Vec::new()];
    for (sensor, bias) in [Sensor::Accelerometer, Sensor::Gyroscope].into_iter().zip(BIAS) {
        let Ok(mut fit) = session.warmth(sensor) else { continue };
        while fit.work() {}
        let Some(warm) = fit.found() else { continue };
        let scale = SCALE / (1.0 + SCALE * (f64::from(warm.terms.reference) - 25.0));
        for (axis, bias) in bias.into_iter().enumerate() {
            let pairs = [
                (warm.terms.bias_slope[axis], bias, warm.terms_std.bias_slope[axis]),
                (warm.terms.scale_slope[axis], scale, warm.terms_std.scale_slope[axis]),
            ];
            for (scores, (found, truth, std)) in
                all.iter_mut().zip(pairs).filter(|(_, (_, _, std))| *std > 0.0)
            {
                scores.push((f64::from(found) - truth) / f64::from(std));
            }
        }
    }
    all
}

#[test]
fn a_session_of_a_device_finds_terms_of_temperature_within_its_own_errors() {
    let all: Vec<[Vec<f64>; 2]> = SEEDS
        .into_par_iter()
        .map(|seed| scores_of_session(&recording(seed, Programme::Full, true)))
        .collect();
    for (part, name) in ["biases", "scales"].into_iter().enumerate() {
        assert_as_stated(&format!("on a device: {name}"), &all, part, 30);
    }
}

#[test]
fn a_session_of_a_device_finds_no_terms_where_warmth_does_nothing() {
    let none = SEEDS.into_par_iter().filter(|seed| {
        scores_of_session(&recording(*seed, Programme::Full, false)).iter().all(Vec::is_empty)
    });
    let (none, of) = (none.count(), SEEDS.count());
    println!("on a device: no terms in {none} of {of} sessions without drift");
    assert!(none as f64 >= 0.95 * of as f64, "{none}");
}

//! Recordings of real sensors: terms taken out of the baseline are named with their size, a magnet is found, and two parts
//! of one recording seldom differ.

use std::cell::OnceCell;

use imucal_host::{
    calibrate::{self, Calibration, calibrate},
    diagnosis::{Diagnosis, Options, Verdict, diagnose, finding::Cause},
    observe::motion::of_reference,
    recording::{Recording, SensorKind},
    store::StoredCalibration,
};
use imucal_tests::{data, part::part};
use nalgebra::{Matrix3, Vector3};

/// Recordings in a hand.
const HAND: [&str; 3] = ["xsens-mti", "mpu9150-0", "mpu9150-1"];
/// Whitened squared size from which on a term can be shown, as in the diagnosis itself.
const SEEN: f64 = 25.0;
/// Share of splits in which a part may seem to differ from the other.
const FALSE_ALARMS: f64 = 0.05;

fn read(name: &str) -> Option<Recording> {
    Some(Recording::read(&data::real(&format!("{name}.csv.gz"))?).expect("a good recording"))
}

fn without(recording: &Recording, terms: &[&str]) -> Diagnosis {
    let without = terms.iter().map(ToString::to_string).collect();
    diagnose(recording, &Options { without, ..Default::default() }, &|_| ())
}

fn against(recording: &Recording, model: &StoredCalibration) -> Diagnosis {
    diagnose(recording, &Options { model: Some(model.clone()), ..Default::default() }, &|_| ())
}

fn names(diagnosis: &Diagnosis) -> Vec<&str> {
    let mut names: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.effect.as_str()).collect();
    names.sort_unstable();
    names
}

fn model(recording: &Recording) -> StoredCalibration {
    let calibration = calibrate(recording, &calibrate::Options::default(), &|_| ());
    StoredCalibration::of(&calibration, imucal_core::record::Date::from_unix(0))
}

/// A sensor by the full calibration, in the axes in which the accelerometer's K is symmetric, where it has one; `None`
/// where its own is refused.
fn calibrated(calibration: &Calibration, kind: SensorKind) -> Option<Calibrated> {
    let fit = |kind| calibration.sensor(kind).and_then(|outcome| outcome.accepted());
    let turn = fit(SensorKind::Acc).map_or_else(Matrix3::identity, |acc| {
        let svd = acc.triad.gain.try_inverse().expect("regular").svd(true, true);
        svd.u.expect("asked for") * svd.v_t.expect("asked for")
    });
    let fit = fit(kind)?;
    let k = (turn * fit.triad.gain).try_inverse().expect("regular");
    Some(Calibrated { k, bias: fit.triad.bias, gain_std: fit.gain_std, bias_std: fit.bias_std })
}

/// A triad with standard errors.
struct Calibrated {
    k: Matrix3<f64>,
    bias: Vector3<f64>,
    gain_std: Matrix3<f64>,
    bias_std: Vector3<f64>,
}

/// What a term is by the full calibration, component by component, with standard errors.
fn expected(calibration: &Calibration, kind: SensorKind, term: &str) -> Option<Vec<(f64, f64)>> {
    let Calibrated { k, bias, gain_std, bias_std } = calibrated(calibration, kind)?;
    Some(match term {
        "bias" => (0..3).map(|axis| (bias[axis], bias_std[axis])).collect(),
        "scale" => (0..3).map(|axis| (k[(axis, axis)] - 1.0, gain_std[(axis, axis)])).collect(),
        _ => [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)]
            .iter()
            .map(|(row, column)| {
                let std = gain_std[(*row, *column)].max(gain_std[(*column, *row)]);
                (k[(*row, *column)] / k[(*column, *column)], std)
            })
            .collect(),
    })
}

/// Root mean square of the differences from the full calibration, in standard errors of the difference.
fn off(cause: &Cause, expected: &[(f64, f64)]) -> f64 {
    let squares = cause.parameters.iter().zip(expected).map(|(amount, (value, std))| {
        let own = amount.std_error.expect("estimated");
        (amount.value.expect("finite") - value).powi(2) / (own * own + std * std)
    });
    (squares.sum::<f64>() / expected.len() as f64).sqrt()
}

/// Recordings and their sensors; a hand lets gravity tell its attitude, and so shows nothing of a magnetometer.
const SHOWING: [(&str, &[SensorKind]); 4] = [
    ("xsens-mti", &[SensorKind::Acc, SensorKind::Gyr]),
    ("mpu9150-0", &[SensorKind::Acc, SensorKind::Gyr]),
    ("mpu9150-1", &[SensorKind::Acc, SensorKind::Gyr]),
    ("broad-01-undisturbed", &SensorKind::ALL),
];

#[test]
fn terms_removed_from_a_real_baseline_are_named_with_their_size() {
    let (mut named, mut sized, mut all) = (0, 0, 0);
    for (name, kinds) in SHOWING {
        let Some(recording) = read(name) else { return };
        let calibration = calibrate(&recording, &calibrate::Options::default(), &|_| ());
        let terms = kinds.iter().flat_map(|kind| ["bias", "scale", "misalignment"].map(|term| (*kind, term)));
        for (kind, term) in terms {
            let id = format!("{}.{term}", kind.prefix());
            let Some(expected) = expected(&calibration, kind, term) else {
                println!("{name:<20} {id:<18} cannot be shown: nothing to calibrate it by");
                continue;
            };
            let size: f64 = expected.iter().map(|(value, std)| (value / std).powi(2)).sum();
            if size < SEEN {
                println!("{name:<20} {id:<18} cannot be shown: {size:.0} in whitened squared size");
                continue;
            }
            all += 1;
            let diagnosis = without(&recording, &[&id]);
            let Some(cause) = diagnosis.causes.iter().find(|cause| cause.effect == id) else {
                println!("{name:<20} {id:<18} not named: {:?} {expected:?}", names(&diagnosis));
                continue;
            };
            let off = off(cause, &expected);
            named += 1;
            sized += usize::from(off < 2.0);
            let amounts: Vec<String> = cause
                .parameters
                .iter()
                .map(|p| format!("{:.5} ± {:.5}", p.value.expect("finite"), p.std_error.expect("estimated")))
                .collect();
            println!("{name:<20} {id:<18} named, off by {off:.1} standard errors: {}", amounts.join(", "));
        }
    }
    println!("{named} of {all} named, {sized} of them within 2 standard errors of the full calibration");
    assert!(10 * named >= 9 * all, "{named} of {all}");
    assert!(10 * sized >= 8 * named, "{sized} of {named}");
    assert!(all >= 20, "{all} terms can be shown");
}

#[test]
fn a_hand_recording_lists_what_it_cannot_show_and_why() {
    for name in HAND {
        let Some(recording) = read(name) else { return };
        let diagnosis = without(&recording, &[]);
        assert!(diagnosis.held_out, "{name}");
        for id in
            ["rig.level_tilt", "rig.encoder_offset", "clk.time_offset", "gyr.earth_rate", "acc.gravity_error"]
        {
            let why = diagnosis.not_testable.iter().find(|not| not.effect == id).expect("it is listed");
            assert!(!why.because.is_empty());
        }
        // A term of the baseline that is in its place is no gap.
        let terms = [".bias", ".scale", ".misalignment"];
        assert!(!names(&diagnosis).iter().any(|id| terms.iter().any(|term| id.ends_with(term))));
    }
}

#[test]
fn too_few_rests_in_a_hand_are_not_diagnosed() {
    let Some(recording) = read("mpu6050-unobservable") else { return };
    let diagnosis = without(&recording, &[]);
    assert_eq!(diagnosis.verdict, Verdict::NotTestable);
    assert!(diagnosis.causes.is_empty());
    assert!(
        diagnosis.remarks[0].contains("the accelerometer's calibration is refused"),
        "{:?}",
        diagnosis.remarks
    );
}

/// Two recordings, in each of which every other rest is not seen by the accelerometer.
fn every_other(recording: &Recording) -> [Recording; 2] {
    let calibration = calibrate(recording, &calibrate::Options::default(), &|_| ());
    let rests = calibration.segmentation.expect("it has an accelerometer").rests;
    [0, 1].map(|first| {
        let mut part = recording.clone();
        let acc = part.acc.as_mut().expect("it has one");
        for rows in rests.iter().skip(first).step_by(2) {
            acc.values[rows.clone()].fill(Vector3::repeat(f64::NAN));
        }
        part
    })
}

/// Two parts of a recording, and how it was split.
type Split = (&'static str, [Recording; 2]);

/// Halves, and every other rest where a hand held it to many.
fn splits(recording: &Recording, by_rest: bool) -> Vec<Split> {
    let middle = recording.rows() / 2;
    let halves = [part(recording, 0..middle), part(recording, middle..recording.rows())];
    let mut splits = vec![("halves", halves)];
    splits.extend(by_rest.then(|| ("rests", every_other(recording))));
    splits
}

#[test]
fn two_parts_of_one_recording_seldom_differ() {
    let (mut alarms, mut count) = (0u32, 0u32);
    for name in HAND.into_iter().chain(["broad-01-undisturbed"]) {
        let Some(recording) = read(name) else { return };
        for (how, [one, other]) in splits(&recording, HAND.contains(&name)) {
            // What either part shows on its own is no difference between the two: that of the part calibrated has bent its
            // model. Asked only where a difference is named.
            let own = OnceCell::new();
            let of_own = || [&one, &other].map(|part| without(part, &[]));
            let is_own = |id: &str| own.get_or_init(of_own).iter().any(|own| names(own).contains(&id));
            for (direction, calibrated, diagnosed) in [("forth", &one, &other), ("back", &other, &one)] {
                let model = model(calibrated);
                let modelled = if HAND.contains(&name) { SensorKind::Acc } else { SensorKind::Gyr };
                assert!(model.triad(modelled).is_some(), "{name} {how} {direction}: no model");
                let diagnosis = against(diagnosed, &model);
                let differing: Vec<&str> = names(&diagnosis).into_iter().filter(|id| !is_own(id)).collect();
                count += 1;
                alarms += u32::from(!differing.is_empty());
                println!("{name:<20} {how} {direction}: {:?} {differing:?}", diagnosis.verdict);
            }
        }
    }
    println!("{alarms} false alarms in {count} splits");
    assert!(f64::from(alarms) <= FALSE_ALARMS * f64::from(count), "{alarms} of {count}");
}

/// What the magnetometer shows more `during` some times than the field of the others, turned by the reference alone, µT.
fn added(recording: &Recording, calm: impl Fn(f64) -> bool, during: impl Fn(f64) -> bool) -> Vector3<f64> {
    let attitudes = of_reference(recording.reference.as_deref().expect("an optical reference"));
    let samples = &recording.mag.as_ref().expect("a magnetometer").values;
    let rows = || recording.time.iter().zip(attitudes.iter().zip(samples));
    let known = || {
        rows().filter_map(|(time, (c_t_n, b))| Some((*time, (*c_t_n)?, *b))).filter(|(.., b)| b.x.is_finite())
    };
    let mean = |each: Vec<Vector3<f64>>| each.iter().sum::<Vector3<f64>>() / each.len() as f64;
    let field = mean(known().filter(|(time, ..)| calm(*time)).map(|(_, c_t_n, b)| c_t_n * b).collect());
    mean(known().filter(|(time, ..)| during(*time)).map(|(_, c_t_n, b)| b - c_t_n.tr_mul(&field)).collect())
}

#[test]
fn a_magnet_that_came_near_is_named_with_its_field_and_its_times() {
    let Some(calm) = read("broad-01-undisturbed") else { return };
    let Some(disturbed) = read("broad-32-magnet-1cm") else { return };
    let diagnosis = against(&disturbed, &model(&calm));
    let cause = diagnosis.causes.iter().find(|cause| cause.effect == "mag.bias_step").expect("it is named");
    let value = |name: &str| {
        cause.parameters.iter().find(|p| p.name == name).expect("it has it").value.expect("finite")
    };
    println!("magnet: {:?}", cause.parameters);
    println!(
        "{:?}: {:?}, closed {:?}",
        diagnosis.verdict,
        names(&diagnosis),
        diagnosis.gap_closed_total_ci95
    );
    assert!((value("t_start") - 38.5).abs() < 1.5 && (value("t_end") - 95.0).abs() < 1.5);
    let magnet = Vector3::new(value("x"), value("y"), value("z"));
    let plain = added(&disturbed, |t| !(36.0..98.0).contains(&t), |t| (42.0..92.0).contains(&t));
    assert!((magnet - plain).amax() < 1.0, "{magnet} {plain}");
    assert!(diagnosis.gap_closed_total.expect("causes") >= 0.9);
}

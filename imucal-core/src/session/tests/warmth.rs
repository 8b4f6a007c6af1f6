//! Sessions in which the sensor warms and cools.

use std::vec::Vec;

use nalgebra::Vector3;

use super::*;
use crate::{
    fit::Units,
    observer::thermometer::ThermometerFault,
    record::{FitQuality, RawUnit, TriadRecord},
    session::{
        axes::Axes,
        store::NotStored,
        temperature::{NoWarmth, WarmTriad},
    },
};

/// Growth of the biases, SI per kelvin, and of the accelerometer's scale.
const SLOPES: [[f64; 3]; 2] = [[2.1e-3, -1.3e-3, 0.8e-3], [2.4e-4, -1.6e-4, 3.1e-4]];
const SCALE: f64 = 1.5e-4;
const UNITS: Units =
    Units { raw: RawUnit::Counts, calibrated: RawUnit::MetrePerSecondSquared, offset: 0.0, per_unit: 1000.0 };

/// 36 poses all round, of three seconds each.
fn session(seed: u64, climate: fn(f64) -> f64, warm: bool) -> (Hand, Held) {
    let mut hand = Hand::new(seed);
    hand.climate = Some(climate);
    if warm {
        for (terms, slopes) in hand.warmth.iter_mut().zip(SLOPES) {
            terms.bias_slope = slopes;
        }
        hand.warmth[0].scale_slope = [SCALE; 3];
    }
    let mut session = Held::new(SessionSettings::default());
    hand.rest(&mut session, 3.0);
    for k in 0..36u16 {
        // A spiral from pole to pole, in an order that is not that of the sphere.
        let place = f32::from(k * 23 % 36);
        let z = 1.0 - (2.0 * place + 1.0) / 36.0;
        let (sin, cos) = (2.4 * place).sin_cos();
        let across = (1.0 - z * z).sqrt();
        hand.pose(&mut session, &Vector3::new(across * cos, across * sin, z));
    }
    session.finish();
    while session.work() {}
    (hand, session)
}

/// 20 °C, 35 °C and 20 °C again within the 180 s of a session.
fn hill(time: f64) -> f64 {
    20.0 + 15.0 * (std::f64::consts::PI * time / 180.0).sin()
}

fn found(session: &Held, sensor: Sensor) -> Option<WarmTriad> {
    let mut fit = session.warmth(sensor).expect("temperatures");
    while fit.work() {}
    fit.found()
}

/// Errors of the terms found, in standard errors: of biases, of scales.
fn scores(warm: &WarmTriad, hand: &Hand, k: usize) -> [Vec<f64>; 2] {
    let truth = hand.warmth[k].from_reference(warm.terms.reference.into());
    let score = |found: [f32; 3], std: [f32; 3], truth: [f64; 3]| {
        let all = found.iter().zip(std).zip(truth).filter(|((_, std), _)| *std > 0.0);
        all.map(|((found, std), truth)| (f64::from(*found) - truth) / f64::from(std)).collect()
    };
    [
        score(warm.terms.bias_slope, warm.terms_std.bias_slope, truth.bias_slope),
        score(warm.terms.scale_slope, warm.terms_std.scale_slope, truth.scale_slope),
    ]
}

#[test]
fn terms_of_temperature_are_off_by_what_their_standard_errors_say() {
    let sensors = [Sensor::Accelerometer, Sensor::Gyroscope];
    let (mut biases, mut scales) = (Vec::new(), Vec::new());
    for seed in 0..24 {
        let (hand, session) = session(seed, hill, true);
        for (k, sensor) in sensors.into_iter().enumerate() {
            let Some(warm) = found(&session, sensor) else { continue };
            let [of_biases, of_scales] = scores(&warm, &hand, k);
            biases.extend(of_biases);
            scales.extend(of_scales);
            assert!(warm.span.1 - warm.span.0 > 10.0, "{:?}", warm.span);
        }
    }
    for (name, scores) in [("biases", &biases), ("scales", &scales)] {
        let rms = (scores.iter().map(|score| score * score).sum::<f64>() / scores.len().max(1) as f64).sqrt();
        std::println!("{name}: off by {rms:.3} standard errors rms, {} terms", scores.len());
        assert!(scores.len() >= 60 && (0.8..1.2).contains(&rms), "{name}: {rms}, {}", scores.len());
    }
}

#[test]
fn a_sensor_that_warmth_does_not_change_gets_no_terms() {
    let none = (100..124).filter(|seed| {
        let (_, session) = session(*seed, hill, false);
        [Sensor::Accelerometer, Sensor::Gyroscope].iter().all(|sensor| found(&session, *sensor).is_none())
    });
    assert!(none.count() >= 23);
}

#[test]
fn temperatures_that_show_nothing_are_refused() {
    let refused = |climate| session(3, climate, true).1.warmth(Sensor::Accelerometer).expect_err("a refusal");
    assert!(matches!(refused(|_| 25.0), NoWarmth::Narrow { .. }));
    assert!(matches!(refused(|time| 20.0 + 0.1 * time), NoWarmth::AloneWithTime { .. }));
    let jumps = refused(|time| hill(time) + if time > 90.0 { 12.0 } else { 0.0 });
    assert!(matches!(jumps, NoWarmth::Thermometer(ThermometerFault::Jump { .. })), "{jumps:?}");
    let stuck = refused(|time| hill(f64::min(time, 60.0)));
    assert!(matches!(stuck, NoWarmth::Thermometer(ThermometerFault::Stuck { .. })), "{stuck:?}");
    assert_eq!(refused(|time| if time > 90.0 { f64::NAN } else { 25.0 }), NoWarmth::NotMeasured);
    let session = Held::new(SessionSettings::default());
    assert_eq!(session.warmth(Sensor::Magnetometer).err(), Some(NoWarmth::OtherSensor));
    assert_eq!(session.warmth(Sensor::Gyroscope).err(), Some(NoWarmth::NotMeasured));
}

fn record(session: &Held, stored: Option<&TriadRecord>) -> Result<TriadRecord, NotStored> {
    let mut fit = session.warmth(Sensor::Accelerometer).expect("temperatures");
    while fit.work() {}
    session.better_warm(Sensor::Accelerometer, &fit, &UNITS, stored, &Axes::Own)
}

#[test]
fn a_record_of_a_warm_session_corrects_at_every_temperature_and_one_without_does_not() {
    let (hand, session) = session(5, hill, true);
    let warm = record(&session, None).expect("accepted");
    let cold =
        session.better(Sensor::Accelerometer, &UNITS, None::<&TriadRecord>, &Axes::Own).expect("accepted");
    let off = |record: &TriadRecord, temperature: f64| {
        let truth = Vector3::new(3.0, -4.0, 8.0);
        let raw = hand.warmth[0].predict(&hand.truth[0], &truth, temperature).expect("regular") * 1000.0;
        let triad = record.triad::<f64>();
        let terms = record.temperature.map(|terms| terms.cast::<f64>());
        let value =
            terms.map_or_else(|| triad.correct(&raw), |terms| terms.correct(&triad, &raw, temperature));
        (value.norm() - truth.norm()).abs()
    };
    for temperature in [20.0, 27.0, 35.0] {
        assert!(off(&warm, temperature) < 0.006, "{temperature}: {}", off(&warm, temperature));
    }
    assert!(off(&cold, 20.0) > 0.006 || off(&cold, 35.0) > 0.006);
    assert_eq!(warm.check(Sensor::Accelerometer), Ok(()));
    assert!(matches!(record(&session, Some(&warm)), Err(NotStored::Surer { .. })));
}

#[test]
fn a_later_session_of_one_temperature_keeps_the_terms_of_the_record() {
    let warm = record(&session(5, hill, true).1, None).expect("accepted");
    let vague = TriadRecord { quality: FitQuality { bias_std: [1e3; 3], ..warm.quality }, ..warm.clone() };
    let (_, later) = session(6, |_| 30.0, false);
    let new = later.better(Sensor::Accelerometer, &UNITS, Some(&vague), &Axes::Own).expect("surer");
    let (terms, before) = (new.temperature.expect("terms"), warm.temperature.expect("terms"));
    assert_eq!((terms.reference, terms.bias_slope), (30.0, before.bias_slope));
    let other = Units { raw: RawUnit::MetrePerSecondSquared, ..UNITS };
    assert_eq!(
        later.better(Sensor::Accelerometer, &other, Some(&vague), &Axes::Own).expect("surer").temperature,
        None
    );
}

#[test]
fn a_warm_session_keeps_the_terms_of_the_record_that_rests_do_not_show() {
    let (_, session) = session(5, hill, true);
    let mut fit = session.warmth(Sensor::Gyroscope).expect("temperatures");
    while fit.work() {}
    let units = Units { calibrated: RawUnit::RadianPerSecond, ..UNITS };
    let alone = session
        .better_warm(Sensor::Gyroscope, &fit, &units, None::<&TriadRecord>, &Axes::Own)
        .expect("accepted");
    assert_eq!(alone.temperature.expect("terms").scale_slope, [0.0; 3]);
    let known = TemperatureTerms { reference: 27.0, bias_slope: [9.0; 3], scale_slope: [1e-4; 3] };
    let vague = TriadRecord {
        temperature: Some(known),
        quality: FitQuality { bias_std: [1e3; 3], ..alone.quality },
        ..alone.clone()
    };
    let new = session.better_warm(Sensor::Gyroscope, &fit, &units, Some(&vague), &Axes::Own).expect("surer");
    let (terms, own) = (new.temperature.expect("terms"), alone.temperature.expect("terms"));
    assert_eq!((terms.reference, terms.bias_slope), (own.reference, own.bias_slope));
    assert_eq!(terms.scale_slope, known.from_reference(own.reference).scale_slope);
}

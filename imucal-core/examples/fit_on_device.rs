//! Calibrates an accelerometer as a device does: its rests, a fit, acceptance, a record in a page of flash.
//!
//! `calibrate` and what it calls run on a device as they stand: they allocate nothing and do not panic. What is around
//! them stands for the sensor.
//!
//! `cargo run -p imucal-core --example fit_on_device`

use std::error::Error;

use imucal_core::{
    accept::{Limits, Refusal},
    fit::{Criteria, FitSummary, Observed, Units, standard_errors},
    model::{norm::NormModel, parameterisation::UPPER_TRIANGULAR},
    observation::{Moments, ShellPoint},
    record::{self, CalibrationRecord, Date, RawUnit, SensorIdentity, TriadRecord},
    solver::LevenbergMarquardt,
    triad::Triad,
};
use nalgebra::{Matrix3, Vector3};

/// Local gravity, m/s².
const GRAVITY: f32 = 9.80665;
/// Here the driver gives nominal m/s², and the record keeps them.
const UNITS: Units = Units {
    raw: RawUnit::MetrePerSecondSquared,
    calibrated: RawUnit::MetrePerSecondSquared,
    offset: 0.0,
    per_unit: 1.0,
};
/// Rests that are waited for.
const RESTS: usize = 18;
/// Samples of a rest.
const SAMPLES: usize = 50;

/// The model T9 fitted to rests, ready for a record; or why these rests do not determine it.
fn calibrate(rests: &[Moments<f32>; RESTS]) -> Result<TriadRecord, Refusal> {
    let points = rests.map(|rest| ShellPoint::new(rest.mean()));
    let model = NormModel { points: &points, norm: GRAVITY, form: UPPER_TRIANGULAR };
    let start = UPPER_TRIANGULAR.theta(&Triad::identity());
    let mut solver = LevenbergMarquardt::new(start, Default::default());
    // A step is a pass over the points or two: a main loop may do other work between them.
    while solver.step(&model).is_none() {}
    let triad = UPPER_TRIANGULAR.triad(solver.theta());
    let std = UPPER_TRIANGULAR.triad(&standard_errors(&solver.covariance()));
    let limits = Limits::for_norm(9, 10);
    let observed = Observed::Points(&points);
    let criteria = Criteria { observed, limits, radius: GRAVITY, nonlinearity: true };
    let summary = FitSummary::of(&solver, &model, &triad, &criteria);
    summary.check(&triad, &std, &criteria)?;
    Ok(summary.record(&triad, &std, "T9", &UNITS))
}

/// What the sensor is like; a calibration is to undo it.
fn sensor() -> Triad<f32> {
    Triad {
        gain: Matrix3::new(1.02, 0.01, -0.004, 0.0, 0.98, 0.006, 0.0, 0.0, 1.01),
        bias: Vector3::new(0.3, -0.2, 0.15),
    }
}

/// The sensor at rest in one of its poses, which go round the sphere.
fn rest(pose: usize) -> Moments<f32> {
    let z = 1.0 - (2 * pose + 1) as f32 / RESTS as f32;
    let (sin, cos) = (2.4 * pose as f32).sin_cos();
    let up = Vector3::new(cos * (1.0 - z * z).sqrt(), sin * (1.0 - z * z).sqrt(), z);
    let clean = sensor().predict(&(up * GRAVITY)).unwrap_or_default();
    let mut moments = Moments::default();
    for sample in 0..SAMPLES {
        let noise = |axis: usize| 0.02 * ((pose * SAMPLES + sample) as f32 * 12.9 + axis as f32 * 4.1).sin();
        moments.push(&(clean + Vector3::from_fn(|axis, _| noise(axis))));
    }
    moments
}

fn main() -> Result<(), Box<dyn Error>> {
    let acc = calibrate(&std::array::from_fn(rest))?;
    let found: Triad<f32> = acc.triad();
    println!("bias found {:?}, true {:?}", found.bias.as_slice(), sensor().bias.as_slice());

    let identity = SensorIdentity { name: "example".parse()?, serial: "17".parse()? };
    let record =
        CalibrationRecord { acc: Some(acc), ..CalibrationRecord::empty(identity, Date::from_days(20_000)) };
    let mut page = [0xFF; record::MAX_LEN];
    let bytes = record::encode(&record, &mut page)?;
    println!("a record of {} bytes", bytes.len());
    assert_eq!(record::decode(bytes)?, record);
    Ok(())
}

//! Calibrates an accelerometer as a device does: its rests, a fit, acceptance, a record in a page of flash.
//!
//! `calibrate` and what it calls run on a device as they stand: they allocate nothing and do not panic. What is around
//! them stands for the sensor.
//!
//! `cargo run -p imucal-core --example fit_on_device`

use std::error::Error;

use imucal_core::{
    accept::{self, Limits, Refusal},
    coverage::Coverage,
    model::{norm::NormModel, parameterisation::UPPER_TRIANGULAR},
    observation::{Moments, ShellPoint},
    record::{self, CalibrationRecord, Date, FitQuality, RawUnit, SensorIdentity, TriadRecord},
    solver::LevenbergMarquardt,
    triad::Triad,
};
use nalgebra::{Matrix3, Vector3};

/// Local gravity, m/s².
const GRAVITY: f32 = 9.80665;
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
    judge(&model, &solver)
}

/// Asks of a fit all that `accept` asks.
fn judge(model: &NormModel<'_, f32, 9>, solver: &LevenbergMarquardt<f32, 9>) -> Result<TriadRecord, Refusal> {
    let triad = UPPER_TRIANGULAR.triad(solver.theta());
    let limits = Limits::for_norm(9, 10);
    let directions = model.points.iter().map(|point| triad.correct(&point.value).normalize());
    let coverage = Coverage::of(directions);
    accept::check_observations(&coverage, 9, &limits)?;
    accept::check_report(&solver.report())?;
    let covariance = solver.covariance().ok_or(Refusal::NotFinite)?;
    let std = UPPER_TRIANGULAR.triad(&covariance.diagonal().map(libm::sqrtf));
    let error = accept::relative_error(&triad.gain, &std, GRAVITY);
    accept::check_precision(error, &limits)?;
    accept::check_nonlinearity(accept::nonlinearity(solver, model, 1.0), error, &limits)?;
    let rms = solver.variance().map_or(f32::NAN, libm::sqrtf);
    accept::check_plausibility(&triad, true, rms / GRAVITY, &limits)?;
    let quality = FitQuality {
        gain_std: rows(&std.gain),
        bias_std: std.bias.into(),
        rms,
        held_out_rms: None,
        observations: RESTS as u32,
        parameters: 9,
        condition: solver.report().condition,
        coverage: coverage.share,
        field_norm: None,
    };
    Ok(in_record(&triad, quality))
}

/// A triad as a record has it.
fn in_record(triad: &Triad<f32>, quality: FitQuality) -> TriadRecord {
    TriadRecord {
        gain: rows(&triad.gain),
        bias: triad.bias.into(),
        unit_in: RawUnit::MetrePerSecondSquared,
        unit_out: RawUnit::MetrePerSecondSquared,
        model: "T9".parse().unwrap_or_default(),
        temperature: None,
        quality,
    }
}

fn rows(matrix: &Matrix3<f32>) -> [[f32; 3]; 3] {
    matrix.transpose().into()
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

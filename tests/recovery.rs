//! Simulated recordings: errors against the truth are as large as the standard errors say, no more and no less.

use imucal_core::triad::Triad;
use imucal_host::{
    calibrate::{Options, calibrate},
    recording::SensorKind,
    simulator::{SimulatedUnit, Tumble, record},
};
use nalgebra::{Matrix3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Uniform};
use rayon::prelude::*;

/// Recordings.
const RECORDINGS: u64 = 30;
/// Rests in each.
const RESTS: usize = 30;

/// A unit with errors of its own: gains off by 3 %, axes by 0.03, biases as of raw MEMS sensors. Accelerometer and
/// magnetometer keep an upper triangular gain, the gauge of a norm.
fn unit(seed: u64) -> SimulatedUnit {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let share = Uniform::new_inclusive(-1.0, 1.0).expect("a range");
    let mut unit = SimulatedUnit::mtx();
    for (sensor, full, bias) in
        [(&mut unit.acc, false, 1.0), (&mut unit.gyr, true, 0.05), (&mut unit.mag, false, 10.0)]
    {
        let gain = Matrix3::from_fn(|i, j| {
            let off = 0.03 * share.sample(&mut rng);
            if i == j {
                1.0 + off
            } else if i < j || full {
                off
            } else {
                0.0
            }
        });
        let bias = Vector3::from_fn(|_, _| bias * share.sample(&mut rng));
        sensor.truth = Triad { gain, bias }.in_unit(sensor.counts.offset, sensor.counts.per_unit);
    }
    unit
}

/// Errors in standard errors of one sensor: those of its gain, those of its bias.
type Scores = (SensorKind, Vec<f64>, Vec<f64>);

fn scores(seed: u64) -> Vec<Scores> {
    let unit = unit(seed);
    let recording = record("recovery.csv", &Tumble::new(RESTS, 100 + seed), &unit, 200 + seed);
    let calibration = calibrate(&recording, &Options::default(), &|_| {});
    SensorKind::ALL
        .into_iter()
        .map(|kind| {
            let outcome = calibration.sensor(kind).expect("recorded");
            let fit =
                outcome.accepted().unwrap_or_else(|| panic!("seed {seed}, {kind}: {:?}", outcome.verdict));
            let (found, truth) = (fit.raw_triad(), unit.sensor(kind).truth);
            let (gain_std, bias_std) = fit.raw_std();
            let of = |found: &[f64], truth: &[f64], std: &[f64]| -> Vec<f64> {
                found
                    .iter()
                    .zip(truth)
                    .zip(std)
                    .filter(|(_, std)| **std > 0.0)
                    .map(|((found, truth), std)| (found - truth) / std)
                    .collect()
            };
            (
                kind,
                of(found.gain.as_slice(), truth.gain.as_slice(), gain_std.as_slice()),
                of(found.bias.as_slice(), truth.bias.as_slice(), bias_std.as_slice()),
            )
        })
        .collect()
}

/// Mean and standard deviation.
fn moments(scores: &[f64]) -> (f64, f64) {
    let count = scores.len() as f64;
    let mean = scores.iter().sum::<f64>() / count;
    (mean, (scores.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt())
}

#[test]
fn errors_of_thirty_recordings_are_as_large_as_their_standard_errors() {
    let all: Vec<Scores> = (0..RECORDINGS).into_par_iter().flat_map(scores).collect();
    let mut pooled = Vec::new();
    for kind in SensorKind::ALL {
        let of = |pick: &dyn Fn(&Scores) -> &Vec<f64>| -> Vec<f64> {
            all.iter().filter(|s| s.0 == kind).flat_map(|s| pick(s).clone()).collect()
        };
        let (gain, bias) = (of(&|s| &s.1), of(&|s| &s.2));
        println!(
            "{kind}: gain {:.3?} of {}, bias {:.3?} of {}",
            moments(&gain),
            gain.len(),
            moments(&bias),
            bias.len()
        );
        pooled.extend(gain);
        pooled.extend(bias);
    }
    let (mean, std) = moments(&pooled);
    println!("pooled: {mean:.3}, {std:.3} of {}", pooled.len());
    assert_eq!(pooled.len(), 30 * (9 + 12 + 12), "every parameter of every recording");
    // A thousand scores, hardly correlated from recording to recording: their mean is known to about 0.05 and their
    // spread to about 0.04. A variance estimated from 21 degrees of freedom widens the accelerometer's by 5 %, and drift
    // that these minutes of white noise cannot exclude widens the biases' by a third.
    assert!(mean.abs() < 0.15, "{mean}");
    assert!((0.75..1.1).contains(&std), "{std}");
}

//! Clocks that run evenly, jump, wander or lose rows, along rates that are known at any time.

use nalgebra::{Rotation3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, Uniform};

use super::{super::binned::Binned, *};

/// Length of the runs, s; time between two samples, s; and of the bins.
const LENGTH: f64 = 240.0;
const STEP: f64 = 0.01;
/// Noise of a sample, rad/s.
const NOISE: f64 = 2e-3;

/// A rate that turns the unit about all axes at any time, as a robot does, drawn from a seed.
struct Turning([[f64; 3]; 12]);

impl Turning {
    fn of(rng: &mut ChaCha8Rng) -> Self {
        let (per_second, phase) = (Uniform::new(0.2, 2.0).unwrap(), Uniform::new(0.0, 6.3).unwrap());
        let amplitude = Uniform::new(0.05, 0.3).unwrap();
        Self(std::array::from_fn(|_| [amplitude.sample(rng), per_second.sample(rng), phase.sample(rng)]))
    }

    /// rad/s at a time, s.
    fn rate(&self, time: f64) -> Vector3<f64> {
        self.0.iter().enumerate().fold(Vector3::zeros(), |mut sum, (at, [amplitude, per_second, phase])| {
            sum[at % 3] += amplitude * (std::f64::consts::TAU * per_second * time + phase).sin();
            sum
        })
    }
}

/// What is recorded and simulated, where the row of a time shows the stream of `shown`.
fn rates(rng: &mut ChaCha8Rng, shown: impl Fn(f64) -> f64) -> Rates {
    let turning = Turning::of(rng);
    let mount = Rotation3::from_euler_angles(0.3, -0.2, 0.5);
    let times = || (0..(LENGTH / STEP) as u32).map(|k| STEP * f64::from(k));
    let sensed = |time: f64| {
        let noise = Vector3::from_fn(|_, _| NOISE * Distribution::<f64>::sample(&StandardNormal, rng));
        (time, mount * turning.rate(shown(time)) + noise)
    };
    let real = Binned::new(times().map(sensed), STEP);
    // The stream goes on for some seconds, as a simulator's does.
    let ideal = Binned::new(times().map(|time| (1.1 * time, turning.rate(1.1 * time))), STEP);
    Rates { real, ideal }
}

fn judged(seed: u64, shown: impl Fn(f64) -> f64) -> Result<Steadiness, String> {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    // The coarse clock is that of the line through both ends.
    let pace = (shown(LENGTH) - shown(0.0)) / LENGTH;
    steadiness(&rates(rng, &shown), &StreamClock::even(shown(0.0) / pace, 1.0 / pace - 1.0))
}

#[test]
fn a_clock_that_runs_evenly_stays_as_it_is() {
    for seed in 0..6 {
        let shown = |time: f64| time + 0.004 + 2e-5 * time;
        let found = judged(seed, shown).unwrap();
        assert_eq!(found, Steadiness::even(found.clock.clone()), "{seed}");
        assert!((found.clock.stream_time(100.0) - shown(100.0)).abs() < 1e-9, "{seed}");
    }
}

#[test]
fn jumps_are_found_with_their_places_and_sizes() {
    let mut scores = Vec::new();
    for seed in 0..6 {
        let rng = &mut ChaCha8Rng::seed_from_u64(1000 + seed);
        let [at, later] = [60.0, 150.0].map(|from| Uniform::new(from, from + 40.0).unwrap().sample(rng));
        let by = Uniform::new(0.005, 0.2).unwrap().sample(rng);
        let shown =
            |time: f64| time + if time >= at { by } else { 0.0 } - if time >= later { 2.0 * by } else { 0.0 };
        let found = judged(seed, shown).unwrap();
        assert_eq!((found.jumps.len(), found.wander), (2, None), "{seed}: {:?}", found.jumps);
        for (jump, (at, by)) in found.jumps.iter().zip([(at, by), (later, -2.0 * by)]) {
            assert!(jump.within.start - 0.1 <= at && at <= jump.within.end + 0.1, "{seed}: {jump:?} {at}");
            scores.push((jump.by - by) / jump.error);
            println!(
                "{seed} {:.5} {:.6} {:.6} z {:.2} {:?}",
                by,
                jump.by - by,
                jump.error,
                (jump.by - by) / jump.error,
                jump.within
            );
        }
        for time in [20.0, 120.0, 220.0] {
            assert!((found.clock.stream_time(time) - shown(time)).abs() < 2e-4, "{seed}: {time}");
        }
    }
    let rms = (scores.iter().map(|z| z * z).sum::<f64>() / scores.len() as f64).sqrt();
    println!("errors over their standard errors: {rms:.2} rms");
    assert!(rms < 1.5, "{rms}");
}

#[test]
fn a_clock_that_wanders_is_followed() {
    for seed in 0..5 {
        let shown = |time: f64| time + 0.01 * (std::f64::consts::TAU * time / 80.0).sin();
        let found = judged(seed, shown).unwrap();
        let wander = found.wander.unwrap();
        assert!((wander - 0.01 / 2f64.sqrt()).abs() < 1.5e-3 && found.p_value < 1e-6, "{seed}: {wander}");
        let off = |k: u32| {
            let time = 2.0 * f64::from(k);
            (found.clock.stream_time(time) - shown(time)).abs()
        };
        let most = (0..119).map(off).fold(0.0, f64::max);
        assert!(most < 1e-3, "{seed}: {most}");
    }
}

#[test]
fn rows_that_are_lost_here_and_there_are_refused() {
    for seed in 0..5 {
        let rng = &mut ChaCha8Rng::seed_from_u64(2000 + seed);
        let mut lost = Vec::new();
        let share = Uniform::new(0.0, 1.0).unwrap();
        let mut at = 0.0;
        for _ in 0..(LENGTH / STEP) as u32 {
            at += if share.sample(rng) < 0.02 { 2.0 * STEP } else { STEP };
            lost.push(at);
        }
        let shown = |time: f64| lost[((time / STEP).round() as usize).min(lost.len() - 1)];
        assert!(judged(seed, shown).is_err_and(|why| why.contains("rows seem to be lost")), "{seed}");
    }
}

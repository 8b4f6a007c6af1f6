//! Hand recordings drawn from a seed, with the truth: rests in random attitudes, turns between them, noise of a kind.
//!
//! ```text
//! y = round((K v + b + noise) / step) · step
//! ```
//!
//! in nominal SI, every part kept apart, so that a fault can be put where it arises: into `input` or `clean` before the
//! noise, into `noise`, or into the finished recording. Earth's rotation is in the rates. Not simulated: linear
//! acceleration in the turns, tremor at rest, temperature.

use std::ops::Range;

use imucal_core::triad::Triad;
use nalgebra::{Matrix3, Unit, UnitQuaternion, Vector3};

use super::cell::{Cell, Coverage, Noise};
use crate::{
    effect::Input,
    recording::{
        Manifest, Recording, SensorKind, Unit as FileUnit,
        manifest::{Counts, Identity, Rig, RigKind, Site},
    },
    simulator::{
        Motion, Place, Tumble,
        random::{Purpose, Random},
    },
};

/// Sampling rate, Hz.
pub const RATE: f64 = 50.0;
/// Usual white noise of a sample of accelerometer (m/s²), gyroscope (rad/s) and magnetometer (µT).
const WHITE: [f64; 3] = [0.01, 0.1 * std::f64::consts::PI / 180.0, 0.1];
/// Largest error of a gain's entry, and of the three biases (m/s², rad/s, µT).
const GAIN: f64 = 0.03;
/// See [`GAIN`].
const BIAS: [f64; 3] = [1.0, 0.05, 10.0];
/// Where 1/f noise crosses white noise, Hz: from to.
const CORNER: (f64, f64) = (0.03, 0.5);
/// Correlation times of the processes that 1/f noise is the sum of, s: the shortest, and how many, each four times the
/// one before. Slower than the last, 1600 s, nothing moves: the triad's truth is the mean of many recordings, not that of
/// this one, by so much.
const FLICKER: (f64, i32) = (0.1, 8);
/// A step of the converter against the white noise of a sample: fine, and coarse from to.
const FINE_STEP: f64 = 0.25;
/// See [`FINE_STEP`].
const COARSE_STEP: (f64, f64) = (3.0, 8.0);

/// A hand recording in its parts. Arrays are in the order of [`SensorKind::ALL`]; all but the truth is nominal SI.
#[derive(Clone, Debug)]
pub struct Hand {
    /// Its cell of the grid.
    pub cell: Cell,
    /// Sample times, s.
    pub time: Vec<f64>,
    /// Rows of the rests, as the motion has them.
    pub rests: Vec<Range<usize>>,
    /// What the sensors are given, accelerometer's axes.
    pub input: Vec<Input>,
    /// The triads, nominal SI in: what a calibration ought to find, in the accelerometer's axes.
    pub truth: [Triad<f64>; 3],
    /// Output without noise and steps.
    pub clean: [Vec<Vector3<f64>>; 3],
    /// White and 1/f noise of the samples.
    pub noise: [Vec<Vector3<f64>>; 3],
    /// Steps of the converters.
    pub step: [f64; 3],
    /// Where.
    pub place: Place,
    /// Temperature, °C, where it is recorded.
    pub temperature: Option<Vec<f64>>,
}

impl Hand {
    /// The recording of a seed in a cell.
    pub fn draw(cell: Cell, seed: u64) -> Self {
        let motion = motion(cell, &mut Random::new(seed, Purpose::Schedule));
        let rows = (motion.tumble.duration() * RATE).floor() as usize;
        let time: Vec<f64> = (0..rows).map(|k| k as f64 / RATE).collect();
        let row = |from: f64| ((from * RATE).ceil() as usize).min(rows);
        let input: Vec<Input> = time.iter().map(|t| Input::of(&motion.tumble.truth(*t, &|_| ()))).collect();
        let truth = triads(&mut Random::new(seed, Purpose::Unit));
        let mut random = Random::new(seed, Purpose::Noise);
        let white = white(cell);
        let noise = white.map(|white| noise(cell.noise, white, rows, &mut random));
        let step = white.map(|white| {
            white
                * if cell.noise == Noise::CoarseSteps {
                    random.between(COARSE_STEP.0, COARSE_STEP.1)
                } else {
                    FINE_STEP
                }
        });
        let mut hand = Self {
            cell,
            time,
            rests: motion.rests.iter().map(|(from, to)| row(*from)..row(*to)).collect(),
            input,
            truth,
            clean: [const { Vec::new() }; 3],
            noise,
            step,
            place: motion.tumble.place(),
            temperature: None,
        };
        hand.sense();
        hand
    }

    /// Works `clean` out of `input`: again, once a fault has altered what the sensors are given.
    pub fn sense(&mut self) {
        for kind in SensorKind::ALL {
            let triad = &self.truth[kind as usize];
            // Gains are off by some percent, so that there is an inverse.
            let sensitivity = triad.sensitivity().unwrap_or_else(Matrix3::identity);
            let sensed = |input: &Input| sensitivity * given(input, kind) + triad.bias;
            self.clean[kind as usize] = self.input.iter().map(sensed).collect();
        }
    }

    /// The samples as the converter puts them out.
    pub fn recording(&self, name: &str) -> Recording {
        let manifest = self.manifest();
        let mut recording = Recording::new(name, manifest.clone(), self.time.clone());
        let [acc, gyr, mag] = SensorKind::ALL.map(|kind| {
            let k = kind as usize;
            let step = self.step[k];
            let samples = self.clean[k].iter().zip(&self.noise[k]);
            let samples = samples.map(|(clean, noise)| (clean + noise).map(|x| (x / step).round() * step));
            // Its own manifest has every conversion it needs.
            manifest.triple(kind, samples.collect()).ok()
        });
        (recording.acc, recording.gyr, recording.mag) = (acc, gyr, mag);
        recording.temperature = self.temperature.clone();
        recording
    }

    fn manifest(&self) -> Manifest {
        let mut manifest = Manifest::default();
        (manifest.units.acc, manifest.units.gyr, manifest.units.mag) =
            (FileUnit::Counts, FileUnit::Counts, FileUnit::Counts);
        let [acc, gyr, mag] = self.step.map(|step| Some(Counts { offset: 0.0, per_unit: 1.0 / step }));
        (manifest.counts.acc, manifest.counts.gyr, manifest.counts.mag) = (acc, gyr, mag);
        manifest.site = Site {
            latitude_deg: Some(self.place.latitude_deg),
            height_m: None,
            gravity: Some(self.place.gravity),
            field_ned_ut: Some(self.place.field_n.into()),
        };
        manifest.rig = Some(Rig { kind: RigKind::Hand, axes: None });
        manifest.sensor =
            Identity { name: Some("simulated".to_owned()), serial: Some("SIM-0001".to_owned()) };
        manifest
    }
}

/// What a sensor is given at a row.
fn given(input: &Input, kind: SensorKind) -> Vector3<f64> {
    match kind {
        SensorKind::Acc => input.f_q,
        SensorKind::Gyr => input.w_iq_q,
        SensorKind::Mag => input.b_q,
    }
}

/// White noise of a sample of each sensor, SI.
fn white(cell: Cell) -> [f64; 3] {
    let level = cell.noise.white();
    [0, 1, 2].map(|k| WHITE[k] * level[k] * cell.quality.white())
}

/// A motion, and when it rests, s.
struct Tumbled {
    tumble: Tumble,
    rests: Vec<(f64, f64)>,
}

fn motion(cell: Cell, random: &mut Random) -> Tumbled {
    let count = cell.rests.draw(random);
    let axis = Unit::new_normalize(random.normals());
    let half_angle = match cell.coverage {
        Coverage::Whole => 180f64,
        Coverage::Cap => random.between(65.0, 100.0),
    };
    let mut attitudes: Vec<UnitQuaternion<f64>> = Vec::new();
    while attitudes.len() < count {
        let next = attitude(&axis, half_angle.to_radians(), random);
        // A hand turns the sensor far enough to see it, and not past half a turn.
        let far_enough = |last: &UnitQuaternion<f64>| (0.7..2.8).contains(&last.angle_to(&next));
        if attitudes.last().is_none_or(far_enough) {
            attitudes.push(next);
        }
    }
    let durations = cell.quality.durations();
    let (first, rest, turn) = durations;
    let begins = |k: usize| first + k as f64 * (rest + turn) - rest;
    let rests = (0..count).map(|k| (if k == 0 { 0.0 } else { begins(k) }, begins(k) + rest)).collect();
    Tumbled { tumble: Tumble::through(attitudes, durations), rests }
}

/// An attitude `C_q_n` in which down lies within an angle of an axis of the sensor, all such alike.
fn attitude(axis: &Unit<Vector3<f64>>, within: f64, random: &mut Random) -> UnitQuaternion<f64> {
    let cos = random.between(libm::cos(within), 1.0);
    let across = axis.cross(&random.normals()).normalize();
    let down = axis.into_inner() * cos + across * (1.0 - cos * cos).max(0.0).sqrt();
    // Takes the sensor's components to n: down to (0, 0, 1), and any heading.
    let level = UnitQuaternion::rotation_between(&down, &Vector3::z())
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), random.between(0.0, std::f64::consts::TAU)) * level
}

/// Triads of a unit: the accelerometer's gain is upper triangular, the gauge of a norm; the others' axes are its own.
fn triads(random: &mut Random) -> [Triad<f64>; 3] {
    SensorKind::ALL.map(|kind| {
        let full = kind != SensorKind::Acc;
        let gain = Matrix3::from_fn(|i, j| {
            let off = random.between(-GAIN, GAIN);
            match i.cmp(&j) {
                std::cmp::Ordering::Equal => 1.0 + off,
                std::cmp::Ordering::Greater if !full => 0.0,
                _ => off,
            }
        });
        let bias = BIAS[kind as usize];
        Triad { gain, bias: Vector3::from_fn(|_, _| random.between(-bias, bias)) }
    })
}

/// Noise of a run: white, and 1/f where the cell has it.
///
/// 1/f noise is a sum of first-order Gauss–Markov processes, correlation times r apart and each of variance v: their
/// one-sided spectra add up to `v / (f ln r)` between the longest and the shortest. White noise has `2 σ² Δt`, so they
/// cross at the corner where `v = ln r · 2 σ² Δt · f`.
fn noise(kind: Noise, white: f64, rows: usize, random: &mut Random) -> Vec<Vector3<f64>> {
    let mut noise: Vec<Vector3<f64>> = (0..rows).map(|_| random.normals() * white).collect();
    if kind != Noise::Flicker {
        return noise;
    }
    let corner = CORNER.0 * libm::pow(CORNER.1 / CORNER.0, random.share());
    let each = white * libm::sqrt(libm::log(4.0) * 2.0 * corner / RATE);
    for k in 0..FLICKER.1 {
        let kept = libm::exp(-1.0 / (RATE * FLICKER.0 * libm::pow(4.0, f64::from(k))));
        let fresh = each * libm::sqrt(1.0 - kept * kept);
        let mut state = random.normals() * each;
        for noise in &mut noise {
            *noise += state;
            state = state * kept + random.normals() * fresh;
        }
    }
    noise
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::trust::cell::{Quality, Rests};

    fn cell(noise: Noise, coverage: Coverage) -> Cell {
        Cell { noise, rests: Rests::Few, coverage, quality: Quality::Good }
    }

    #[test]
    fn one_seed_gives_one_recording_and_another_seed_another() {
        let of = |seed| Hand::draw(cell(Noise::Flicker, Coverage::Whole), seed).recording("hand.csv");
        assert_eq!(of(3), of(3));
        assert_ne!(of(3).acc, of(4).acc);
    }

    #[test]
    fn at_rest_there_is_gravity_as_one_direction_and_on_a_cap_it_stays_there() {
        let hand = Hand::draw(cell(Noise::White, Coverage::Cap), 5);
        let down = |k: usize| hand.input[k].f_q.normalize();
        for rest in &hand.rests {
            assert!((down(rest.start) - down(rest.end - 1)).norm() < 1e-9);
            assert!(rest.len() as f64 >= 4.0 * RATE - 2.0, "{rest:?}");
        }
        let middle: Vector3<f64> = hand.rests.iter().map(|rest| down(rest.start)).sum();
        let widest = hand.rests.iter().map(|rest| down(rest.start).angle(&middle)).fold(0.0, f64::max);
        assert!((0.5..2.1).contains(&widest), "{widest}");
    }

    #[test]
    fn flicker_has_the_spectrum_of_its_corner() {
        // Over averages of T = 8 s and 64 s the variance of 1/f noise is the same, that of white noise an eighth.
        let allan = |kind: Noise, samples: usize| {
            let noise = noise(kind, 1.0, 1 << 18, &mut Random::new(9, Purpose::Noise));
            let means: Vec<Vector3<f64>> = noise
                .chunks_exact(samples)
                .map(|c| c.iter().sum::<Vector3<f64>>() / samples as f64)
                .collect();
            let steps = means.windows(2).map(|pair| (pair[1] - pair[0]).norm_squared() / 6.0);
            steps.sum::<f64>() / (means.len() - 1) as f64
        };
        let white = allan(Noise::White, 400) / allan(Noise::White, 3200);
        let flicker = allan(Noise::Flicker, 400) / allan(Noise::Flicker, 3200);
        assert!((5.5..11.0).contains(&white), "{white}");
        assert!((0.6..2.5).contains(&flicker), "{flicker}");
    }
}

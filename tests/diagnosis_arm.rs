//! An arm whose length is known, in the hand of somebody who moves a sensor to and fro before cameras: how far off it is found, and
//! whether the stated errors say so.
//!
//! The hand sways slowly, trembles at up to 12 Hz, and turns as it travels, so that what the cameras miss of the way goes with
//! the turns. Position and attitude have noise from row to row and errors that wander; the chips have clocks of their own.

use imucal_core::rotation::exp;
use imucal_host::{
    diagnosis::{Diagnosis, Options, diagnose},
    effect::class::class,
    recording::{
        Recording,
        manifest::{Rig, RigKind},
    },
    simulator::robot::{RobotKind, RobotScene},
};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Rate of the rows, Hz, and their number.
const RATE: f64 = 100.0;
const ROWS: usize = 9000;
/// It moves between these times, s.
const MOVES: (f64, f64) = (10.0, 80.0);
/// Waves of a hand, and their slowest and fastest, Hz; up to [`SWAY`] it sways, beyond it trembles.
const WAVES: usize = 60;
const BAND: (f64, f64) = (0.3, 12.0);
const SWAY: f64 = 1.5;
/// Steps of numerical derivatives, s.
const STEP: f64 = 1e-3;

/// A sum of waves of three components: angular frequency, amplitudes of sine and cosine.
struct Waves(Vec<(f64, Vector3<f64>, Vector3<f64>)>);

impl Waves {
    fn at(&self, time: f64) -> Vector3<f64> {
        self.0.iter().map(|(w, sine, cosine)| sine * (w * time).sin() + cosine * (w * time).cos()).sum()
    }
}

fn normal(random: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| StandardNormal.sample(random))
}

/// A hand: its way, m, and its turns, rad.
struct Hand {
    way: Waves,
    turns: Waves,
}

impl Hand {
    fn new(random: &mut ChaCha8Rng) -> Self {
        let wrist = Matrix3::from_fn(|_, _| StandardNormal.sample(random)) * 3.0;
        let (mut way, mut turns) = (Vec::new(), Vec::new());
        for k in 0..WAVES {
            let hz = BAND.0 * (BAND.1 / BAND.0).powf((k as f64 + random.random::<f64>()) / WAVES as f64);
            let w = std::f64::consts::TAU * hz;
            // What an accelerometer feels of each wave, m/s², and a gyroscope, rad/s or by its change, rad/s².
            let (felt, turned) = if hz < SWAY { (0.25, 0.12 * w) } else { (0.13, 0.5) };
            let waves = [0, 1].map(|_| normal(random) * felt / (w * w));
            let own = [0, 1].map(|_| normal(random) * turned / (w * w));
            way.push((w, waves[0], waves[1]));
            turns.push((w, own[0] + wrist * waves[0], own[1] + wrist * waves[1]));
        }
        Self { way: Waves(way), turns: Waves(turns) }
    }

    /// How far it takes part, 0 to 1.
    fn share(time: f64) -> f64 {
        let s = (0.5 * (time - MOVES.0)).min(0.5 * (MOVES.1 - time)).clamp(0.0, 1.0);
        s * s * s * (10.0 + s * (6.0 * s - 15.0))
    }

    fn attitude(&self, time: f64) -> Matrix3<f64> {
        exp(&(self.turns.at(time) * Self::share(time)))
    }

    fn place(&self, time: f64) -> Vector3<f64> {
        self.way.at(time) * Self::share(time)
    }

    /// What a gyroscope is given, rad/s.
    fn rate(&self, time: f64) -> Vector3<f64> {
        let turn = self.attitude(time - STEP).tr_mul(&self.attitude(time + STEP));
        imucal_core::rotation::log(&turn) / (2.0 * STEP)
    }

    /// What an accelerometer at an arm is given, m/s².
    fn force(&self, time: f64, arm: &Vector3<f64>, gravity: f64) -> Vector3<f64> {
        let [before, now, after] =
            [-STEP, 0.0, STEP].map(|dt| self.place(time + dt) + self.attitude(time + dt) * arm);
        let acceleration = (before - now * 2.0 + after) / (STEP * STEP);
        self.attitude(time).tr_mul(&(acceleration - Vector3::z() * gravity))
    }
}

/// A recording and the arm in it, m.
fn recorded(seed: u64) -> (Recording, Vector3<f64>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let scene = RobotScene { kind: RobotKind::Flying, real_rate: RATE, ..RobotScene::default() };
    let mut recording = scene.real("hand.csv").expect("a scene");
    let hand = Hand::new(&mut random);
    let arm = Vector3::from_fn(|_, _| random.random_range(-0.015..0.015));
    let late = [random.random_range(0.0..5e-3), random.random_range(0.0..5e-3)];
    let bias = [normal(&mut random) * 0.03, normal(&mut random) * 0.003];
    let time: Vec<f64> = (0..ROWS).map(|k| k as f64 / RATE).collect();
    let gravity = scene.place.gravity;
    let (acc, gyr) = (recording.acc.as_mut().expect("one"), recording.gyr.as_mut().expect("one"));
    acc.values = time
        .iter()
        .map(|t| hand.force(t - late[0], &arm, gravity) + bias[0] + normal(&mut random) * 0.02)
        .collect();
    gyr.values =
        time.iter().map(|t| hand.rate(t - late[1]) + bias[1] + normal(&mut random) * 0.003).collect();
    // Errors that wander with the place and attitude, within seconds.
    let mut wander = |size: f64| {
        let wave = |_| {
            let w = std::f64::consts::TAU * random.random_range(0.05..0.5);
            (w, normal(&mut random) * size / 2.0, normal(&mut random) * size / 2.0)
        };
        Waves((0..4).map(wave).collect())
    };
    let off = [wander(2e-4), wander(1e-3)];
    let attitude = |t: &f64| {
        let error = off[1].at(*t) + normal(&mut random) * 3e-4;
        let q = UnitQuaternion::from_matrix(&(hand.attitude(*t) * exp(&error)));
        [q.w, q.i, q.j, q.k]
    };
    recording.reference = Some(time.iter().map(attitude).collect());
    let position = |t: &f64| <[f64; 3]>::from(hand.place(*t) + off[0].at(*t) + normal(&mut random) * 1.5e-4);
    recording.position = Some(time.iter().map(position).collect());
    recording.time = time;
    (recording.mag, recording.temperature) = (None, None);
    recording.manifest.rig = Some(Rig { kind: RigKind::Optical, axes: None });
    (recording, arm)
}

/// The arm that a diagnosis asserts, with its standard errors, m.
fn found(diagnosis: &Diagnosis) -> Option<[(f64, f64); 3]> {
    let cause = diagnosis.causes.iter().find(|cause| class(&cause.effect) == "acc.lever_arm")?;
    let of = |axis: usize| Some((cause.parameters[axis].value?, cause.parameters[axis].std_error?));
    Some([of(0)?, of(1)?, of(2)?])
}

/// How far off arms are, m, and in standard errors.
fn errors(seeds: std::ops::Range<u64>) -> Vec<(f64, f64)> {
    seeds
        .flat_map(|seed| {
            let (recording, arm) = recorded(seed);
            let diagnosis = diagnose(&recording, &Options::default(), &|_| ());
            let names: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.effect.as_str()).collect();
            let found = found(&diagnosis).unwrap_or_else(|| panic!("no arm in {seed}: {names:?}"));
            println!("{seed} {names:?} {found:.5?} of {arm:.5?}");
            (0..3).map(move |axis| {
                let off = found[axis].0 - arm[axis];
                (off, off / found[axis].1)
            })
        })
        .collect()
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value * value, count + 1.0));
    f64::sqrt(sum / count)
}

#[test]
fn an_arm_before_cameras_is_found_to_half_a_millimetre() {
    let errors = errors(0..3);
    println!("off by {:.2e} m rms", rms(errors.iter().map(|error| error.0)));
    assert!(errors.iter().all(|(off, ratio)| off.abs() < 5e-4 && ratio.abs() < 5.0), "{errors:.5?}");
}

#[test]
#[ignore = "minutes"]
fn stated_errors_of_an_arm_cover_it() {
    let errors = errors(100..140);
    let within = |most: f64| errors.iter().filter(|error| error.1.abs() < most).count();
    println!(
        "off by {:.2e} m rms, {:.2} standard errors rms, {} of {} within 1.96 of them, {} within 3",
        rms(errors.iter().map(|error| error.0)),
        rms(errors.iter().map(|error| error.1)),
        within(1.96),
        errors.len(),
        within(3.0)
    );
    assert!(within(1.96) as f64 > 0.9 * errors.len() as f64);
}

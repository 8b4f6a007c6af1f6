//! A simulated recording small enough for many tests: every sensor is accepted from it.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use imucal_host::recording::manifest::{Axis, Rig, RigKind};
use imucal_host::recording::{Recording, SensorKind};
use imucal_host::simulator::{SimulatedUnit, Tumble, record};
use nalgebra::{Rotation3, Unit, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Rests of the small recording.
pub const RESTS: usize = 14;

/// Tumbled through so many attitudes, at 50 Hz.
pub fn tumbled(rests: usize, seed: u64) -> Recording {
    record("small.csv", &Tumble::new(rests, seed), &unit(), seed + 1)
}

/// The small recording.
pub fn small() -> Recording {
    tumbled(RESTS, 5)
}

/// The unit of the small recording, and of motions of one's own.
pub fn unit() -> SimulatedUnit {
    SimulatedUnit { interval: 0.02, ..SimulatedUnit::mtx() }
}

/// Writes the small recording as `small.csv` and `small.toml` into a folder.
///
/// # Panics
///
/// Where it cannot be written.
pub fn write_small(folder: &Path) -> PathBuf {
    let path = folder.join("small.csv");
    small().write(&path).expect("the folder takes files");
    path
}

/// A motion of one's own, recorded by the small recording's unit at 50 Hz: what `truth` says of a time in seconds
/// is specific force (m/s²), rate (rad/s) and field (µT).
///
/// # Panics
///
/// Where the manifest lacks a conversion.
pub fn recorded(duration: f64, truth: impl Fn(f64) -> [Vector3<f64>; 3]) -> Recording {
    let (unit, manifest) = (unit(), small().manifest);
    let mut rng = ChaCha8Rng::seed_from_u64(17);
    let time: Vec<f64> = (0..(duration * 50.0) as usize).map(|row| row as f64 * 0.02).collect();
    let rows: Vec<[Vector3<f64>; 3]> = time.iter().map(|t| truth(*t)).collect();
    let mut recording = Recording::new("small.csv", manifest.clone(), time);
    let [acc, gyr, mag] = SensorKind::ALL.map(|kind| {
        let sensor = unit.sensor(kind);
        let samples = rows.iter().map(|row| {
            let noise = Vector3::from_fn(|_, _| sensor.noise * normal(&mut rng));
            let raw = sensor.truth.predict(&(row[kind as usize] + noise)).expect("the gain can be inverted");
            raw.map(|counts| (counts.round() - sensor.counts.offset) / sensor.counts.per_unit)
        });
        manifest.triple(kind, samples.collect()).expect("the manifest has the conversion")
    });
    (recording.acc, recording.gyr, recording.mag) = (Some(acc), Some(gyr), Some(mag));
    recording
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Rests of 3 s, after 10 s of rest, between turns of 2 s about one axis of the table by the same angle (rad).
pub fn turned_about(axis: Vector3<f64>, start: UnitQuaternion<f64>, angle: f64, rests: usize) -> Recording {
    let axis = Unit::new_normalize(axis);
    recorded(10.0 + 5.0 * (rests - 1) as f64, |t| {
        let since = (t - 10.0).max(0.0);
        let (turn, within) = ((since / 5.0).floor(), (since % 5.0).min(2.0) / 2.0);
        let turned = angle * (turn + 0.5 * (1.0 - (PI * within).cos()));
        let rate = if within > 0.0 && within < 1.0 { angle * 0.25 * PI * (PI * within).sin() } else { 0.0 };
        let to_q = (UnitQuaternion::from_axis_angle(&axis, turned) * start).inverse();
        [
            to_q * Vector3::new(0.0, 0.0, -9.7997),
            to_q * (axis.into_inner() * rate),
            to_q * Vector3::new(25.3, 2.6, 40.1),
        ]
    })
}

/// A recording of a rig, axes z, y, x, on a level base that stands 4 s at each of these angles, 10 s at the first.
pub fn on_rig(at: &[Vector3<f64>]) -> Recording {
    let gimbals = |t: f64| {
        let since = (t - 10.0).max(0.0) / 6.0;
        let from = (since.floor() as usize).min(at.len() - 1);
        let share = ((since - from as f64) * 3.0).clamp(0.0, 1.0);
        let (from, to) = (at[from], at[(from + 1).min(at.len() - 1)]);
        from + (to - from) * (0.5 - 0.5 * (PI * share).cos())
    };
    let c_t_p = |t: f64| {
        let angles = gimbals(t);
        Rotation3::new(Vector3::z() * angles.x)
            * Rotation3::new(Vector3::y() * angles.y)
            * Rotation3::new(Vector3::x() * angles.z)
    };
    let duration = 10.0 + 6.0 * (at.len() - 1) as f64;
    let mut recording = recorded(duration, |t| {
        let (now, next) = (c_t_p(t), c_t_p(t + 1e-4));
        let rate = (now.inverse() * next).scaled_axis() / 1e-4;
        let down = Vector3::new(0.0, 0.0, -9.7997);
        [now.inverse() * down, rate, now.inverse() * Vector3::new(25.3, 2.6, 40.1)]
    });
    recording.gimbal = Some(recording.time.iter().map(|t| gimbals(*t).into()).collect());
    let axes = Some(vec![Axis::Z, Axis::Y, Axis::X]);
    recording.manifest.rig = Some(Rig { kind: RigKind::FlightMotionSimulator, axes });
    recording
}

//! A recorded movement: what the encoders of a rig said, as a source of truth.
//!
//! Angle, rate and acceleration of each gimbal are those of a cubic through the readings about a row, by least squares:
//! a movement whose angle is a cubic over that time stays as it is. The cubic is short: a mean over many rows rids their
//! rates of nearly all the readings' noise, since what one has too much its neighbour lacks, but of no bend that the
//! cubic has cut. What must not be noisy row by row, as the movement of which an effect's size follows, comes from
//! longer cubics, the longer the noisier the readings ([`Recorded::steady`]).
//! Where a wider cubic gives another rate, the gimbal has jerked, and its rate there is not known.
//! Between rows the nearest row's swing goes on with constant acceleration. Where readings change no more than their
//! noise would make them, the cubic goes through those of a fifth of a second. Not modelled: readings that lag the gimbal.

use crate::recording::order_statistics::std_of_median;
use std::{
    f64::consts::TAU,
    sync::{Arc, OnceLock},
};

use nalgebra::Vector3;

use super::{
    gimbal::{Pose, direction, pose},
    place::Place,
    recent::{Recent, nearest},
    swing_fit::{Readings, window},
    truth::{Motion, Recorded, at_pose, on_rig},
};
use crate::{
    effect::{Machine, Swing, Truth},
    recording::manifest::{Axis, Rig, RigKind},
};

/// Readings within so long of a row give its swing, s: least and most.
const REACH: (f64, f64) = (0.03, 0.12);
/// A rate may be as noisy as this, rad/s.
const RATE_NOISE: f64 = 5e-4;
/// A gimbal moves if its reading changes over twice this time, s,
const WINDOW: f64 = 0.1;
/// by more than this rate would make it, rad/s,
const CREEP: f64 = 3e-3;
/// and by more than this many standard deviations of a reading's noise.
const NOISES: f64 = 8.0;
/// Two rates further apart than this, rad/s, and than their noise are those of a jerk.
const JERK: f64 = 1e-3;
/// Poses are remembered in recordings of at most so many rows, a quarter of a kilobyte each: eleven minutes at 1 kHz, two hours
/// at 100 Hz.
const REMEMBERED: usize = 700_000;
/// At least this many readings to each side.
const FEWEST: usize = 2;

/// The movement of a recorded rig.
#[derive(Clone, Debug)]
pub struct Replay {
    moving: Vec<bool>,
    known: Vec<bool>,
    brisk: Smoothed,
    steady: Option<Smoothed>,
}

/// The movement by cubics of one length.
#[derive(Clone, Debug)]
struct Smoothed {
    time: Arc<[f64]>,
    /// One a row, °C.
    temperature: Arc<[f64]>,
    /// Of each row.
    swings: Vec<[Swing; 3]>,
    /// Poses that were asked for: of the steady movement at few rows. None where all are computed as they are needed.
    poses: Vec<OnceLock<Box<Pose>>>,
    axes: [Axis; 3],
    place: Place,
}

impl Replay {
    /// The movement that encoders show, rad, wrapped or not; rows without a reading follow their neighbours.
    /// `temperature` in °C, one a row. Times strictly increase. `None` where no row has a reading of all three.
    pub fn new(
        time: &[f64],
        encoders: &[[f64; 3]],
        temperature: &[f64],
        axes: [Axis; 3],
        place: Place,
    ) -> Option<Self> {
        let angles = unwrapped(encoders)?;
        let readings = Readings { time, angles: &angles };
        let (interval, noise) = (readings.interval(), noise(&angles));
        let readings_in = |reach: f64| ((reach / interval).round() as usize).max(FEWEST);
        let (short, long) = (readings_in(REACH.0), readings_in(reach(&noise, interval)));
        let moving = moving(time, &angles, &noise);
        // Noise of a rate is about that of a reading in the time between two.
        let jerk = noise.map(|noise| JERK + NOISES * noise / interval);
        let (near, jerked) = swings(&readings, &moving, short, Some(&jerk));
        let (time, temperature): (Arc<[f64]>, Arc<[f64]>) = (time.into(), temperature.into());
        let remembered = if time.len() <= REMEMBERED { time.len() } else { 0 };
        let of = |swings| Smoothed {
            time: Arc::clone(&time),
            temperature: Arc::clone(&temperature),
            swings,
            poses: vec![OnceLock::new(); remembered],
            axes,
            place,
        };
        let steady = (long > short).then(|| of(swings(&readings, &moving, long, None).0));
        let brisk = of(near);
        Some(Self { known: known(encoders, long, &jerked, short), moving, brisk, steady })
    }
}

impl Smoothed {
    /// An exact rig on a level base, so many seconds after a row.
    fn machine(&self, row: usize, since: f64) -> Machine {
        let swing = |swing: Swing| Swing {
            angle: swing.angle + since * (swing.rate + 0.5 * since * swing.acceleration),
            rate: swing.rate + since * swing.acceleration,
            acceleration: swing.acceleration,
        };
        let gimbals = self.swings.get(row).copied().unwrap_or_default().map(swing);
        Machine { gimbals, ..Machine::exact(self.axes.map(direction)) }
    }

    /// The pose of an exact rig at a row; `None` in a long recording, whose poses are computed as they are needed.
    fn pose(&self, row: usize) -> Option<&Pose> {
        Some(self.poses.get(row)?.get_or_init(|| Box::new(pose(&self.machine(row, 0.0)))))
    }
}

impl Motion for Smoothed {
    fn duration(&self) -> f64 {
        self.time.last().copied().unwrap_or(0.0)
    }

    fn truth_among(&self, time: f64, rig: &dyn Fn(&mut Machine), recent: &mut Recent) -> Truth {
        let row = recent.nearest(&self.time, time);
        let since = time - self.time.get(row).copied().unwrap_or(time);
        let exact = self.machine(row, since);
        let mut machine = exact;
        rig(&mut machine);
        let temperature = self.temperature.get(row).copied().unwrap_or(0.0);
        let as_recorded = since == 0.0 && machine.turns_like(&exact);
        match as_recorded.then(|| self.pose(row)).flatten() {
            Some(pose) => {
                let c_p_n = recent.base(&machine);
                at_pose(time, pose, c_p_n, machine.gimbals, &self.place, temperature, recent)
            }
            None => on_rig(time, &machine, &self.place, temperature, recent),
        }
    }

    fn encoders(&self, time: f64) -> Option<[f64; 3]> {
        self.swings.get(nearest(&self.time, time)).map(|swings| swings.map(|swing| swing.angle))
    }

    fn rig(&self) -> Rig {
        Rig { kind: RigKind::FlightMotionSimulator, axes: Some(self.axes.to_vec()) }
    }

    fn place(&self) -> Place {
        self.place
    }
}

impl Motion for Replay {
    fn duration(&self) -> f64 {
        self.brisk.duration()
    }

    fn truth_among(&self, time: f64, rig: &dyn Fn(&mut Machine), recent: &mut Recent) -> Truth {
        self.brisk.truth_among(time, rig, recent)
    }

    fn encoders(&self, time: f64) -> Option<[f64; 3]> {
        self.brisk.encoders(time)
    }

    fn rig(&self) -> Rig {
        self.brisk.rig()
    }

    fn place(&self) -> Place {
        self.brisk.place()
    }
}

impl Recorded for Replay {
    fn moving(&self) -> &[bool] {
        &self.moving
    }

    /// All readings that give a row's swing were measured, and no gimbal jerked.
    fn known(&self) -> &[bool] {
        &self.known
    }

    fn swings(&self, row: usize) -> Option<[Swing; 3]> {
        let steady = self.steady.as_ref().unwrap_or(&self.brisk);
        steady.swings.get(row).copied()
    }

    fn steady(&self) -> &dyn Motion {
        self.steady.as_ref().unwrap_or(&self.brisk)
    }
}

/// Readings without the wrap at ±π; missing ones repeat the last. `None` where there is none at all.
fn unwrapped(encoders: &[[f64; 3]]) -> Option<Vec<[f64; 3]>> {
    let measured = |row: &&[f64; 3]| row.iter().all(|angle| angle.is_finite());
    let mut last = *encoders.iter().find(measured)?;
    let unwrap = |row: &[f64; 3]| {
        if measured(&row) {
            for (last, angle) in last.iter_mut().zip(row) {
                let step = angle - *last;
                *last += step - TAU * (step / TAU).round();
            }
        }
        last
    };
    Some(encoders.iter().map(unwrap).collect())
}

/// How far the readings that give a swing reach, s. The slope of a cubic through n readings of noise σ has the variance
/// 75 σ² / (n³ Δt²).
fn reach(noise: &[f64; 3], interval: f64) -> f64 {
    let sigma = noise.iter().fold(0.0f64, |most, sigma| most.max(*sigma));
    let span = libm::pow(sigma * libm::sqrt(75.0 * interval) / RATE_NOISE, 2.0 / 3.0);
    (0.5 * span).clamp(REACH.0, REACH.1)
}

/// Rows about which all readings were measured, as far as the longer cubics reach, and no gimbal jerked, as far as the
/// shorter ones do.
fn known(encoders: &[[f64; 3]], long: usize, jerked: &[bool], short: usize) -> Vec<bool> {
    let mut known = vec![true; encoders.len()];
    let mut forget = |row: usize, reach: usize| {
        let to = (row + reach + 1).min(encoders.len());
        known[row.saturating_sub(reach)..to].fill(false);
    };
    for (row, angles) in encoders.iter().enumerate() {
        if angles.iter().any(|angle| !angle.is_finite()) {
            forget(row, 2 * long);
        }
        if jerked[row] {
            forget(row, short);
        }
    }
    known
}

/// Standard deviation of each encoder's readings, rad.
fn noise(angles: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|axis| reading_noise(angles.iter().map(|angles| angles[axis])))
}

/// Standard deviation of readings along a smooth movement: by fourth differences, which leave next to nothing of it, and √70
/// times a reading's standard deviation. Missing readings are left out first: a sensor may read in every fifth row.
pub fn reading_noise(readings: impl Iterator<Item = f64>) -> f64 {
    let readings: Vec<f64> = readings.filter(|reading| reading.is_finite()).collect();
    let bend = |w: &[f64]| (w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4]).abs();
    std_of_median(readings.windows(5).map(bend).collect()).unwrap_or(0.0) / 70.0f64.sqrt()
}

/// That of readings with three axes, the largest of them.
pub fn readings_noise(values: &[Vector3<f64>]) -> f64 {
    (0..3).map(|axis| reading_noise(values.iter().map(|value| value[axis]))).fold(0.0, f64::max)
}

/// Rows at which a gimbal moves.
fn moving(time: &[f64], angles: &[[f64; 3]], noise: &[f64; 3]) -> Vec<bool> {
    let (mut before, mut after) = (0, 0);
    (0..time.len())
        .map(|row| {
            while time[before] < time[row] - WINDOW {
                before += 1;
            }
            while after + 1 < time.len() && time[after] < time[row] + WINDOW {
                after += 1;
            }
            let span = time[after] - time[before];
            (0..3).any(|axis| {
                let change = (angles[after][axis] - angles[before][axis]).abs();
                change > CREEP * span + NOISES * noise[axis]
            })
        })
        .collect()
}

/// Each row by cubics through so many readings to each side, and at which of them a wider one has a rate that is further
/// from theirs than `jerk`, rad/s; without it none is looked for.
fn swings(
    readings: &Readings,
    moving: &[bool],
    reach: usize,
    jerk: Option<&[f64; 3]>,
) -> (Vec<[Swing; 3]>, Vec<bool>) {
    // What hardly moves does so slowly: more readings give its rate.
    let patient = ((WINDOW / readings.interval()).round() as usize).max(reach);
    readings.each(
        |row| if moving[row] { reach } else { patient },
        |row, fit| {
            let swings = fit.swing();
            let jerked = jerk.filter(|_| moving[row]).is_some_and(|jerk| {
                let wide = fit.wider(window(moving.len(), row, reach + 1)).swing();
                (0..3).any(|gimbal| (swings[gimbal].rate - wide[gimbal].rate).abs() > jerk[gimbal])
            });
            (swings, jerked)
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn replayed(angle: impl Fn(f64) -> f64) -> Replay {
        let time: Vec<f64> = (0..1000).map(|k| 0.01 * f64::from(k)).collect();
        let wrap = |a: f64| a - TAU * (a / TAU).round();
        let encoders: Vec<[f64; 3]> = time.iter().map(|t| [wrap(angle(*t)), 0.3, -PI]).collect();
        let axes = [Axis::Z, Axis::Y, Axis::X];
        Replay::new(&time, &encoders, &[25.0; 1000], axes, Place::ankara()).unwrap()
    }

    #[test]
    fn a_sinusoid_through_many_turns_keeps_its_rate_and_acceleration() {
        let (amplitude, w) = (20.0, 2.0);
        let replay = replayed(|t| amplitude * (w * t).sin());
        for k in 0..90 {
            let t = 0.5 + 0.1 * f64::from(k) + 0.004;
            let truth = replay.truth(t, &|_| ());
            assert!((truth.gimbals[0].angle - amplitude * (w * t).sin()).abs() < 1e-5, "{t}");
            assert!((truth.gimbals[0].rate - amplitude * w * (w * t).cos()).abs() < 2e-3, "{t}");
            assert!((truth.gimbals[0].acceleration + amplitude * w * w * (w * t).sin()).abs() < 1.0, "{t}");
        }
    }

    #[test]
    fn a_pose_that_is_kept_is_that_of_the_rig_whatever_is_done_to_it() {
        type Alter = fn(&mut Machine);
        let alters: [Alter; 6] = [
            |_| (),
            |machine| machine.heading += 0.3,
            |machine| machine.tilt[1] -= 0.02,
            |machine| machine.gimbals[1].angle += 0.01,
            |machine| machine.wobble[0] = Swing::still(0.02),
            |machine| machine.skew[1] = 0.03,
        ];
        let replay = replayed(|t| 0.4 * t * t);
        let mut recent = Recent::default();
        // On a row, and between two.
        for (alter, time) in alters.iter().flat_map(|alter| [(alter, 4.0), (alter, 4.003)]) {
            let row = nearest(&replay.brisk.time, time);
            let mut machine = replay.brisk.machine(row, time - replay.brisk.time[row]);
            alter(&mut machine);
            let expected = on_rig(time, &machine, &replay.place(), 25.0, &mut Recent::default());
            assert_eq!(replay.truth_among(time, alter, &mut recent), expected, "{machine:?}");
        }
    }

    #[test]
    fn noisy_readings_of_a_rig_that_stands_still_are_no_movement() {
        let time: Vec<f64> = (0..600).map(|k| 0.01 * f64::from(k)).collect();
        let angle = |k: usize| if k < 300 { 0.0 } else { 0.2 * (time[k] - 3.0) };
        let encoders: Vec<[f64; 3]> =
            (0..600).map(|k| [angle(k) + 1e-4 * ((k * k) as f64).sin(), 0.0, 0.0]).collect();
        let axes = [Axis::Z, Axis::Y, Axis::X];
        let replay = Replay::new(&time, &encoders, &[25.0; 600], axes, Place::ankara()).unwrap();
        assert!(replay.moving()[..285].iter().all(|moves| !moves));
        assert!(replay.moving()[300..].iter().all(|moves| *moves));
        assert!(replay.swings(100).unwrap()[0].rate.abs() < 1e-3);
    }

    #[test]
    fn a_missing_reading_repeats_the_one_before_it() {
        let encoders = [[f64::NAN; 3], [1.0, 2.0, 3.0], [f64::NAN; 3], [1.1, 2.0, 3.0]];
        let angles = unwrapped(&encoders).unwrap();
        assert_eq!(angles, [[1.0, 2.0, 3.0], [1.0, 2.0, 3.0], [1.0, 2.0, 3.0], [1.1, 2.0, 3.0]]);
        assert!(unwrapped(&[[f64::NAN; 3]]).is_none());
    }
}

//! The attitude along a stream: the integral of its rate, in a base that stays level.
//!
//! ```text
//! C_k₊₁ = C_k exp([φ]×)      φ = h (w_k + w_k₊₁) / 2 + h² (ẇ_k − ẇ_k₊₁) / 12 + h² (w_k × w_k₊₁) / 12
//! C'_k = L exp(−[ρ t_k]×) C_k
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | C_k | table to base at sample k, its third axis down and its heading that of the first sample |
//! | h, w, ẇ | interval, rate and its slope at the samples |
//! | ρ | rate of the room against the integral, rad/s: Earth's rotation, where the stream's rate holds it |
//! | L | the turn that takes the mean of the specific force up: at rest, or else of all samples |
//!
//! Of all samples, since a machine that comes to rest has not been accelerated on average. φ is Magnus' expansion to fourth
//! order in h. ρ is fitted to what stays in the room: the field of the stream, as far as that is uniform, and gravity, at rest, or
//! else on the whole, where the accelerations of a journey hide it the less the longer that takes. Not modelled: a stream whose
//! rate has a bias of its own, and a field that differs from place to place.

use imucal_core::rotation::exp;
use nalgebra::{Matrix3, Rotation3, Vector3};

use super::super::{cubic::Cubic, place::EARTH_RATE};
use crate::recording::median;

/// A machine's mean speed, m/s, roughly.
const SPEED: f64 = 2.0;
/// Least standard error of ρ from a uniform field or from rests, rad/s.
const LEAST: f64 = 1e-7;
/// What is left of what turns with the room is alike over so long a time, s.
const ALIKE: f64 = 1.0;

/// A sample is at rest where the specific force changes by less than this, m/s³, is as long as at most other rests to within this,
/// m/s², and the rate is smaller than this, rad/s,
const JERK: f64 = 0.1;
const LONGER: f64 = 0.02;
const TURNS: f64 = 0.01;
/// for so long, s. Shorter rests are moments of a movement.
const REST: f64 = 0.5;
/// Rests in which up scatters by more than this, rad, are moments of a movement.
const AGREE: f64 = 5e-3;
/// Rests show how the room turns where they span so much of the whole time.
const SPANNED: f64 = 0.5;

/// Attitude at each sample, table to base, by accelerometer, gyroscope and magnetometer of a stream.
pub(super) fn attitudes(time: &[f64], [acc, gyr, mag]: &[Option<Cubic>; 3]) -> Vec<Matrix3<f64>> {
    let mut attitudes =
        gyr.as_ref().map_or_else(|| vec![Matrix3::identity(); time.len()], |gyr| integral(time, gyr));
    let Some(acc) = acc else { return attitudes };
    let still = gyr.as_ref().map_or_else(Vec::new, |gyr| at_rest(time, acc, gyr));
    let agree = |still: &Vec<usize>| {
        let drift = Drift::of(time, still, &attitudes, acc);
        drift.is_some_and(|drift| drift.scatter < AGREE)
    };
    let still = Some(still).filter(agree).unwrap_or_default();
    level(&mut attitudes, acc, &still);
    let room = turning(time, &attitudes, acc, mag.as_ref(), &still);
    if let (Some(room), Some(start)) = (room, time.first()) {
        for (attitude, time) in attitudes.iter_mut().zip(time) {
            *attitude = exp(&(room * (start - time))) * *attitude;
        }
        level(&mut attitudes, acc, &still);
    }
    attitudes
}

/// Samples at rest.
fn at_rest(time: &[f64], acc: &Cubic, gyr: &Cubic) -> Vec<usize> {
    let is_slow = |k: &usize| acc.slopes[*k].norm() < JERK && gyr.values[*k].norm() < TURNS;
    let slow: Vec<usize> = (0..time.len()).filter(is_slow).collect();
    let usual = median(slow.iter().map(|k| acc.values[*k].norm()).collect()).unwrap_or(0.0);
    let still: Vec<usize> =
        slow.into_iter().filter(|k| (acc.values[*k].norm() - usual).abs() < LONGER).collect();
    let lasts = |run: &&[usize]| time[run[run.len() - 1]] - time[run[0]] >= REST;
    still.chunk_by(|a, b| a + 1 == *b).filter(lasts).flatten().copied().collect()
}

fn integral(time: &[f64], gyr: &Cubic) -> Vec<Matrix3<f64>> {
    let mut attitudes = vec![Matrix3::identity(); time.len()];
    for k in 1..time.len() {
        let h = time[k] - time[k - 1];
        let (w, next) = (gyr.values[k - 1], gyr.values[k]);
        let bend = gyr.slopes[k - 1] - gyr.slopes[k] + w.cross(&next);
        attitudes[k] = attitudes[k - 1] * exp(&((w + next) * (0.5 * h) + bend * (h * h / 12.0)));
    }
    attitudes
}

/// Turns the base so that the mean of the specific force at rest is up; of all where nothing rests.
fn level(attitudes: &mut [Matrix3<f64>], acc: &Cubic, still: &[usize]) {
    let force = |k: usize| attitudes[k] * acc.values[k];
    let mean: Vector3<f64> = match still.is_empty() {
        true => (0..attitudes.len()).map(force).sum(),
        false => still.iter().copied().map(force).sum(),
    };
    let Some(level) = Rotation3::rotation_between(&mean, &-Vector3::z()) else { return };
    attitudes.iter_mut().for_each(|attitude| *attitude = level.matrix() * *attitude);
}

/// ρ, rad/s, with Earth's rotation as its prior; `None` where nothing shows it.
fn turning(
    time: &[f64],
    attitudes: &[Matrix3<f64>],
    acc: &Cubic,
    mag: Option<&Cubic>,
    still: &[usize],
) -> Option<Vector3<f64>> {
    let length = time.last()? - time.first()?;
    let gravity = acc.values.iter().map(|f| f.norm()).sum::<f64>() / acc.values.len() as f64;
    let mut normal = Matrix3::identity() * (3.0 / (EARTH_RATE * EARTH_RATE));
    let mut right = Vector3::zeros();
    let mut add = |drift: &Drift, error: f64| {
        // slope = ρ × direction
        let cross = -drift.direction.cross_matrix();
        normal += cross.tr_mul(&cross) / (error * error);
        right += cross.tr_mul(&drift.slope) / (error * error);
    };
    let all: Vec<usize> = (0..time.len()).collect();
    // The moment of the accelerations about the middle is the way that was made.
    add(&Drift::of(time, &all, attitudes, acc)?, 12.0 * SPEED / (gravity * length * length));
    let spanned = still.last().zip(still.first()).map_or(0.0, |(last, first)| time[*last] - time[*first]);
    let of_rests = Drift::of(time, still, attitudes, acc).filter(|_| spanned > SPANNED * length);
    let of_field = mag.and_then(|mag| Drift::of(time, &all, attitudes, mag));
    for drift in of_rests.iter().chain(&of_field) {
        add(drift, drift.error.max(LEAST));
    }
    normal.try_inverse().map(|inverse| inverse * right)
}

/// How the direction of a vector changes in the room.
struct Drift {
    /// Its mean.
    direction: Vector3<f64>,
    /// Change, 1/s, and its standard error.
    slope: Vector3<f64>,
    error: f64,
    /// What is left, root mean square.
    scatter: f64,
}

impl Drift {
    /// Of a vector at some samples; `None` where these are one or none.
    fn of(time: &[f64], samples: &[usize], attitudes: &[Matrix3<f64>], of: &Cubic) -> Option<Self> {
        let n = samples.len() as f64;
        let rows = || samples.iter().map(|k| (time[*k], attitudes[*k] * of.values[*k]));
        let (sum_time, sum) = rows().fold((0.0, Vector3::zeros()), |sum, (t, v)| (sum.0 + t, sum.1 + v));
        let (middle, mean) = (sum_time / n, sum / n);
        let spread: f64 = rows().map(|(t, _)| (t - middle) * (t - middle)).sum();
        let slope = rows().map(|(t, v)| v * (t - middle)).sum::<Vector3<f64>>() / spread;
        let left = rows().map(|(t, v)| (v - mean - slope * (t - middle)).norm_squared()).sum::<f64>() / n;
        let length = time[*samples.last()?] - time[*samples.first()?];
        let together = (ALIKE * n / length).max(1.0);
        let (size, error) = (mean.norm(), (left * together / spread).sqrt());
        let given = size > 0.0 && spread > 0.0;
        given.then(|| Self {
            direction: mean / size,
            slope: slope / size,
            error: error / size,
            scatter: left.sqrt() / size,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        recording::Stream,
        simulator::{
            Motion, StreamClock, Streamed,
            robot::{RobotKind, RobotScene},
        },
    };

    #[test]
    fn the_base_stays_level_for_an_hour_though_earth_turns() {
        for (seed, kind) in [RobotKind::Legged, RobotKind::Wheeled, RobotKind::Flying].into_iter().enumerate()
        {
            for duration in if kind == RobotKind::Wheeled { [120.0, 3600.0] } else { [120.0, 300.0] } {
                let scene = RobotScene { kind, duration, seed: seed as u64, ..RobotScene::default() };
                let pair = scene.record("level").unwrap();
                let stream = Stream::of(&pair.simulated).unwrap();
                let time = &pair.real.time;
                let own =
                    Streamed::new(&stream, StreamClock::default(), time, vec![25.0; time.len()], scene.place)
                        .unwrap();
                let field = |t: f64| {
                    let row = own.truth(t, &|_| ());
                    row.c_p_n * row.c_t_p * row.b_t
                };
                let dip = |b: Vector3<f64>| b.z.atan2(b.xy().norm());
                let true_dip = dip(scene.place.field_n);
                for time in [1.0, 0.5 * duration, duration - 1.0] {
                    let off = dip(field(time)) - true_dip;
                    assert!(off.abs() < 5e-4, "{kind:?} {duration} {time}: {off}");
                }
            }
        }
    }
}

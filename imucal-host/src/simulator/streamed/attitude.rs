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
//! | L | the turn that takes the mean of the specific force up, since a machine that comes to rest has not been accelerated on average |
//!
//! φ is Magnus' expansion to fourth order in h. ρ is fitted to what stays in the room: the field of the stream, as far as that
//! is uniform, and gravity, of which the accelerations of a journey hide the less the longer it takes. Not modelled: a stream
//! whose rate has a bias of its own, and a field that differs from place to place.

use imucal_core::rotation::exp;
use nalgebra::{Matrix3, Rotation3, Vector3};

use super::super::{cubic::Cubic, place::EARTH_RATE};

/// A machine's mean speed, m/s, roughly.
const SPEED: f64 = 2.0;
/// Least standard error of ρ from a uniform field, rad/s.
const LEAST: f64 = 1e-7;
/// What is left of a field that turns with the room is alike over so long a time, s.
const ALIKE: f64 = 1.0;

/// Attitude at each sample, table to base, by accelerometer, gyroscope and magnetometer of a stream.
pub(super) fn attitudes(time: &[f64], [acc, gyr, mag]: &[Option<Cubic>; 3]) -> Vec<Matrix3<f64>> {
    let mut attitudes =
        gyr.as_ref().map_or_else(|| vec![Matrix3::identity(); time.len()], |gyr| integral(time, gyr));
    let Some(acc) = acc else { return attitudes };
    level(&mut attitudes, acc);
    let room = turning(time, &attitudes, acc, mag.as_ref());
    if let (Some(room), Some(start)) = (room, time.first()) {
        for (attitude, time) in attitudes.iter_mut().zip(time) {
            *attitude = exp(&(room * (start - time))) * *attitude;
        }
        level(&mut attitudes, acc);
    }
    attitudes
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

/// Turns the base so that the mean of the specific force is up.
fn level(attitudes: &mut [Matrix3<f64>], acc: &Cubic) {
    let mean: Vector3<f64> = attitudes.iter().zip(&acc.values).map(|(c, f)| c * f).sum();
    let Some(level) = Rotation3::rotation_between(&mean, &-Vector3::z()) else { return };
    attitudes.iter_mut().for_each(|attitude| *attitude = level.matrix() * *attitude);
}

/// ρ, rad/s, with Earth's rotation as its prior; `None` where nothing shows it.
fn turning(
    time: &[f64],
    attitudes: &[Matrix3<f64>],
    acc: &Cubic,
    mag: Option<&Cubic>,
) -> Option<Vector3<f64>> {
    let length = time.last()? - time.first()?;
    let gravity = acc.values.iter().map(|f| f.norm()).sum::<f64>() / acc.values.len() as f64;
    let mut normal = Matrix3::identity() * (3.0 / (EARTH_RATE * EARTH_RATE));
    let mut right = Vector3::zeros();
    let mut add = |(direction, slope, error): (Vector3<f64>, Vector3<f64>, f64)| {
        // slope = ρ × direction
        let cross = -direction.cross_matrix();
        normal += cross.tr_mul(&cross) / (error * error);
        right += cross.tr_mul(&slope) / (error * error);
    };
    let in_room = |values: &[Vector3<f64>]| -> Vec<Vector3<f64>> {
        attitudes.iter().zip(values).map(|(c, value)| c * value).collect()
    };
    // The moment of the accelerations about the middle is the way that was made.
    let moved = 12.0 * SPEED / (gravity * length * length);
    let (up, slope, _) = drift(time, &in_room(&acc.values))?;
    add((up, slope, moved));
    if let Some((direction, slope, error)) = mag.and_then(|mag| drift(time, &in_room(&mag.values))) {
        add((direction, slope, error.max(LEAST)));
    }
    normal.try_inverse().map(|inverse| inverse * right)
}

/// Mean direction of a vector, and the slope of its direction over time with that slope's standard error, 1/s.
fn drift(time: &[f64], vectors: &[Vector3<f64>]) -> Option<(Vector3<f64>, Vector3<f64>, f64)> {
    let n = time.len() as f64;
    let mean = vectors.iter().sum::<Vector3<f64>>() / n;
    let middle = time.iter().sum::<f64>() / n;
    let spread: f64 = time.iter().map(|t| (t - middle) * (t - middle)).sum();
    let slope = time.iter().zip(vectors).map(|(t, v)| v * (t - middle)).sum::<Vector3<f64>>() / spread;
    let rows = time.iter().zip(vectors);
    let left: f64 = rows.map(|(t, v)| (v - mean - slope * (t - middle)).norm_squared()).sum::<f64>() / n;
    let together = (ALIKE * n / (time.last()? - time.first()?)).max(1.0);
    let (size, error) = (mean.norm(), (left * together / spread).sqrt());
    (size > 0.0 && spread > 0.0).then(|| (mean / size, slope / size, error / size))
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
            for duration in [120.0, 3600.0] {
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
                let (first, last) = (dip(field(1.0)), dip(field(duration - 1.0)));
                assert!((first - last).abs() < 2e-3, "{kind:?} {duration}: {first} {last}");
            }
        }
    }
}

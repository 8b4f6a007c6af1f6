//! A sensor that was moved to and fro along a reference attitude: its accelerometer senses more than gravity.
//!
//! An attitude holds no linear acceleration. Whatever the gain, and wherever the reference's frame has the vertical, gravity
//! alone is a linear function of the attitude's nine entries:
//!
//! ```text
//! y = K C_t_pᵀ g_p + b
//! ```
//!
//! What is left of the samples after any such function, while the gyroscope follows the reference, is acceleration.

use nalgebra::{SMatrix, SVector, Vector3};

use super::{gimbal_order::FOLLOWS, pairs::Pairs};
use crate::{
    effect::Truth,
    recording::{Recording, SensorKind, check::integrity::Integrity},
};

/// Acceleration of a hand is stronger than this, root mean square, m/s².
const STRONG: f64 = 0.5;
/// Directions in which the attitude varies less than this share of the largest do not count.
const FLAT: f64 = 1e-6;

/// Entries of an attitude.
type Entries = SVector<f64, 9>;

/// Why the accelerometer cannot be compared with a reference that the gyroscope follows; `None` where it can be, or where
/// something else is the reason.
pub(crate) fn check(
    recording: &Recording,
    integrity: &Integrity,
    rows: &[usize],
    truth: &[Truth],
    pairs: &[Option<Pairs>; 3],
) -> Option<String> {
    let share = |kind: SensorKind| Some(pairs[kind as usize].as_ref()?.trusted().moments().unexplained());
    let (of_acc, of_gyr) = (share(SensorKind::Acc)?, share(SensorKind::Gyr)?);
    if of_acc <= FOLLOWS || of_gyr > FOLLOWS {
        return None;
    }
    let rows = gravity_rows(recording, integrity, rows, truth)?;
    let (acceleration, variance) = left(&rows)?;
    (acceleration > STRONG * STRONG && acceleration > FOLLOWS * variance).then(|| {
        format!(
            "the accelerometer is left out: {:.0} % of its samples' variance, {:.1} m/s² root mean square, is acceleration \
             that no direction of gravity explains, while the gyroscope follows the reference attitude: the sensor was \
             moved to and fro, which an attitude does not hold; turn it without moving it to diagnose the accelerometer",
            100.0 * acceleration / variance,
            acceleration.sqrt()
        )
    })
}

/// What a reference attitude leaves open of an accelerometer that is compared with it: it predicts no linear acceleration.
pub(crate) fn left_open(
    recording: &Recording,
    integrity: &Integrity,
    rows: &[usize],
    truth: &[Truth],
) -> Option<String> {
    let (acceleration, variance) = left(&gravity_rows(recording, integrity, rows, truth)?)?;
    (variance > 0.0).then(|| {
        format!(
            "the reference holds no position, so that linear acceleration is not predicted: {:.2} m/s² root mean square of \
             the accelerometer's samples, {:.1} % of their variance, stays open between movement, noise and the sensor",
            acceleration.sqrt(),
            100.0 * acceleration / variance
        )
    })
}

/// Usable samples in addition to the entries of the attitude.
fn gravity_rows(
    recording: &Recording,
    integrity: &Integrity,
    rows: &[usize],
    truth: &[Truth],
) -> Option<Vec<(Vector3<f64>, Entries)>> {
    let (samples, usable) = (&recording.acc.as_ref()?.values, &integrity.sensor(SensorKind::Acc)?.usable);
    let rows = rows.iter().zip(truth).filter(|(row, _)| usable[**row]);
    let entries = |truth: &Truth| Entries::from_iterator(truth.c_t_p.iter().copied());
    Some(rows.map(|(row, truth)| (samples[*row], entries(truth))).collect())
}

/// Mean square of what no linear function of the entries explains of the samples, and the samples' variance.
fn left(rows: &[(Vector3<f64>, Entries)]) -> Option<(f64, f64)> {
    let count = rows.len() as f64;
    let mean_y = rows.iter().map(|(y, _)| y).sum::<Vector3<f64>>() / count;
    let mean_c = rows.iter().map(|(_, c)| c).sum::<Entries>() / count;
    let (mut cross, mut input, mut output) =
        (SMatrix::<f64, 3, 9>::zeros(), SMatrix::<f64, 9, 9>::zeros(), 0.0);
    for (y, c) in rows {
        let (y, c) = (y - mean_y, c - mean_c);
        cross += y * c.transpose();
        input += c * c.transpose();
        output += y.norm_squared();
    }
    let inverse = input.pseudo_inverse(FLAT * input.trace()).ok()?;
    let explained = (cross * inverse * cross.transpose()).trace();
    Some(((output - explained).max(0.0) / count, output / count))
}

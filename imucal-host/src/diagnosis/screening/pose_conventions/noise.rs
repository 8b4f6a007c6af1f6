//! A reference that trembles by more than it says: `ref.attitude_noise`, `ref.position_noise`.
//!
//! Fourth differences of attitudes and positions leave next to nothing of a smooth movement. A body that really trembles so
//! would be felt: white noise σ of attitudes an interval Δ apart is a rate of √2 σ/Δ, and the gyroscope's own noise must be
//! far below that.

use imucal_core::rotation::log;
use nalgebra::{Matrix3, Vector3};

use crate::{
    diagnosis::{
        reference::pose::Pose,
        screening::{bandwidth, conventions::Finding},
    },
    effect::{attitude_noise, position_noise},
    recording::{Recording, manifest::ReferenceKind, median, order_statistics::std_of_median},
    simulator::{
        position_smoother::Readings,
        replay::{reading_noise, readings_noise},
    },
};

/// Noise of a reference whose manifest does not say it, rad and m.
const USUAL: f64 = 1e-3;
/// It says less than it trembles from so many times as much on.
const MORE: f64 = 2.0;
/// The gyroscope does not feel the tremble where its noise is below this share of it.
const UNFELT: f64 = 0.3;
/// An acceleration that is known to no better than this, m/s², is none: a hand's is about as large.
const UNKNOWN: f64 = 1.0;

/// What trembles.
#[derive(Clone, Debug, Default)]
pub struct Tremble {
    /// The findings.
    pub findings: Vec<Finding>,
    /// Why the accelerometer is left out, where it is.
    pub left_out: Option<String>,
}

/// Looks at the rows that were recorded.
pub fn of(recording: &Recording, pose: &Pose) -> Tremble {
    let mut found = Tremble::default();
    let says = |kind: ReferenceKind| {
        let info = recording.manifest.reference.as_ref().filter(|info| info.kind == kind);
        info.and_then(|info| info.noise).unwrap_or(USUAL)
    };
    if let Some((sigma, count)) = attitude(recording, pose)
        && sigma > MORE * says(ReferenceKind::Attitude)
    {
        found.findings.extend(finding(attitude_noise::ID, sigma, count));
    }
    if let Some((sigma, count)) = position(pose)
        && sigma > MORE * says(ReferenceKind::Pose)
    {
        found.findings.extend(finding(position_noise::ID, sigma, count));
        found.left_out = acceleration_error(&recording.time, pose).filter(|error| *error > UNKNOWN).map(|error| {
            format!(
                "the accelerometer is left out: the reference's position trembles by {sigma:.1e} m, so that its linear \
                 acceleration is known to {error:.1} m/s² only"
            )
        });
    }
    found
}

fn finding(id: &str, sigma: f64, count: usize) -> Option<Finding> {
    let std_error = sigma / (2.0 * count as f64).sqrt();
    // So many standard errors off that no probability can be distinguished from 0.
    Finding::new(id, &[(Some(sigma), Some(std_error))], 0.0)
}

/// Noise of an attitude about an axis, rad, and how many there are; `None` where the gyroscope feels as much.
fn attitude(recording: &Recording, pose: &Pose) -> Option<(f64, usize)> {
    let rows = recording.time.iter().zip(&pose.attitudes);
    let mut given: Vec<(f64, Matrix3<f64>)> = rows.filter_map(|(time, c)| Some((*time, (*c)?))).collect();
    given.dedup_by(|next, last| next.1 == last.1);
    let interval = median(given.windows(2).map(|pair| pair[1].0 - pair[0].0).collect())?;
    let bend = |w: &[(f64, Matrix3<f64>)]| {
        let turn = |k: usize| log(&w[2].1.tr_mul(&w[k].1));
        turn(0) + turn(4) - (turn(1) + turn(3)) * 4.0
    };
    let bends: Vec<Vector3<f64>> = given.windows(5).map(bend).collect();
    let of_axis = |axis: usize| std_of_median(bends.iter().map(|bend| bend[axis].abs()).collect());
    let sigma = (0..3).filter_map(of_axis).fold(0.0, f64::max) / 70.0f64.sqrt();
    let felt = readings_noise(&recording.gyr.as_ref()?.values);
    (felt < UNFELT * 2.0f64.sqrt() * sigma / interval).then_some((sigma, bends.len()))
}

/// Noise of a position along an axis, m, and how many there are.
fn position(pose: &Pose) -> Option<(f64, usize)> {
    let mut given = pose.positions.clone()?;
    given.retain(|row| row.iter().all(|value| value.is_finite()));
    given.dedup();
    let sigma = (0..3).map(|axis| reading_noise(given.iter().map(|row| row[axis]))).fold(0.0, f64::max);
    (sigma > 0.0).then_some((sigma, given.len()))
}

/// Standard deviation of the acceleration that the positions give, of the worst axis, m/s².
fn acceleration_error(time: &[f64], pose: &Pose) -> Option<f64> {
    let positions = pose.positions.as_ref()?;
    let given = time.iter().zip(positions).filter(|(_, row)| row.iter().all(|value| value.is_finite()));
    let given: Vec<f64> = given.map(|(time, _)| *time).collect();
    let interval = median(given.windows(2).map(|pair| pair[1] - pair[0]).collect())?;
    let error = |axis: usize| {
        let position: Vec<f64> = positions.iter().map(|row| row[axis]).collect();
        let rows = Readings { time, position: &position, interval, bandwidth: bandwidth::USUAL }.smoothed();
        median(rows.iter().map(|row| row.error).collect())
    };
    (0..3).filter_map(error).reduce(f64::max)
}

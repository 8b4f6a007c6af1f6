//! The offset of a reference's clock, roughly: by the share of the samples' variance that no gain and bias explain.
//!
//! It is looked for first and the reference is moved by it, since the fit is linear in what is left.

use super::conventions::unexplained;
use crate::{
    recording::{Recording, SensorKind, check::integrity::Integrity},
    simulator::Motion,
};

/// Offsets are looked for so far to either side, s, in steps of this.
const REACH: f64 = 0.25;
/// See [`REACH`]. The fit finds what is left of two of them.
const STEP: f64 = 0.01;
/// An offset must leave less than this share of what none leaves.
const BETTER: f64 = 0.5;

/// The offset within a step of none at which the samples follow a movement best, s: the bottom of the parabola through three
/// steps.
pub fn fine(recording: &Recording, integrity: &Integrity, motion: &dyn Motion) -> f64 {
    let left = |kind: SensorKind| {
        let left = [-STEP, 0.0, STEP].map(|offset| unexplained(recording, integrity, kind, motion, offset));
        Some([left[0]?, left[1]?, left[2]?])
    };
    let found = [SensorKind::Gyr, SensorKind::Acc, SensorKind::Mag].into_iter().find_map(left);
    found.map_or(0.0, |[before, here, after]| {
        let bend = before - 2.0 * here + after;
        if bend > 0.0 { (0.5 * (before - after) / bend).clamp(-1.0, 1.0) * STEP } else { 0.0 }
    })
}

/// An offset of more than a step at which the samples follow a movement far better than without, s; zero where there is
/// none. The row of t then shows the movement of t + offset. The gyroscope is looked at, else the accelerometer, else
/// the magnetometer.
pub fn coarse(recording: &Recording, integrity: &Integrity, motion: &dyn Motion) -> f64 {
    let steps = (REACH / STEP).round() as i32;
    let offset = |step: i32| f64::from(step) * STEP;
    for kind in [SensorKind::Gyr, SensorKind::Acc, SensorKind::Mag] {
        let left = |step: i32| unexplained(recording, integrity, kind, motion, offset(step));
        let Some(none) = left(0) else { continue };
        let all = (-steps..=steps).filter_map(|step| Some((left(step)?, step)));
        let best = all.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|(least, _)| *least < BETTER * none);
        return best.filter(|(_, step)| step.abs() > 1).map_or(0.0, |(_, step)| offset(step));
    }
    0.0
}

//! A reference's frame whose third axis is not down: z up, as of most trackers, or y up.
//!
//! What the accelerometer senses is on average opposite to gravity. Turned into the frame, by the attitudes and by how the
//! sensor sits on the body, it shows which way is up there; the frame is turned so that its third axis is down. How the
//! sensor sits is what turns the rates of the reference into those of the gyroscope.

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::attitude::{mount, rates};
use crate::{
    diagnosis::reference::pose::Pose,
    effect::XYZ,
    recording::{Recording, SensorKind, check::integrity::Integrity, unit::STANDARD_GRAVITY},
};

/// The mean shows the vertical where it is at least this share of gravity.
const SHOWN: f64 = 0.7;
/// A frame that is off by more than this is turned, rad; less is a tilt that the baseline takes up.
const TILTED: f64 = 0.5;

/// What turns components of the frame into those of a level one, and what a reader ought to know; `None` where the frame
/// is level, or nothing shows that it is not.
pub fn level(recording: &Recording, integrity: &Integrity, pose: &Pose) -> Option<(Matrix3<f64>, String)> {
    let up = up(recording, integrity, pose)?;
    let down = -Vector3::z();
    let tilt = up.angle(&down);
    if tilt < TILTED {
        return None;
    }
    let half_turn = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
    let turn = Rotation3::rotation_between(&up, &down).map_or(half_turn, Rotation3::into_inner);
    let axis = up.iamax();
    let sign = if up[axis] < 0.0 { '−' } else { '+' };
    let remark = format!(
        "the reference's frame has {sign}{} up, by what the accelerometer senses on average, where z down was expected; it is \
         turned by {:.0}°; write ref_q* and ref_p* in a frame whose third axis is down",
        XYZ[axis],
        tilt.to_degrees()
    );
    Some((turn, remark))
}

/// Up in the frame, where the accelerometer shows it.
fn up(recording: &Recording, integrity: &Integrity, pose: &Pose) -> Option<Vector3<f64>> {
    let (samples, usable) = (&recording.acc.as_ref()?.values, &integrity.sensor(SensorKind::Acc)?.usable);
    let mount = mount(&rates(recording, integrity, &recording.time, &pose.attitudes))
        .unwrap_or_else(Matrix3::identity);
    let rows = pose.attitudes.iter().zip(samples).zip(usable);
    let felt: Vec<Vector3<f64>> =
        rows.filter_map(|((c, f), usable)| usable.then_some((*c)? * mount.tr_mul(f))).collect();
    let mean = felt.iter().sum::<Vector3<f64>>() / felt.len().max(1) as f64;
    (mean.norm() > SHOWN * STANDARD_GRAVITY).then(|| mean.normalize())
}

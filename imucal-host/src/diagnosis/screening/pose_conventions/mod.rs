//! What a reference attitude or position holds instead of what it should hold: looked for before any fit.
//!
//! | file | what |
//! | --- | --- |
//! | [`rate`] | fewer attitudes and positions than rows: missing or repeated in between |
//! | [`position`] | positions that jump, come in steps, are in another unit or left-handed |
//! | [`attitude`] | quaternions that are inverse or in another order |
//! | [`noise`] | attitudes and positions that tremble by more than they say |
//! | [`frame`] | a frame whose third axis is not down |
//!
//! What can be put right is, with a remark; the rest is refused with what was found and what to do.

pub mod attitude;
pub mod frame;
pub mod noise;
pub mod position;
pub mod rate;

use super::conventions::Finding;
use crate::{
    diagnosis::reference::pose::Pose,
    recording::{Recording, check::integrity::Integrity},
};

/// The reference's pose, put right, and what was found in it.
#[derive(Clone, Debug, Default)]
pub struct Prepared {
    /// The pose; `None` where the recording has none.
    pub pose: Option<Pose>,
    /// Faults that are effects of the catalogue.
    pub findings: Vec<Finding>,
    /// What a reader ought to know.
    pub remarks: Vec<String>,
    /// The accelerometer cannot be compared with it.
    pub without_acc: bool,
}

/// Puts the reference's pose right.
///
/// # Errors
///
/// Why the pose gives no movement, for a reader.
pub fn prepared(recording: &Recording, integrity: &Integrity) -> Result<Prepared, String> {
    let Some(mut pose) = Pose::of(recording) else { return Ok(Prepared::default()) };
    let mut remarks = Vec::new();
    let noise::Tremble { findings, left_out } = noise::of(recording, &pose);
    let without_acc = left_out.is_some();
    remarks.extend(left_out);
    let steps = position::steps(&pose);
    // Rounded positions stand still until they have moved by a step.
    remarks.extend(rate::fill(&recording.time, &mut pose, steps.is_none()));
    remarks.extend(steps);
    remarks.extend(position::mend_jumps(&recording.time, &mut pose));
    if let Some(wrong) = attitude::wrong(recording, integrity, &pose) {
        return Err(wrong);
    }
    if let Some((turn, remark)) = frame::level(recording, integrity, &pose) {
        pose = pose.turned(&turn);
        remarks.push(remark);
    }
    if let Some(wrong) = position::other_unit(recording, integrity, &pose) {
        return Err(wrong);
    }
    Ok(Prepared { pose: Some(pose), findings, remarks, without_acc })
}

//! How fast a movement its recorded positions can be believed to follow: the bandwidth under which the accelerometer follows
//! their acceleration best.
//!
//! Too narrow, and brisk movement is cut off; too wide, and the tracker's noise is taken for acceleration. Both are what no
//! gain and bias explains.

use super::{conventions::unexplained, reference_offset};
use crate::{
    diagnosis::{error::DiagnosisError, reference::movement::Reference},
    recording::{Recording, SensorKind, check::integrity::Integrity},
};

/// Without anything to compare it with, rad/s.
pub const USUAL: f64 = 40.0;
/// Those that are tried, rad/s.
const TRIED: [f64; 7] = [15.0, 25.0, 40.0, 60.0, 90.0, 140.0, 200.0];

/// The movement of the best bandwidth; `first` is that of the usual one.
///
/// # Errors
///
/// Of `of_bandwidth`, which makes the movement of a bandwidth, rad/s.
pub fn best(
    recording: &Recording,
    integrity: &Integrity,
    first: Reference,
    of_bandwidth: &dyn Fn(f64) -> Result<Reference, DiagnosisError>,
) -> Result<Reference, DiagnosisError> {
    let offset = reference_offset::fine(recording, integrity, &*first.movement);
    let left = |reference: &Reference| {
        unexplained(recording, integrity, SensorKind::Acc, &*reference.movement, offset)
    };
    let Some(mut least) = left(&first) else { return Ok(first) };
    let mut best = first;
    for width in TRIED.into_iter().filter(|width| *width != USUAL) {
        let tried = of_bandwidth(width)?;
        if let Some(left) = left(&tried).filter(|left| *left < least) {
            (least, best) = (left, tried);
        }
    }
    Ok(best)
}

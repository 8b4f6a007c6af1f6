//! Whether a magnetometer saw the field that the manifest declares: its length scales the gain, and its dip is measured at rest.

use nalgebra::Vector3;

use crate::calibrate::{FitSummary, Follows, Suspicion};

/// Steel near by turns a field by a few degrees, and hardly changes its length; the field of another place, or of a hall of steel, is
/// further off, rad (3°).
const OFF: f64 = 0.052;
/// Standard errors of the measured dip that are added.
const ERRORS: f64 = 3.0;

/// A finding where the dip measured at rest is not that of the declared field, µT, north, east, down.
pub fn check(fit: &FitSummary, field_n: &Vector3<f64>) -> Option<Suspicion> {
    let (dip, std) = fit.alignment.as_ref()?.dip;
    let declared = (field_n.z / field_n.norm()).asin();
    ((dip - declared).abs() > OFF + ERRORS * std).then(|| Suspicion {
        follows: Follows::Field,
        detail: format!(
            "at rest the field dips by {:.1}°, that of `field_ned_ut` by {:.1}°: another field was measured than is declared, and \
             the declared length is the gain's scale; declare the field of the place, or none",
            dip.to_degrees(),
            declared.to_degrees()
        ),
    })
}

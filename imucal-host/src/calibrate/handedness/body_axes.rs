//! Axes of the body that an optical reference tracks: gyroscope and magnetometer come out in them, and an accelerometer that is
//! calibrated by its rests in its own.
//!
//! ```text
//! R = G K      own axes = R body's axes
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | G | gain of the accelerometer, its own axes |
//! | K | its sensitivity along the reference ([`crate::calibrate::fit::reference_fit::start`]) |

use nalgebra::Rotation3;

use super::mirror::force_along_reference;
use crate::{
    calibrate::outcome::{Calibration, SensorOutcome},
    recording::{Recording, SensorKind},
};

/// A body whose axes are turned by less, rad (2°), is mounted as well as the sensor's axes are known.
const ALIGNED: f64 = 0.035;

/// A warning where the accelerometer is turned against the body, and another sensor is in the body's axes.
pub(super) fn remark(recording: &Recording, calibration: &Calibration) -> Option<String> {
    recording.reference.as_ref().filter(|_| recording.gimbal.is_none())?;
    let fit = |kind| calibration.sensor(kind).and_then(SensorOutcome::passed);
    let acc = fit(SensorKind::Acc).filter(|fit| fit.rig.is_none())?;
    let others = [SensorKind::Gyr, SensorKind::Mag].into_iter();
    let of_body: Vec<String> = others
        .filter(|kind| fit(*kind).is_some_and(|fit| fit.rig.is_some()))
        .map(|kind| kind.to_string())
        .collect();
    if of_body.is_empty() {
        return None;
    }
    let turned = acc.triad.gain * force_along_reference(recording)?.sensitivity;
    let angle = Rotation3::from_matrix(&turned).angle();
    (angle > ALIGNED).then(|| {
        format!(
            "acc: its axes are turned by {:.1}° against those of the body that the reference tracks; in the body's axes: {}; the \
             accelerometer is in its own",
            angle.to_degrees(),
            of_body.join(", ")
        )
    })
}

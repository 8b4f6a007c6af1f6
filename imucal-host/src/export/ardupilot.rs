//! ArduPilot's parameters, a line each: `NAME,VALUE`.
//!
//! Convention, by ArduPilot's `AP_InertialSensor_Backend` and `AP_Compass_Backend`: accelerometer (raw − ACCOFFS)·ACCSCAL in
//! m/s²; gyroscope raw − GYROFFS in rad/s; compass D·(raw + OFS) in milligauss, D symmetric with DIA on the diagonal and
//! ODI_X, ODI_Y, ODI_Z at (x, y), (x, z), (y, z). The compass' offset is added, so that it is minus the bias.

use std::fmt::Write;

use super::{
    Document, ExportError, Inputs,
    affine::{self, higher_terms, no_errors, skew},
};
use crate::recording::{SensorKind, Unit};

const TARGET: &str = "ardupilot";
const AXES: [&str; 3] = ["X", "Y", "Z"];

pub(super) fn document(inputs: &Inputs<'_>) -> Result<Document, ExportError> {
    let mut text = String::from("# ArduPilot parameters of the first sensor of each kind.\n");
    let mut cannot = vec![
        no_errors(),
        "which sensor it is: INS_ACC_ID, INS_GYR_ID and COMPASS_DEV_ID stay as the vehicle has them".into(),
    ];
    let mut line = |name: String, value: f64, what: &str| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "# {name}: {what}\n{name},{value:.9}");
    };
    if let Some(acc) = affine::si_triad(inputs, SensorKind::Acc, TARGET)? {
        affine::refuse_other_axes(&acc.gain, SensorKind::Acc, TARGET)?;
        for (at, axis) in AXES.into_iter().enumerate() {
            line(format!("INS_ACCOFFS_{axis}"), acc.bias[at], "m/s^2, taken from the reading");
            line(format!("INS_ACCSCAL_{axis}"), acc.gain[(at, at)], "no unit, after the offset");
        }
        cannot.push(format!(
            "the gain of acc off its diagonal, up to {:.2e}: angles between its axes, and a turn of them all",
            skew(&acc.gain)
        ));
    }
    if let Some(gyr) = affine::si_triad(inputs, SensorKind::Gyr, TARGET)? {
        for (at, axis) in AXES.into_iter().enumerate() {
            line(format!("INS_GYROFFS_{axis}"), gyr.bias[at], "rad/s, taken from the reading");
        }
        cannot.push("scale and axes of gyr, and any bias at power-on: ArduPilot estimates the gyroscope's offset then".into());
    }
    if let Some(mag) = affine::si_triad(inputs, SensorKind::Mag, TARGET)? {
        let milligauss = Unit::MilliGauss.per_si().unwrap_or(f64::NAN);
        let (rotation, symmetric) = affine::symmetric(&mag.gain, SensorKind::Mag, TARGET)?;
        for (at, axis) in AXES.into_iter().enumerate() {
            line(
                format!("COMPASS_OFS_{axis}"),
                -mag.bias[at] * milligauss,
                "milligauss, added to the reading",
            );
            line(format!("COMPASS_DIA_{axis}"), symmetric[(at, at)], "no unit, after the offset");
        }
        for (axis, at) in AXES.into_iter().zip([(0, 1), (0, 2), (1, 2)]) {
            line(format!("COMPASS_ODI_{axis}"), symmetric[at], "no unit, off the diagonal");
        }
        cannot.push(format!(
            "the rotation of mag into the axes of acc, {:.2} degrees: ArduPilot's matrix is symmetric",
            rotation.angle().to_degrees()
        ));
    }
    SensorKind::ALL.iter().for_each(|kind| cannot.extend(higher_terms(inputs, *kind)));
    Ok(Document { text, cannot })
}

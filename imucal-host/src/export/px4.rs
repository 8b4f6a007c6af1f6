//! PX4's parameters, in the form that QGroundControl loads.
//!
//! Convention, by PX4's `sensor_calibration`: accelerometer (raw − OFF)·SCALE in m/s², axis by axis; gyroscope raw − OFF in
//! rad/s; magnetometer S·(raw − OFF) in gauss, S symmetric with SCALE on the diagonal and XODIAG, YODIAG, ZODIAG at (x, y),
//! (x, z), (y, z). A line: vehicle, component, name, value, type (9: float), between tabs. Axes are those of the sensor before
//! PX4's rotation.

use std::fmt::Write;

use super::{
    Document, ExportError, Inputs,
    affine::{self, higher_terms, no_errors, skew},
};
use crate::recording::{SensorKind, Unit};

const TARGET: &str = "px4";
const AXES: [&str; 3] = ["X", "Y", "Z"];

pub(super) fn document(inputs: &Inputs<'_>) -> Result<Document, ExportError> {
    let mut text = String::from("# PX4 parameters of the first sensor of each kind.\n");
    let mut cannot = vec![
        no_errors(),
        "which sensor it is: set CAL_ACC0_ID, CAL_GYRO0_ID and CAL_MAG0_ID to the device's own numbers"
            .into(),
    ];
    let mut line = |name: String, value: f64, what: &str| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "# {name}: {what}\n1\t1\t{name}\t{value:.9e}\t9");
    };
    if let Some(acc) = affine::si_triad(inputs, SensorKind::Acc, TARGET)? {
        affine::refuse_other_axes(&acc.gain, SensorKind::Acc, TARGET)?;
        for (at, axis) in AXES.into_iter().enumerate() {
            line(format!("CAL_ACC0_{axis}OFF"), acc.bias[at], "m/s^2, taken from the reading");
            line(format!("CAL_ACC0_{axis}SCALE"), acc.gain[(at, at)], "no unit, after the offset");
        }
        cannot.push(format!(
            "the gain of acc off its diagonal, up to {:.2e}: angles between its axes, and a turn of them all",
            skew(&acc.gain)
        ));
    }
    if let Some(gyr) = affine::si_triad(inputs, SensorKind::Gyr, TARGET)? {
        for (at, axis) in AXES.into_iter().enumerate() {
            line(format!("CAL_GYRO0_{axis}OFF"), gyr.bias[at], "rad/s, taken from the reading");
        }
        let scale = gyr.gain.diagonal().iter().map(|entry| (entry - 1.0).abs()).fold(0.0, f64::max);
        cannot.push(format!(
            "the gain of gyr: up to {:.2} % of scale, and {:.2e} off its diagonal",
            100.0 * scale,
            skew(&gyr.gain)
        ));
    }
    if let Some(mag) = affine::si_triad(inputs, SensorKind::Mag, TARGET)? {
        let gauss = Unit::Gauss.per_si().unwrap_or(f64::NAN);
        let (rotation, symmetric) = affine::symmetric(&mag.gain, SensorKind::Mag, TARGET)?;
        for (at, axis) in AXES.into_iter().enumerate() {
            line(format!("CAL_MAG0_{axis}OFF"), mag.bias[at] * gauss, "gauss, taken from the reading");
            line(format!("CAL_MAG0_{axis}SCALE"), symmetric[(at, at)], "no unit, after the offset");
        }
        for (axis, at) in AXES.into_iter().zip([(0, 1), (0, 2), (1, 2)]) {
            line(format!("CAL_MAG0_{axis}ODIAG"), symmetric[at], "no unit, off the diagonal");
        }
        cannot.push(format!(
            "the rotation of mag into the axes of acc, {:.2} degrees: PX4's matrix is symmetric",
            rotation.angle().to_degrees()
        ));
    }
    SensorKind::ALL.iter().for_each(|kind| cannot.extend(higher_terms(inputs, *kind)));
    Ok(Document { text, cannot })
}

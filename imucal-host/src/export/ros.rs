//! ROS: the calibration of the package `imu_calib`, and covariances of `sensor_msgs/Imu`.
//!
//! Convention: `imu_calib` corrects an acceleration in m/s² as SM·raw − bias (its `accel_calib.cpp`), SM by rows, so that its
//! bias is the gain times the stored bias. The covariances of `sensor_msgs/Imu` are variances of one sample: N²·rate.

use std::fmt::Write;

use nalgebra::Vector3;

use super::{
    Document, ExportError, Inputs,
    affine::{self, higher_terms, no_errors},
    level::{self, Level},
};
use crate::{allan::process::per_sample, recording::SensorKind};

const TARGET: &str = "ros";

pub(super) fn document(inputs: &Inputs<'_>) -> Result<Document, ExportError> {
    let triad = affine::si_triad(inputs, SensorKind::Acc, TARGET)?
        .ok_or(ExportError::NoSensor { target: TARGET, sensor: SensorKind::Acc })?;
    let mut text = String::from("# imu_calib: acceleration [m/s^2] = SM * raw [m/s^2] - bias\n");
    let rows: Vec<String> = triad.gain.transpose().iter().map(|entry| format!("{entry:.9e}")).collect();
    let bias: Vector3<f64> = triad.gain * triad.bias;
    // Writing to a string cannot fail.
    let _ = writeln!(text, "SM: [{}]    # no unit, by rows: the gain", rows.join(", "));
    let _ = writeln!(
        text,
        "bias: [{:.9e}, {:.9e}, {:.9e}]    # m/s^2: the gain times the raw bias",
        bias.x, bias.y, bias.z
    );
    let mut cannot = vec![no_errors()];
    for (kind, field) in [
        (SensorKind::Acc, "linear_acceleration_covariance"),
        (SensorKind::Gyr, "angular_velocity_covariance"),
    ] {
        match covariance(inputs, kind)? {
            Some(line) => {
                let _ = writeln!(text, "{field}: {line}");
            }
            None => {
                cannot.push(format!("{field}: no --noise with an estimate for each axis of {kind} was given"))
            }
        }
    }
    cannot.extend(higher_terms(inputs, SensorKind::Acc));
    for kind in [SensorKind::Gyr, SensorKind::Mag] {
        if inputs.calibration.is_some_and(|calibration| calibration.triad(kind).is_some()) {
            cannot.push(format!("the calibration of {kind}: imu_calib corrects the accelerometer alone"));
        }
    }
    cannot.push("noise that is not white: a covariance holds for one sample".into());
    Ok(Document { text, cannot })
}

fn covariance(inputs: &Inputs<'_>, kind: SensorKind) -> Result<Option<String>, ExportError> {
    let Some(sensor) =
        inputs.noise.and_then(|noise| noise.sensor(kind)).filter(|sensor| sensor.axes.len() == 3)
    else {
        return Ok(None);
    };
    let rate = level::rate(inputs, sensor)?;
    // A zero would say that an axis has no noise.
    let variances: Option<Vec<f64>> = sensor
        .axes
        .iter()
        .map(|axis| Some(per_sample(Level::of(&axis.as_ref()?.white)?.value, rate).powi(2)))
        .collect();
    let Some([x, y, z]) = variances.as_deref() else { return Ok(None) };
    let unit = &sensor.unit;
    Ok(Some(format!(
        "[{x:.6e}, 0, 0, 0, {y:.6e}, 0, 0, 0, {z:.6e}]    # ({unit})^2 of a sample at {rate:.3} Hz: N^2 * rate"
    )))
}

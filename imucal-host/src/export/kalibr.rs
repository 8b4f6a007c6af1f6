//! Kalibr's imu.yaml: one density and one random walk for each inertial sensor.
//!
//! Convention: continuous-time densities, N in unit/√Hz and K in unit·√Hz (the page "IMU Noise Model" of Kalibr's wiki
//! has K in m/s³/√Hz and rad/s²/√Hz, which is the same); one number for three axes, here their root mean square.

use std::fmt::Write;

use super::{
    Document, ExportError, Inputs,
    level::{self, Level},
    terms_without_a_place,
};
use crate::{recording::SensorKind, store::noise_file::NoiseOfSensor};

const TARGET: &str = "kalibr";

pub(super) fn document(inputs: &Inputs<'_>) -> Result<Document, ExportError> {
    let acc = level::sensor(inputs, SensorKind::Acc, TARGET)?;
    let gyr = level::sensor(inputs, SensorKind::Gyr, TARGET)?;
    let rate = level::rate(inputs, gyr)?;
    let mut text = String::from(
        "# Kalibr imu.yaml. Densities of continuous time; one number is the root mean square of three axes.\n",
    );
    // Writing to a string cannot fail.
    let _ = writeln!(text, "rostopic: /imu0    # the topic of the bag; change it");
    let _ = writeln!(text, "update_rate: {rate:.6}    # Hz");
    let mut hidden = Vec::new();
    for (kind, name, sensor, units) in [
        (SensorKind::Acc, "accelerometer", acc, ["m/s^2/sqrt(Hz)", "m/s^3/sqrt(Hz)"]),
        (SensorKind::Gyr, "gyroscope", gyr, ["rad/s/sqrt(Hz)", "rad/s^2/sqrt(Hz)"]),
    ] {
        let (white, walk) = levels(kind, sensor)?;
        hidden.extend(level::hidden(kind, sensor, "the root mean square is that of the others"));
        let _ = writeln!(
            text,
            "{name}_noise_density: {:.6e}    # {}: N, the density of white noise{}",
            white.value,
            units[0],
            white.remark()
        );
        let _ = writeln!(
            text,
            "{name}_random_walk: {:.6e}    # {}: K, the density of the bias' steps{}",
            walk.value,
            units[1],
            walk.remark()
        );
    }
    let mut cannot = vec![
        "the bias instability B, quantisation and the correlation time: Kalibr's bias is a random walk"
            .to_owned(),
        "differences between axes".to_owned(),
    ];
    cannot.extend(hidden);
    cannot.extend(terms_without_a_place(inputs));
    Ok(Document { text, cannot })
}

fn levels(kind: SensorKind, sensor: &NoiseOfSensor) -> Result<(Level, Level), ExportError> {
    let missing = |what, reason: Option<&String>| ExportError::NotKnown {
        target: TARGET,
        sensor: kind,
        what,
        why: reason.cloned().unwrap_or_default(),
    };
    let first = sensor.known_axes().next();
    let white = Level::of_sensor(sensor, |axis| &axis.white)
        .ok_or_else(|| missing("white noise", first.and_then(|axis| axis.white.reason.as_ref())))?;
    let walk = Level::of_sensor(sensor, |axis| &axis.random_walk).or_else(|| forgetting(sensor));
    let walk =
        walk.ok_or_else(|| missing("random walk", first.and_then(|axis| axis.random_walk.reason.as_ref())))?;
    Ok((white, walk))
}

/// Where a bias forgets, the density of its steps: what it does within less than its correlation time.
fn forgetting(sensor: &NoiseOfSensor) -> Option<Level> {
    let steps = sensor.known_axes().map(|axis| {
        let forgets = axis.bias_std.value.zip(axis.correlation_time.value);
        let step = forgets.map(|(std, time)| Level { value: level::step_density(std, time), bound: false });
        step.or(Level::of(&axis.random_walk))
    });
    Level::root_mean_square(steps)
}

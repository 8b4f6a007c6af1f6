//! The noise of a Gazebo sensor, as SDF.
//!
//! Convention, by gz-sensors' `GaussianNoiseModel.cc` and sdformat's `noise.sdf`: a reading is the ideal one plus a static
//! bias, a dynamic bias and a draw of N(mean, stddev). `stddev` is that of a sample: N·√rate. `dynamic_bias_stddev` is a
//! density: the bias goes by d·√dt a step and reaches d·√(T/2) in the long run, T being `dynamic_bias_correlation_time`.
//! The sign of the static bias is drawn at random at each start, so that a measured one belongs in `mean`; `bias_mean` is
//! 0 here. A magnetometer is in tesla.

use std::fmt::Write;

use super::{
    Document, ExportError, Inputs,
    level::{self, Level},
    terms_without_a_place,
};
use crate::{
    allan::process::per_sample,
    recording::{SensorKind, Unit, unit::MICROTESLA_PER_TESLA},
    store::noise_file::{NoiseOfAxis, NoiseOfSensor},
};

const TARGET: &str = "sdf";

pub(super) fn document(inputs: &Inputs<'_>) -> Result<Document, ExportError> {
    let noise = inputs.noise.ok_or(ExportError::NoNoise { target: TARGET })?;
    let mut text = String::from(
        "<!-- Noise of a Gazebo sensor. stddev is that of a sample; dynamic_bias_stddev is a density. -->\n",
    );
    let mut cannot = Vec::new();
    let there: Vec<SensorKind> =
        SensorKind::ALL.into_iter().filter(|kind| noise.sensor(*kind).is_some()).collect();
    let inertial: Vec<SensorKind> = there.iter().copied().filter(|kind| *kind != SensorKind::Mag).collect();
    for kinds in [inertial, there.into_iter().filter(|kind| *kind == SensorKind::Mag).collect()] {
        let Some(first) = kinds.first() else { continue };
        let rate = level::rate(inputs, level::sensor(inputs, *first, TARGET)?)?;
        let kind = if *first == SensorKind::Mag { "magnetometer" } else { "imu" };
        // Writing to a string cannot fail.
        let _ = writeln!(text, "<sensor name=\"{kind}\" type=\"{kind}\">");
        let _ = writeln!(
            text,
            "  <update_rate>{rate:.6}</update_rate> <!-- Hz; stddev holds at this rate alone -->"
        );
        let _ = writeln!(text, "  <{kind}>");
        for kind in kinds {
            let sensor = level::sensor(inputs, kind, TARGET)?;
            of_sensor(&mut text, kind, sensor, inputs, &mut cannot)?;
        }
        let _ = writeln!(text, "  </{kind}>\n</sensor>");
    }
    cannot.push("the bias instability B and quantisation: Gazebo's bias is white noise through one first-order filter".to_owned());
    cannot.extend(terms_without_a_place(inputs));
    Ok(Document { text, cannot })
}

fn of_sensor(
    text: &mut String,
    kind: SensorKind,
    sensor: &NoiseOfSensor,
    inputs: &Inputs<'_>,
    cannot: &mut Vec<String>,
) -> Result<(), ExportError> {
    let element = match kind {
        SensorKind::Acc => Some("linear_acceleration"),
        SensorKind::Gyr => Some("angular_velocity"),
        SensorKind::Mag => None,
    };
    if let Some(element) = element {
        let _ = writeln!(text, "    <{element}>");
    }
    for (at, axis) in sensor.axes.iter().enumerate() {
        let Some(axis) = axis else { continue };
        let mean = bias(inputs, kind, at, cannot);
        let about = About { kind, name: AXES[at], rate: level::rate(inputs, sensor)?, mean };
        of_axis(text, &about, axis, inputs, cannot)?;
    }
    cannot.extend(level::hidden(kind, sensor, "it has none here"));
    if let Some(element) = element {
        let _ = writeln!(text, "    </{element}>");
    }
    Ok(())
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// What is written of an axis in addition to its noise.
struct About {
    kind: SensorKind,
    name: &'static str,
    /// Hz.
    rate: f64,
    /// What it reads at zero, SI unit.
    mean: f64,
}

fn of_axis(
    text: &mut String,
    about: &About,
    axis: &NoiseOfAxis,
    inputs: &Inputs<'_>,
    cannot: &mut Vec<String>,
) -> Result<(), ExportError> {
    let About { kind, name, rate, mean } = *about;
    let (unit, scale) = match kind {
        SensorKind::Mag => ("T".to_owned(), 1.0 / MICROTESLA_PER_TESLA),
        _ => (Unit::si(kind).to_string(), 1.0),
    };
    let white = Level::of(&axis.white).ok_or_else(|| ExportError::NotKnown {
        target: TARGET,
        sensor: kind,
        what: "white noise",
        why: axis.white.reason.clone().unwrap_or_default(),
    })?;
    let (deviation, density) = (per_sample(white.value, rate) * scale, white.value * scale);
    let remark = white.remark();
    let mean = mean * scale;
    // Writing to a string cannot fail.
    let _ = write!(
        text,
        "      <{name}><noise type=\"gaussian\">
        <mean>{mean:.6e}</mean> <!-- {unit}: the measured bias -->
        <stddev>{deviation:.6e}</stddev> <!-- {unit} a sample: N {density:.4e} {unit}/sqrt(Hz) times sqrt(rate){remark} -->
        <bias_mean>0</bias_mean> <!-- its sign would be drawn at random -->
"
    );
    match drift(axis, inputs.noise.map_or(f64::NAN, |noise| noise.duration)) {
        Some((density, time, words)) => {
            let density = density * scale;
            let _ = write!(
                text,
                "        <dynamic_bias_stddev>{density:.6e}</dynamic_bias_stddev> <!-- {unit}*sqrt(Hz), a density: {words} -->
        <dynamic_bias_correlation_time>{time:.6e}</dynamic_bias_correlation_time> <!-- s -->
"
            );
        }
        None => cannot.push(unseen_drift(about, axis)),
    }
    let _ = writeln!(text, "      </noise></{name}>");
    Ok(())
}

fn unseen_drift(about: &About, axis: &NoiseOfAxis) -> String {
    let most = axis
        .random_walk
        .at_most
        .map_or(String::new(), |most| format!(" (random walk at most {most:.2e} {})", axis.random_walk.unit));
    format!(
        "{}, axis {}: the drift of the bias, which the recording does not show{most}",
        about.kind, about.name
    )
}

/// Density of the bias' steps, its correlation time, s, and where both come from.
fn drift(axis: &NoiseOfAxis, duration: f64) -> Option<(f64, f64, String)> {
    if let Some((std, time)) = axis.bias_std.value.zip(axis.correlation_time.value) {
        let words = format!("{std:.3e} in the long run times sqrt(2/T)");
        return Some((level::step_density(std, time), time, words));
    }
    // A walk has none: within the recording it is as one that forgets after it.
    let walk = axis.random_walk.value?;
    Some((
        walk,
        duration,
        "K; the correlation time is the recording's length, within which the bias did not forget".into(),
    ))
}

/// What the sensor reads at zero, SI unit; 0 where the calibration does not say it.
fn bias(inputs: &Inputs<'_>, kind: SensorKind, axis: usize, cannot: &mut Vec<String>) -> f64 {
    let Some(triad) = inputs.calibration.and_then(|calibration| calibration.triad(kind)) else { return 0.0 };
    match triad.unit_in.per_known_si() {
        Some(per_si) => triad.bias[axis] / per_si,
        None => {
            let line = format!(
                "the bias of {kind}: raw values are {}, which the simulator does not have",
                triad.unit_in
            );
            if !cannot.contains(&line) {
                cannot.push(line);
            }
            0.0
        }
    }
}

//! A Python module that needs numpy alone: the unit as a function of an ideal stream, and other units like it.
//!
//! Convention: that of the core; `apply` is the forward model, from what a simulator says to what the unit reads, and
//! `correct_triad` its inverse. Noise is added to the ideal value: densities, by the interval of the rows.

use std::fmt::Write;

use super::{Document, ExportError, Inputs, level};
use crate::{
    recording::{SensorKind, Unit},
    store::{
        StoredTriad,
        covariance_file::EntryCovariance,
        noise_file::{NoiseOfAxis, NoiseOfSensor},
    },
};

const TARGET: &str = "python";
/// The functions.
const CODE: &str = include_str!("python.txt");

pub(super) fn document(inputs: &Inputs<'_>) -> Result<Document, ExportError> {
    let calibration = inputs.calibration.ok_or(ExportError::NoCalibration { target: TARGET })?;
    let mut text = String::from(
        "\"\"\"A calibrated unit. calibrated = f * gain @ sense(raw - bias); apply() is the inverse, with noise.\"\"\"\n\n",
    );
    let mut cannot = vec!["quantisation, saturation and bandwidth".to_owned()];
    text.push_str("UNIT = {\n");
    for kind in SensorKind::ALL {
        let Some(triad) = calibration.triad(kind) else { continue };
        // Writing to a string cannot fail.
        let _ = writeln!(text, "    \"{kind}\": {{");
        of_triad(&mut text, triad);
        match inputs.covariance.and_then(|covariance| covariance.sensor(kind)) {
            Some(covariance) => of_covariance(&mut text, covariance),
            None => cannot.push(format!(
                "correlations between errors of {kind}: no --covariance with them was given, and sample_unit draws each number by \
                 itself"
            )),
        }
        match inputs.noise.and_then(|noise| noise.sensor(kind)).filter(|noise| noise.axes.len() == 3) {
            Some(noise) => {
                let scale = per_calibrated(kind, triad, noise)?;
                cannot.extend(level::hidden(kind, noise, "it has none here"));
                of_noise(&mut text, kind, noise, (scale, triad.unit_out), &mut cannot);
            }
            None => cannot.push(format!("the noise of {kind}: no --noise with an estimate for it was given")),
        }
        text.push_str("    },\n");
    }
    text.push_str("}\n");
    text.push_str(CODE);
    Ok(Document { text, cannot })
}

fn of_triad(text: &mut String, triad: &StoredTriad) {
    let zero = [0.0; 3];
    let (raw, out) = (triad.unit_in.to_string(), triad.unit_out.to_string());
    let warm = triad.temperature.as_ref();
    let quality = warm.and_then(|terms| terms.quality.as_ref());
    let curved = warm.and_then(|terms| terms.curvature.as_ref());
    let bent = triad.nonlinearity.as_ref();
    let optional = |value: Option<f64>| value.map_or_else(|| "None".to_owned(), |value| format!("{value:?}"));
    let vector = |values: Option<&[f64; 3]>| format!("{:?}", values.unwrap_or(&zero));
    let none = [zero; 3];
    let matrix = |rows: Option<&[[f64; 3]; 3]>| format!("{:?}", rows.unwrap_or(&none));
    let mut line = |name: &str, value: String, unit: &str| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "        \"{name}\": {value},  # {unit}");
    };
    line("unit_in", format!("{raw:?}"), "unit of raw values");
    line("unit_out", format!("{out:?}"), "unit of calibrated values");
    line("gain", matrix(Some(&triad.gain)), "calibrated per raw unit");
    line("gain_std", matrix(Some(&triad.gain_std)), "standard errors");
    line("bias", vector(Some(&triad.bias)), "raw unit");
    line("bias_std", vector(Some(&triad.bias_std)), "standard errors");
    line("reference", optional(warm.map(|terms| terms.reference)), "degC; None: no temperature terms");
    line("bias_slope", vector(warm.map(|terms| &terms.bias_slope)), "raw unit per kelvin");
    line("bias_slope_std", vector(quality.map(|quality| &quality.bias_slope_std)), "standard errors");
    line("scale_slope", vector(warm.map(|terms| &terms.scale_slope)), "per kelvin");
    line("scale_slope_std", vector(quality.map(|quality| &quality.scale_slope_std)), "standard errors");
    line("bias_quadratic", vector(curved.map(|terms| &terms.bias)), "raw unit per kelvin^2");
    line("bias_quadratic_std", vector(curved.map(|terms| &terms.bias_std)), "standard errors");
    line("scale_quadratic", vector(curved.map(|terms| &terms.scale)), "per kelvin^2");
    line("scale_quadratic_std", vector(curved.map(|terms| &terms.scale_std)), "standard errors");
    line("range", optional(bent.map(|bent| bent.range)), "raw unit; None: no nonlinear terms");
    line("quadratic", vector(bent.map(|bent| &bent.quadratic)), "per raw unit");
    line("quadratic_std", vector(bent.map(|bent| &bent.quadratic_std)), "standard errors");
    line("cubic", vector(bent.map(|bent| &bent.cubic)), "per raw unit^2");
    line("cubic_std", vector(bent.map(|bent| &bent.cubic_std)), "standard errors");
    line("cross", matrix(bent.map(|bent| &bent.cross)), "per raw unit: xy, yz, zx");
    line("cross_std", matrix(bent.map(|bent| &bent.cross_std)), "standard errors");
}

fn of_covariance(text: &mut String, covariance: &EntryCovariance) {
    let root = covariance.root();
    let rows: Vec<Vec<f64>> = root.row_iter().map(|row| row.iter().copied().collect()).collect();
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "        \"entries\": {:?},  # estimated: gain by rows 0 to 8, bias 9 to 11\n        \"root\": {rows:?},  # their errors, by \
         independent standard normal numbers",
        covariance.entries
    );
}

/// How many calibrated units make one of the noise's, which is added to calibrated values.
fn per_calibrated(kind: SensorKind, triad: &StoredTriad, noise: &NoiseOfSensor) -> Result<f64, ExportError> {
    let unit = triad.unit_out;
    let is_alike = (unit == Unit::Arbitrary) == (noise.unit == Unit::Arbitrary.to_string());
    let refused =
        || ExportError::NoiseUnit { target: TARGET, sensor: kind, found: noise.unit.clone(), expected: unit };
    unit.per_si().filter(|_| is_alike).ok_or_else(refused)
}

/// Scaled into the unit of calibrated values.
fn of_noise(
    text: &mut String,
    kind: SensorKind,
    noise: &NoiseOfSensor,
    (scale, unit): (f64, Unit),
    cannot: &mut Vec<String>,
) {
    let each = |of: &dyn Fn(&NoiseOfAxis) -> f64| -> [f64; 3] {
        std::array::from_fn(|at| noise.axes[at].as_ref().map_or(0.0, of))
    };
    let forgets = |axis: &NoiseOfAxis| axis.bias_std.value.zip(axis.correlation_time.value);
    // A Gauss–Markov bias has its own process, and no further walk.
    let walk = |axis: &NoiseOfAxis| {
        if forgets(axis).is_some() { 0.0 } else { axis.random_walk.value.unwrap_or(0.0) }
    };
    let flicker = |axis: &NoiseOfAxis| {
        if forgets(axis).is_some() { 0.0 } else { axis.bias_instability.value.unwrap_or(0.0) }
    };
    let scaled = |values: [f64; 3]| values.map(|value| scale * value);
    text.push_str("        \"noise\": {\n");
    for (name, values, unit) in [
        ("white", scaled(each(&|axis| axis.white.value.unwrap_or(0.0))), format!("N, {unit}/sqrt(Hz)")),
        ("bias_instability", scaled(each(&flicker)), format!("B, {unit}")),
        ("random_walk", scaled(each(&walk)), format!("K, {unit}*sqrt(Hz)")),
        (
            "bias_std",
            scaled(each(&|axis| forgets(axis).map_or(0.0, |(std, _)| std))),
            format!("of a Gauss–Markov bias, {unit}"),
        ),
        (
            "correlation_time",
            each(&|axis| forgets(axis).map_or(1.0, |(_, time)| time)),
            "of that bias, s".into(),
        ),
    ] {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "            \"{name}\": {values:?},  # {unit}");
    }
    text.push_str("        },\n");
    for (name, axis) in ["x", "y", "z"].into_iter().zip(&noise.axes) {
        let hidden =
            axis.as_ref().is_some_and(|axis| forgets(axis).is_none() && axis.random_walk.value.is_none());
        if let Some(most) = axis.as_ref().and_then(|axis| axis.random_walk.at_most).filter(|_| hidden) {
            let most = scale * most;
            cannot.push(format!(
                "{kind}, axis {name}: a walk of the bias below {most:.2e} {unit}*sqrt(Hz), which was not seen"
            ));
        }
    }
}

//! The table of a calibration, for people.

use std::fmt::{self, Write};

use imucal_core::triad::Triad;

use super::{
    measure::{counted, degrees, measure, measured_degrees, percent, plain, rounded},
    model,
    prose::hanging,
    temperature,
    terms::write_nonlinearity,
};
use crate::{
    calibrate::{
        Calibration, FitSummary, SegmentationReport, SensorOutcome, fit::compare::Comparison,
        outcome::RigFindings,
    },
    recording::{GIMBALS, SensorKind, unit::STANDARD_GRAVITY},
    store::StoredNonlinearity,
};

/// Sensor's name in words.
pub fn words(kind: SensorKind) -> &'static str {
    match kind {
        SensorKind::Acc => "accelerometer",
        SensorKind::Gyr => "gyroscope",
        SensorKind::Mag => "magnetometer",
    }
}

/// What an observation of the sensor is called, many of them.
pub(crate) fn observations(kind: SensorKind, fit: &FitSummary) -> &'static str {
    match kind {
        SensorKind::Gyr if fit.rig.is_some() => "motions",
        SensorKind::Acc => "rests",
        SensorKind::Gyr => "turns",
        SensorKind::Mag => "points",
    }
}

/// The whole table.
pub fn table(calibration: &Calibration) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_table(&mut text, calibration);
    text
}

fn write_table(text: &mut String, calibration: &Calibration) -> fmt::Result {
    write!(text, "{}", calibration.recording)?;
    for part in [&calibration.sensor_name, &calibration.serial] {
        if !part.is_empty() {
            write!(text, ", {part}")?;
        }
    }
    writeln!(text)?;
    for warning in &calibration.warnings {
        writeln!(text, "warning: {warning}")?;
    }
    if let Some(segmentation) = &calibration.segmentation {
        write_segmentation(text, segmentation)?;
    }
    for outcome in &calibration.sensors {
        writeln!(text)?;
        write_sensor(text, outcome)?;
    }
    calibration.comparisons.iter().try_for_each(|comparison| write_comparison(text, comparison))
}

fn write_comparison(text: &mut String, comparison: &Comparison) -> fmt::Result {
    writeln!(text)?;
    writeln!(text, "{}: models compared", words(comparison.kind))?;
    writeln!(
        text,
        "  {:<5} {:>10} {:>10} {:>10} {:>10} {:>9}",
        "model", "parameters", "rms", "held out", "2nd half", "p-value"
    )?;
    for (step, p_value) in &comparison.rungs {
        writeln!(
            text,
            "  {:<5} {:>10} {:>10} {:>10} {:>10} {:>9}",
            step.name,
            step.free,
            plain(step.rms),
            step.held_out_rms.map_or_else(|| "-".into(), plain),
            step.second_half_rms.map_or_else(|| "-".into(), plain),
            p_value.filter(|p| !p.is_nan()).map_or_else(|| "-".into(), |p| format!("{p:.1e}"))
        )?;
        writeln!(text, "        {}", step.adds)?;
    }
    writeln!(text, "  use {}: {}", comparison.chosen, comparison.why)
}

fn write_segmentation(text: &mut String, segmentation: &SegmentationReport) -> fmt::Result {
    let reference = if segmentation.from_initial_rest { "the initial rest" } else { "the quietest tenth" };
    let count = segmentation.rests.len();
    let rests = if count == 1 { "rest" } else { "rests" };
    write!(text, "{count} {rests}, found at {} times the variance of {reference}", segmentation.multiplier)?;
    if segmentation.gain_spread > 0.0 {
        let percent = 100.0 * segmentation.gain_spread;
        write!(text, "; gains change by at most {percent:.2} % over the thresholds tried")?;
    }
    writeln!(text)
}

fn write_sensor(text: &mut String, outcome: &SensorOutcome) -> fmt::Result {
    let name = words(outcome.kind);
    match &outcome.verdict {
        Ok(()) if outcome.suspicions.is_empty() => writeln!(text, "{name} ({}): accepted", outcome.model)?,
        Ok(()) => write_suspicions(text, name, outcome)?,
        Err(refused) => {
            writeln!(text, "{name} ({}): REFUSED, {}", outcome.model, refused.refusal.reason())?;
            writeln!(text, "  because: {}", outcome.detail().unwrap_or_default())?;
            writeln!(text, "  to do:   {}", refused.advice)?;
        }
    }
    if let Some(described) = model::described(outcome.model) {
        text.push_str(&hanging("  model:   ", described));
    }
    let Some(fit) = &outcome.fit else { return Ok(()) };
    if outcome.verdict.is_err() {
        writeln!(text, "  for information only, the refused fit:")?;
    }
    write_fit(text, outcome.kind, fit)
}

fn write_suspicions(text: &mut String, name: &str, outcome: &SensorOutcome) -> fmt::Result {
    writeln!(text, "{name} ({}): SUSPECT, the residual is not the sensor's noise", outcome.model)?;
    for found in &outcome.suspicions {
        writeln!(text, "  follows {}: {}", found.follows.name(), found.detail)?;
    }
    writeln!(
        text,
        "  to do:   run `imucal diagnose` on the recording to find the cause; --accept-suspect writes it"
    )
}

fn write_fit(text: &mut String, kind: SensorKind, fit: &FitSummary) -> fmt::Result {
    let triad = fit.raw_triad();
    let (gain_std, bias_std) = fit.raw_std();
    writeln!(text, "  calibrated [{}] = gain · (raw [{}] − bias)", fit.unit_out, fit.unit_in)?;
    text.push_str(&parameters(&triad, &Triad { gain: gain_std, bias: bias_std }));
    let held = fit.held_out_rms.map_or_else(|| "not known".into(), |rms| rms_text(kind, fit, rms));
    writeln!(
        text,
        "  {} {}, {} parameters; rms {}, held out {held}",
        fit.observations,
        observations(kind, fit),
        fit.parameters,
        rms_text(kind, fit, fit.rms)
    )?;
    writeln!(
        text,
        "  condition {}, coverage {}, {}, stopped by {}",
        rounded(fit.condition, 1),
        percent(fit.coverage),
        counted(fit.iterations, "iteration"),
        fit.termination.name()
    )?;
    write_notes(text, fit)
}

/// Three rows of the gain and one of the bias, each entry with its standard error; ends its lines.
pub(crate) fn parameters(value: &Triad<f64>, std: &Triad<f64>) -> String {
    let row = |name: &str, entries: [String; 3]| {
        let [x, y, z] = entries;
        format!("  {name:<4} {x:>24} {y:>24} {z:>24}\n")
    };
    let gain = |row: usize| {
        std::array::from_fn(|column| measure(value.gain[(row, column)], std.gain[(row, column)]))
    };
    let bias = std::array::from_fn(|axis| measure(value.bias[axis], std.bias[axis]));
    let rows = ["x", "y", "z"].into_iter().enumerate().map(|(at, axis)| row(axis, gain(at)));
    rows.chain([row("bias", bias)]).collect()
}

/// A residual in the words of its sensor.
pub(crate) fn rms_text(kind: SensorKind, fit: &FitSummary, rms: f64) -> String {
    match kind {
        SensorKind::Gyr if fit.rig.is_some() => format!("{} a motion", degrees(rms, 3)),
        SensorKind::Gyr => format!("{} a turn", degrees(rms, 3)),
        _ => format!("{} {}", plain(rms), fit.rms_unit()),
    }
}

/// What else a fit has found, a sentence each.
pub(crate) fn notes(fit: &FitSummary) -> Vec<String> {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_notes(&mut text, fit);
    text.lines().map(|line| line.trim().to_owned()).collect()
}

fn write_notes(text: &mut String, fit: &FitSummary) -> fmt::Result {
    if let Some(norm) = fit.field_norm {
        writeln!(
            text,
            "  field {} {} (not known beforehand: gain of determinant 1)",
            plain(norm),
            fit.unit_in
        )?;
    }
    if fit.inflation > 1.05 {
        writeln!(
            text,
            "  standard errors are up to {:.1} times those of independent residuals of known variance",
            fit.inflation
        )?;
    }
    if let Some(wander) = fit.bias_wander.filter(|w| w.interpolated) {
        writeln!(
            text,
            "  the bias changes by {} °/s rms from rest to rest; it is interpolated between neighbouring rests",
            rounded(wander.spread.norm().to_degrees() / 3f64.sqrt(), 3)
        )?;
    }
    if let Some(alignment) = &fit.alignment {
        let std = alignment.axes.covariance.diagonal().map(f64::sqrt);
        let by = |k: usize| measured_degrees(alignment.phi[k], std[k]);
        let held = alignment.held_out_rms.map_or_else(
            || "no rest can be held out".into(),
            |rms| format!("held out within {}", degrees(rms, 2)),
        );
        writeln!(
            text,
            "  turned into the accelerometer's axes by {}, {}, {}; dip {}, {held}",
            by(0),
            by(1),
            by(2),
            measured_degrees(alignment.dip.0, alignment.dip.1)
        )?;
    }
    temperature::write(text, fit)?;
    if let Some(found) = fit.raw_nonlinear() {
        write_nonlinearity(text, &StoredNonlinearity::from(&found), fit.unit_in)?;
        writeln!(
            text,
            "    they change a calibrated pose by up to {} {}",
            plain(found.largest),
            fit.unit_out
        )?;
    }
    if let Some(rig) = &fit.rig {
        write_rig(text, rig)?;
    }
    if let Some(search) = &fit.search {
        writeln!(text, "  {}", search.note())?;
    }
    for left in &fit.left_out {
        writeln!(text, "  left out: {left}")?;
    }
    Ok(())
}

fn write_rig(text: &mut String, rig: &RigFindings) -> fmt::Result {
    if let Some((tilt, std)) = rig.tilt {
        let about = |k: usize| measured_degrees(tilt[k], std[k]);
        writeln!(text, "  of the rig: base tilted by {} about x and {} about y", about(0), about(1))?;
    }
    for (name, (source, std)) in GIMBALS.into_iter().zip(rig.sources.iter().flatten()) {
        let parts: Vec<String> = (0..3).map(|k| measure(source[k], std[k])).collect();
        writeln!(text, "  of the rig: hard iron on the {name} gimbal {} uT", parts.join(", "))?;
    }
    if let Some((value, std)) = &rig.g_sensitivity {
        writeln!(text, "  g-sensitivity, °/s per g, not stored in the record:")?;
        let per_g = STANDARD_GRAVITY.to_degrees();
        for row in 0..3 {
            let parts: Vec<String> =
                (0..3).map(|k| measure(value[(row, k)] * per_g, std[(row, k)] * per_g)).collect();
            writeln!(text, "     {}", parts.join(", "))?;
        }
    }
    for note in &rig.notes {
        writeln!(text, "  {note}")?;
    }
    if !rig.unobservable.is_empty() {
        writeln!(text, "  not observable from these poses, fixed: {}", rig.unobservable.join(", "))?;
    }
    Ok(())
}

//! How bias and scale follow the temperature, for people.

use std::fmt::{self, Write};

use imucal_core::model::thermal::BLOCK;

use super::measure::{measure, plain};
use crate::calibrate::{
    FitSummary,
    temperature::{TemperatureFinding, Terms, evidence::CHANCE, finding::Part, groups::Group, ladder::Tried},
};

/// Writes what was found of a sensor's temperature; nothing where it was not looked for.
pub fn write(text: &mut String, fit: &FitSummary) -> fmt::Result {
    let Some(found) = &fit.temperature else { return Ok(()) };
    if let Some(refusal) = &found.refusal {
        writeln!(text, "  temperature: no terms, {}: {refusal}", refusal.reason())?;
        return writeln!(text, "    to do: {}", refusal.advice());
    }
    let (low, high) = found.span;
    match fit.raw_terms() {
        None => writeln!(text, "  temperature: no terms are borne out from {low:.1} to {high:.1} °C")?,
        Some((value, std)) => write_terms(text, fit, found, &value, &std)?,
    }
    found.parts.iter().try_for_each(|part| write_part(text, part))
}

fn write_terms(
    text: &mut String,
    fit: &FitSummary,
    found: &TemperatureFinding,
    value: &Terms,
    std: &Terms,
) -> fmt::Result {
    let (low, high) = found.span;
    let unit = fit.unit_in;
    writeln!(
        text,
        "  temperature: gain and bias hold at {:.1} °C; from {low:.1} to {high:.1} °C",
        found.reference
    )?;
    let span = high - low;
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let (slope, error) = (value.linear.bias_slope[axis], std.linear.bias_slope[axis]);
        if error > 0.0 {
            let moved = plain((slope * span).abs());
            let slope = measure(slope, error);
            write!(text, "    bias of {name} moves {moved} {unit} over {span:.0} K ({slope} {unit}/K)")?;
            write_quadratic(
                text,
                value.bias_quadratic[axis],
                std.bias_quadratic[axis],
                &format!("{unit}/K²"),
            )?;
            writeln!(text)?;
        }
        let (slope, error) = (value.linear.scale_slope[axis], std.linear.scale_slope[axis]);
        if error > 0.0 {
            let moved = plain((100.0 * slope * span).abs());
            write!(
                text,
                "    scale of {name} moves {moved} % over {span:.0} K ({} 1/K)",
                measure(slope, error)
            )?;
            write_quadratic(text, value.scale_quadratic[axis], std.scale_quadratic[axis], "1/K²")?;
            writeln!(text)?;
        }
    }
    Ok(())
}

fn write_quadratic(text: &mut String, value: f64, std: f64, unit: &str) -> fmt::Result {
    if std > 0.0 { write!(text, ", and {} {unit}", measure(value, std)) } else { Ok(()) }
}

fn write_part(text: &mut String, part: &Part) -> fmt::Result {
    let figure = |rms: Option<f64>| rms.map_or_else(|| "not known".into(), plain);
    let (without, with) = part.held_out;
    if part.tried.iter().any(|tried| tried.kept) {
        writeln!(
            text,
            "    held-out temperatures, {BLOCK:.0} K of {} at a time: rms {} → {} {}",
            part.of,
            figure(without),
            figure(with),
            part.unit
        )?;
    }
    for tried in part.tried.iter().filter(|tried| !tried.kept) {
        writeln!(text, "    not kept: {} ({})", tried.group.words(), why(tried, part))?;
    }
    Ok(())
}

/// Why a group is not kept.
fn why(tried: &Tried, part: &Part) -> String {
    match (tried.chance, tried.held_out) {
        (None, _) => format!("the {} do not distinguish it from the other parameters and from time", part.of),
        (Some(p), _) if p >= CHANCE => format!("chance explains it, p = {p:.1e}"),
        (_, None) => "without some temperatures the others do not determine it".into(),
        (_, Some(rms)) => {
            let stands_on =
                if matches!(tried.group, Group::Bias) { "no terms" } else { "those kept before it" };
            format!(
                "held-out temperatures, rms {} {}, are no better than with {stands_on}",
                plain(rms),
                part.unit
            )
        }
    }
}

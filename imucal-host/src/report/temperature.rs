//! How bias and scale follow the temperature, for people.

use std::fmt::{self, Write};

use imucal_core::model::thermal::BLOCK;

use super::{measure::plain, terms::write_temperature};
use crate::{
    calibrate::{
        FitSummary,
        temperature::{evidence::CHANCE, finding::Part, groups::Group, ladder::Tried},
    },
    store::StoredTemperature,
};

/// Writes what was found of a sensor's temperature; nothing where it was not looked for.
pub fn write(text: &mut String, fit: &FitSummary) -> fmt::Result {
    let Some(found) = &fit.temperature else { return Ok(()) };
    if let Some(refusal) = &found.refusal {
        writeln!(text, "  temperature: no terms, {}: {refusal}", refusal.reason())?;
        return writeln!(text, "    to do: {}", refusal.advice());
    }
    let (low, high) = found.span;
    match StoredTemperature::of(fit) {
        None => writeln!(text, "  temperature: no terms are borne out from {low:.1} to {high:.1} °C")?,
        Some(terms) => write_temperature(text, &terms, fit.unit_in)?,
    }
    found.parts.iter().try_for_each(|part| write_part(text, part))
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

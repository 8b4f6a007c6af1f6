//! A calibration: what was accepted, its parameters with their errors, and what it was made of.

use maud::{Markup, html};

use super::{
    Answer, Part, Tone, figure, residuals::residuals, segmentation::segmentation, sentences, sphere::sphere,
};
use crate::{
    calibrate::{Calibration, FitSummary, SensorOutcome, Status, outcome::entry_name, residuals as leftover},
    recording::{Recording, SensorKind, Unit},
    report::{
        measure::{percent, plain, rounded},
        model,
        prose::listed,
        table::{notes, observations, rms_text, words},
    },
};

/// What a page says of a calibration and the recording that it was made from.
#[must_use]
pub fn calibration(calibration: &Calibration, recording: &Recording) -> Part {
    let warnings: Vec<&String> = calibration.read_warnings.iter().chain(&calibration.warnings).collect();
    let body = html! {
        @for outcome in &calibration.sensors { (sensor(outcome, recording, calibration)) }
        @if let Some(found) = &calibration.segmentation {
            h2 { "Segmentation" }
            p {
                (found.rests.len()) " rests, found at " (found.multiplier) " times the variance of "
                @if found.from_initial_rest { "the initial rest" } @else { "the quietest tenth" } "."
                @if found.gain_spread > 0.0 {
                    " Gains change by at most " (format!("{:.2}", 100.0 * found.gain_spread)) " % over the thresholds tried."
                }
            }
            div class="figures" { (segmentation(recording, found)) }
        }
        (sentences("Warnings", &warnings))
    };
    Part { answer: answer(calibration), body }
}

/// The verdict in a sentence.
fn answer(calibration: &Calibration) -> Answer {
    let of = |status: Status| -> Vec<&str> {
        let with = calibration.sensors.iter().filter(|outcome| outcome.status() == status);
        with.map(|outcome| words(outcome.kind)).collect()
    };
    let (accepted, suspect, refused) = (of(Status::Accepted), of(Status::Suspect), of(Status::Refused));
    let clause = |names: &[&str], one: &str, many: &str| match names {
        [] => None,
        [name] => Some(format!("the {name} {one}")),
        names => Some(format!("the {} {many}", listed(names))),
    };
    let clauses = [
        clause(&accepted, "is calibrated and accepted", "are calibrated and accepted"),
        clause(
            &suspect,
            "is suspect: its residual is not its noise",
            "are suspect: their residuals are not their noise",
        ),
        clause(&refused, "is refused", "are refused"),
    ];
    let joined = clauses.into_iter().flatten().collect::<Vec<_>>().join("; ");
    let mut letters = joined.chars();
    let sentence = letters.next().map(|first| format!("{}{}.", first.to_uppercase(), letters.as_str()));
    let tone = match (accepted.is_empty(), suspect.is_empty() && refused.is_empty()) {
        (false, true) => Tone::Good,
        (true, _) if suspect.is_empty() => Tone::Bad,
        _ => Tone::Doubt,
    };
    Answer { tone, words: sentence.unwrap_or_else(|| "The recording has no sensor to calibrate.".to_owned()) }
}

fn sensor(outcome: &SensorOutcome, recording: &Recording, calibration: &Calibration) -> Markup {
    let name = words(outcome.kind);
    html! {
        h2 { (capital(name)) ": " (outcome.status().name()) }
        @if let Some(described) = model::described(outcome.model) { p class="note" { "Model " (outcome.model) ": " (described) "." } }
        @if let Err(refused) = &outcome.verdict {
            p { b { (refused.refusal.reason()) } ": " (outcome.detail().unwrap_or_default()) "." }
            p { "To do: " (refused.advice) "." }
        }
        @for suspicion in &outcome.suspicions { p { "Follows " (suspicion.follows.name()) ": " (suspicion.detail) "." } }
        @if let Some(fit) = &outcome.fit {
            @if outcome.verdict.is_err() { p class="note" { "For information only, the refused fit:" } }
            div class="columns" {
                div { (parameters(fit)) (quality(outcome.kind, fit)) }
                (drawings(outcome, fit, recording, calibration))
            }
        }
    }
}

/// Each parameter with its standard error, and the error that a factor of two makes of it.
fn parameters(fit: &FitSummary) -> Markup {
    let triad = fit.raw_triad();
    let (gain_std, bias_std) = fit.raw_std();
    let of_gain = format!("{}/{}", shown(fit.unit_out), shown(fit.unit_in));
    let entry = |entry: u8| match entry {
        0..9 => {
            let (row, column) = (usize::from(entry / 3), usize::from(entry % 3));
            (triad.gain[(row, column)], gain_std[(row, column)], of_gain.clone())
        }
        _ => (triad.bias[usize::from(entry - 9)], bias_std[usize::from(entry - 9)], shown(fit.unit_in)),
    };
    html! {
        p { "calibrated = gain · (raw − bias)" }
        div class="wide" { table {
            thead { tr { th { "parameter" } th { "value" } th { "std error, k = 1" } th { "k = 2" } th { "unit" } } }
            tbody {
                @for number in 0..12u8 {
                    @let (value, std, unit) = entry(number);
                    tr {
                        td { (entry_name(number)) }
                        td { (figures(value, std)) }
                        @if std > 0.0 { td { (two_digits(std)) } td { (two_digits(2.0 * std)) } }
                        @else { td { "held" } td {} }
                        td { (unit) }
                    }
                }
            }
        } }
    }
}

/// An error in two digits.
fn two_digits(std: f64) -> String {
    match std.log10().floor() as i32 {
        exponent @ -3..2 => format!("{std:.*}", usize::try_from(1 - exponent).unwrap_or(0)),
        _ => format!("{std:.1e}"),
    }
}

/// A value in the digits that its error leaves, or in six.
fn figures(value: f64, std: f64) -> String {
    if std > 0.0 && std.is_finite() && value != 0.0 {
        let digits = (value.abs().log10().floor() - std.log10().floor() + 1.0).clamp(1.0, 12.0) as usize;
        let exponent = value.abs().log10().floor() as i32;
        return match exponent {
            -2..6 => format!("{value:.*}", usize::try_from(digits as i32 - exponent).unwrap_or(0)),
            _ => format!("{value:.digits$e}"),
        };
    }
    plain(value)
}

fn quality(kind: SensorKind, fit: &FitSummary) -> Markup {
    let held = fit.held_out_rms.map_or_else(|| "not known".into(), |rms| rms_text(kind, fit, rms));
    html! {
        table class="facts" { tbody {
            tr { td { "observations" } td { (fit.observations) " " (observations(kind, fit)) " for " (fit.parameters) " parameters" } }
            tr { td { "residual" } td { "rms " (rms_text(kind, fit, fit.rms)) "; on observations left out of the fit " (held) } }
            tr { td { "determined" } td { "condition " (rounded(fit.condition, 1)) ", coverage " (percent(fit.coverage)) } }
            @for note in notes(fit) { tr { td { "note" } td { (note) } } }
        } }
    }
}

fn drawings(
    outcome: &SensorOutcome,
    fit: &FitSummary,
    recording: &Recording,
    calibration: &Calibration,
) -> Markup {
    let observations = leftover::of(outcome, recording, calibration);
    if observations.is_empty() {
        return html! {};
    }
    let directions: Vec<_> = observations.iter().map(|one| one.direction).collect();
    let is_of_turns = outcome.kind == SensorKind::Gyr;
    let what = if is_of_turns { "Axes of the turns" } else { "Directions that were measured" };
    // In a field of unknown length, results are in the unit of raw values, and the rms with them.
    let per_unit = if fit.field_norm.is_some() { fit.nominal.per_unit.abs() } else { 1.0 };
    let (residual, unit, scale, rms) = match (outcome.kind, fit.unit_out) {
        (SensorKind::Gyr, _) => ("attitude error of a turn", "°".to_owned(), 1f64.to_degrees(), fit.rms),
        (_, unit) => ("length less the norm", shown(unit), per_unit, fit.rms / per_unit),
    };
    html! {
        div class="figures" {
            (figure(what, &sphere(&directions, what), &html! { "Coverage " (percent(fit.coverage)) " of the sphere; two halves of equal area." }))
            (residuals(&observations, residual, &unit, scale, rms))
        }
    }
}

fn shown(unit: Unit) -> String {
    unit.to_string().replace("^2", "²").replace("uT", "µT").replace("deg", "°")
}

fn capital(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

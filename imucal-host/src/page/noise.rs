//! A unit's noise: Allan deviations and their coefficients.

use maud::{Markup, html};

use super::{Answer, Part, Tone, deviations::deviations, sentences};
use crate::{
    recording::SensorKind,
    report::{
        measure::plain,
        noise::{FIGURES, reasons},
        prose::listed,
        table::words,
    },
    store::noise_file::{Figure, NoiseFile, NoiseOfSensor},
};

/// What a page says of a unit's noise.
#[must_use]
pub fn noise(file: &NoiseFile) -> Part {
    let body = html! {
        @for kind in SensorKind::ALL {
            @if let Some(sensor) = file.sensor(kind) { (of_sensor(kind, sensor)) }
        }
        (sentences("Warnings", &file.warnings))
    };
    Part { answer: answer(file), body }
}

fn answer(file: &NoiseFile) -> Answer {
    let with = |refused: bool| -> Vec<&str> {
        let of =
            |kind: &SensorKind| file.sensor(*kind).is_some_and(|sensor| sensor.detail.is_some() == refused);
        SensorKind::ALL.into_iter().filter(of).map(words).collect()
    };
    let (estimated, refused) = (with(false), with(true));
    let over = format!("over {} s", plain(file.duration));
    match (estimated.as_slice(), refused.as_slice()) {
        ([], []) => Answer { tone: Tone::Bad, words: "The recording has no sensor.".into() },
        ([], refused) => Answer {
            tone: Tone::Bad,
            words: format!("No noise is estimated: the {} is refused.", listed(refused)),
        },
        (estimated, []) => Answer {
            tone: Tone::Good,
            words: format!("The noise of the {} is estimated {over}.", listed(estimated)),
        },
        (estimated, refused) => {
            let words = format!(
                "The noise of the {} is estimated {over}; refused: {}.",
                listed(estimated),
                listed(refused)
            );
            Answer { tone: Tone::Doubt, words }
        }
    }
}

fn of_sensor(kind: SensorKind, sensor: &NoiseOfSensor) -> Markup {
    let name = words(kind);
    if let Some(detail) = &sensor.detail {
        return html! { h2 { "Noise of the " (name) ": refused" } p { (detail) } };
    }
    html! {
        h2 { "Noise of the " (name) }
        p { (sensor.samples) " samples at " (plain(sensor.rate.unwrap_or(f64::NAN))) " Hz." }
        div class="figures" { (deviations(sensor, name)) }
        div class="wide" { table {
            thead { tr { th { "coefficient, 95 % interval" } @for axis in ["x", "y", "z"] { th { (axis) } } th { "unit" } } }
            tbody {
                @for (name, of) in FIGURES {
                    tr {
                        td { (name) }
                        @for axis in &sensor.axes { td { (axis.as_ref().map_or_else(|| "–".to_owned(), |axis| cell(of(axis)))) } }
                        td { (sensor.known_axes().next().map_or("", |axis| of(axis).unit.as_str())) }
                    }
                }
            }
        } }
        @for (name, why) in reasons(sensor) { p class="note" { "No " (name) ": " (why) "." } }
    }
}

/// A value with its interval, or the most that it may be.
fn cell(figure: &Figure) -> String {
    match (figure.value, figure.interval, figure.at_most) {
        (Some(value), Some([low, high]), _) => format!("{value:.3e} ({low:.2e} to {high:.2e})"),
        (_, _, Some(most)) => format!("< {most:.2e}"),
        _ => "–".into(),
    }
}

//! Two calibrations of one unit: which parameters have moved.

use maud::{Markup, html};

use super::{Answer, Part, Tone, drift::drift};
use crate::{
    compare::{Comparison, SensorComparison},
    report::{
        compare::{meaning, not_compared},
        measure::{plain, rounded},
        prose::listed,
        table::words,
    },
};

/// What a page says of two calibrations.
#[must_use]
pub fn comparison(comparison: &Comparison) -> Part {
    let body = html! {
        @for line in not_compared(comparison) { p class="note" { (line) } }
        @for sensor in &comparison.sensors { (of_sensor(sensor)) }
    };
    Part { answer: answer(comparison), body }
}

fn answer(comparison: &Comparison) -> Answer {
    let has_moved = |sensor: &&SensorComparison| sensor.parameters.iter().any(|parameter| parameter.moved);
    let moved: Vec<&str> =
        comparison.sensors.iter().filter(has_moved).map(|sensor| words(sensor.sensor)).collect();
    match moved.as_slice() {
        [] => Answer { tone: Tone::Good, words: "No parameter has moved beyond chance.".into() },
        moved => Answer {
            tone: Tone::Doubt,
            words: format!("Beyond chance, parameters have moved of the {}.", listed(moved)),
        },
    }
}

fn of_sensor(sensor: &SensorComparison) -> Markup {
    let lines = meaning(sensor);
    html! {
        h2 { "Drift of the " (words(sensor.sensor)) }
        div class="figures" { (drift(sensor)) }
        p class="note" { "Limit of chance: " (rounded(sensor.limit, 1)) " standard errors, for all parameters together." }
        div class="wide" { table {
            thead { tr { th { "parameter" } th { "first" } th { "second" } th { "std error" } th { "drift in std errors" } th {} } }
            tbody {
                @for parameter in &sensor.parameters {
                    tr {
                        td { (parameter.name) } td { (plain(parameter.a)) } td { (plain(parameter.b)) }
                        td { (format!("{:.1e}", parameter.std_error)) } td { (format!("{:+.1}", parameter.z)) }
                        td { @if parameter.moved { "moved" } }
                    }
                }
            }
        } }
        ul { @for line in lines.lines() { li { (line.trim()) } } }
    }
}

//! How far each parameter has moved, in standard errors.

use maud::{Markup, html};

use super::{
    dot_rows::{DotRow, dot_rows},
    figure,
    scale::Scale,
};
use crate::compare::{Moved, SensorComparison};

/// The drawing, with the limits of chance.
#[must_use]
pub fn drift(sensor: &SensorComparison) -> Markup {
    let limit = sensor.limit;
    let row = |parameter: &Moved| DotRow {
        name: parameter.name.clone(),
        from: 0.0,
        dots: vec![(if parameter.moved { "before" } else { "after" }, parameter.z)],
    };
    let rows: Vec<DotRow> = sensor.parameters.iter().map(row).collect();
    let reached = sensor.parameters.iter().map(|parameter| parameter.z).chain([-1.1 * limit, 1.1 * limit]);
    let drawing = dot_rows(
        &Scale::linear(reached),
        &rows,
        &[("limit", -limit), ("limit", limit)],
        "drift in standard errors",
        "drift of each parameter in standard errors",
    );
    let keys = html! { span class="key before" { "moved" } span class="key after" { "within chance" } };
    figure("Drift of each parameter", &drawing, &keys)
}

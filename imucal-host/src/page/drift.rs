//! How far each parameter has moved, in standard errors.

use maud::{Markup, html};

use super::{
    figure,
    plot::{WIDTH, short},
    scale::Scale,
};
use crate::compare::SensorComparison;

const ROW: f64 = 18.0;
const LEFT: f64 = 66.0;
const RIGHT: f64 = 14.0;

/// The drawing, with the limits of chance.
#[must_use]
pub fn drift(sensor: &SensorComparison) -> Markup {
    let limit = sensor.limit;
    let all = sensor.parameters.iter().map(|parameter| parameter.z).chain([-1.1 * limit, 1.1 * limit]);
    let scale = Scale::linear(all);
    let x = |z: f64| LEFT + scale.share(z).unwrap_or(0.0).clamp(0.0, 1.0) * (WIDTH - LEFT - RIGHT);
    let bottom = ROW * sensor.parameters.len() as f64 + 6.0;
    let drawing = html! {
        svg viewBox={ "0 0 " (WIDTH) " " (bottom + 34.0) } role="img" aria-label="drift of each parameter in standard errors" {
            @for tick in scale.ticks() {
                @let x = LEFT + tick.at * (WIDTH - LEFT - RIGHT);
                path class="grid" d={ "M" (short(x)) " 2V" (bottom) } {}
                text x=(short(x)) y=(bottom + 13.0) text-anchor="middle" { (tick.label) }
            }
            @for end in [-limit, limit] { path class="limit" d={ "M" (short(x(end))) " 2V" (bottom) } {} }
            @for (at, parameter) in sensor.parameters.iter().enumerate() {
                @let y = ROW * at as f64 + 12.0;
                text class="name" x="2" y=(y + 3.5) { (parameter.name) }
                path class="grid" d={ "M" (short(x(0.0))) " " (y) "H" (short(x(parameter.z))) } {}
                circle class=(if parameter.moved { "before" } else { "after" }) cx=(short(x(parameter.z))) cy=(y) r="3.4" {}
            }
            text class="name" x=(WIDTH - RIGHT) y=(bottom + 30.0) text-anchor="end" { "drift in standard errors" }
        }
    };
    let keys = html! { span class="key before" { "moved" } span class="key after" { "within chance" } };
    figure("Drift of each parameter", &drawing, &keys)
}

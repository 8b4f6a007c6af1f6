//! The gap of each channel: before, after, and the noise's share of it.

use maud::{Markup, html};

use super::{
    figure,
    plot::{WIDTH, short},
    scale::Scale,
};
use crate::diagnosis::finding::Gap;

const ROW: f64 = 18.0;
const LEFT: f64 = 78.0;
const RIGHT: f64 = 14.0;

/// The drawing, in units of each channel's noise.
#[must_use]
pub fn channels(gap: &[Gap]) -> Markup {
    let ratio = |value: f64, channel: &Gap| value / channel.noise_floor;
    let known: Vec<&Gap> =
        gap.iter().filter(|channel| channel.noise_floor > 0.0 && channel.rms_before.is_finite()).collect();
    if known.is_empty() {
        return html! {};
    }
    let all = known
        .iter()
        .flat_map(|channel| [ratio(channel.rms_before, channel), ratio(channel.rms_after, channel), 1.0]);
    let scale = Scale::logarithmic(all);
    let x = |value: f64| scale.share(value).map(|share| LEFT + share * (WIDTH - LEFT - RIGHT));
    let bottom = ROW * known.len() as f64 + 6.0;
    let drawing = html! {
        svg viewBox={ "0 0 " (WIDTH) " " (bottom + 34.0) } role="img" aria-label="gap of each channel before and after, over its noise" {
            @for tick in scale.ticks() {
                @let x = LEFT + tick.at * (WIDTH - LEFT - RIGHT);
                path class="grid" d={ "M" (short(x)) " 2V" (bottom) } {}
                text x=(short(x)) y=(bottom + 13.0) text-anchor="middle" { (tick.label) }
            }
            @if let Some(one) = x(1.0) { path class="floor line" d={ "M" (short(one)) " 2V" (bottom) } {} }
            @for (at, channel) in known.iter().enumerate() {
                @let y = ROW * at as f64 + 12.0;
                text class="name" x="2" y=(y + 3.5) { (channel.sensor) " " (channel.axis) }
                @if let (Some(before), Some(after)) = (x(ratio(channel.rms_before, channel)), x(ratio(channel.rms_after, channel))) {
                    path class="grid" d={ "M" (short(after)) " " (y) "H" (short(before)) } {}
                    circle class="before" cx=(short(before)) cy=(y) r="3.4" {}
                    circle class="after" cx=(short(after)) cy=(y) r="3.4" {}
                }
            }
            text class="name" x=(WIDTH - RIGHT) y=(bottom + 30.0) text-anchor="end" { "rms of means over blocks, over the noise's" }
        }
    };
    let keys = html! { span class="key before" { "before" } span class="key after" { "after" } span class="key floor" { "noise" } };
    figure("The gap of each channel", &drawing, &keys)
}

//! The gap of each channel: before, after, and the noise's share of it.

use maud::{Markup, html};

use super::{
    dot_rows::{DotRow, dot_rows},
    figure,
    scale::Scale,
};
use crate::diagnosis::finding::Gap;

/// The drawing, in units of each channel's noise.
#[must_use]
pub fn channels(gap: &[Gap]) -> Markup {
    let row = |channel: &Gap| {
        let [before, after] = [channel.rms_before, channel.rms_after].map(|rms| rms / channel.noise_floor);
        DotRow {
            name: format!("{} {}", channel.sensor, channel.axis),
            from: before,
            dots: vec![("before", before), ("after", after)],
        }
    };
    let is_known = |channel: &&Gap| channel.noise_floor > 0.0 && channel.rms_before.is_finite();
    let rows: Vec<DotRow> = gap.iter().filter(is_known).map(row).collect();
    if rows.is_empty() {
        return html! {};
    }
    let all = rows.iter().flat_map(|row| row.dots.iter().map(|(_, ratio)| *ratio)).chain([1.0]);
    let drawing = dot_rows(
        &Scale::logarithmic(all),
        &rows,
        &[("floor line", 1.0)],
        "rms of means over blocks, over the noise's",
        "gap of each channel before and after, over its noise",
    );
    let keys = html! {
        span class="key before" { "before" } span class="key after" { "after" } span class="key floor" { "noise" }
    };
    figure("The gap of each channel", &drawing, &keys)
}

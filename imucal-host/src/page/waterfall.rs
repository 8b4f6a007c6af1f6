//! From the gap to what is left of it, cause by cause.

use maud::{Markup, html};

use super::{
    figure,
    plot::{WIDTH, short},
};
use crate::diagnosis::{Diagnosis, finding::Cause};

/// Height of a row: its label, and the bar below it.
const ROW: f64 = 34.0;
const LEFT: f64 = 4.0;
const SPAN: f64 = WIDTH - 2.0 * LEFT;

/// A bar from one share of the gap to another.
struct Bar {
    label: String,
    class: &'static str,
    from: f64,
    to: f64,
}

/// The drawing; nothing where no cause closes a share that is known.
#[must_use]
pub fn waterfall(diagnosis: &Diagnosis) -> Markup {
    let Some(total) = diagnosis.gap_closed_total.filter(|share| share.is_finite()) else { return html! {} };
    let closing: Vec<(&Cause, f64)> = diagnosis
        .causes
        .iter()
        .filter_map(|cause| Some((cause, cause.gap_closed.filter(|share| share.is_finite())?)))
        .collect();
    if closing.is_empty() {
        return html! {};
    }
    let bars = bars(&closing, total);
    let height = ROW * bars.len() as f64 + 4.0;
    let x = |share: f64| LEFT + share.clamp(0.0, 1.0) * SPAN;
    let drawing = html! {
        svg viewBox={ "0 0 " (WIDTH) " " (height) } role="img" aria-label="shares of the gap that each cause closes" {
            @for (at, bar) in bars.iter().enumerate() {
                @let top = ROW * at as f64;
                text class="name" x=(LEFT) y=(top + 12.0) { (bar.label) }
                path class="grid" d={ "M" (LEFT) " " (top + 22.5) "h" (SPAN) } {}
                rect class={ "bar " (bar.class) } x=(short(x(bar.to))) y=(top + 17.0)
                    width=(short((x(bar.from) - x(bar.to)).max(1.0))) height="11" {}
            }
        }
    };
    figure(
        "From the gap to the noise",
        &drawing,
        &html! { "Shares of the gap beyond the noise" @if diagnosis.held_out { ", on data that the fit has not seen" } ". The left end is the noise alone." },
    )
}

fn bars(closing: &[(&Cause, f64)], total: f64) -> Vec<Bar> {
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let mut bars =
        vec![Bar { label: "gap beyond the noise: 100 %".into(), class: "before", from: 1.0, to: 0.0 }];
    let mut left = 1.0;
    for (cause, share) in closing {
        let next = (left - share).max(0.0);
        let label = format!("{} closes {}", cause.effect, percent(*share));
        bars.push(Bar { label, class: "after", from: left, to: next });
        left = next;
    }
    // Causes that overlap close less together than one by one.
    let label = format!("left: {}", percent((1.0 - total).max(0.0)));
    bars.push(Bar { label, class: "floor", from: (1.0 - total).max(0.0), to: 0.0 });
    bars
}

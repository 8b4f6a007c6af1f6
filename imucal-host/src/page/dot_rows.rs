//! Named rows of dots along one scale.

use maud::{Markup, html};

use super::{
    plot::{WIDTH, short},
    scale::Scale,
};

/// Height of a row.
const ROW: f64 = 18.0;
/// Where rows begin, behind their names, and what stays free behind them.
const LEFT: f64 = 78.0;
const RIGHT: f64 = 14.0;

/// A row: its name, where its line begins, and its dots with their classes; the line ends at the last dot.
pub struct DotRow {
    /// Text before it.
    pub name: String,
    /// Value at which its line begins.
    pub from: f64,
    /// Class and value of each dot.
    pub dots: Vec<(&'static str, f64)>,
}

/// The drawing; `lines` are upright, with their classes, and `name` is the scale's.
#[must_use]
pub fn dot_rows(scale: &Scale, rows: &[DotRow], lines: &[(&str, f64)], name: &str, label: &str) -> Markup {
    let along = |share: f64| LEFT + share * (WIDTH - LEFT - RIGHT);
    let x = |value: f64| scale.share(value).map(|share| along(share.clamp(0.0, 1.0)));
    let bottom = ROW * rows.len() as f64 + 6.0;
    html! {
        svg viewBox={ "0 0 " (WIDTH) " " (bottom + 34.0) } role="img" aria-label=(label) {
            @for tick in scale.ticks() {
                path class="grid" d={ "M" (short(along(tick.at))) " 2V" (bottom) } {}
                text x=(short(along(tick.at))) y=(bottom + 13.0) text-anchor="middle" { (tick.label) }
            }
            @for (class, value) in lines {
                @if let Some(at) = x(*value) { path class=(class) d={ "M" (short(at)) " 2V" (bottom) } {} }
            }
            @for (at, row) in rows.iter().enumerate() {
                @let y = ROW * at as f64 + 12.0;
                text class="name" x="2" y=(y + 3.5) { (row.name) }
                @if let (Some(from), Some(to)) = (x(row.from), row.dots.last().and_then(|(_, value)| x(*value))) {
                    path class="grid" d={ "M" (short(from)) " " (y) "H" (short(to)) } {}
                }
                @for (class, value) in &row.dots {
                    @if let Some(cx) = x(*value) { circle class=(class) cx=(short(cx)) cy=(y) r="3.4" {} }
                }
            }
            text class="name" x=(WIDTH - RIGHT) y=(bottom + 30.0) text-anchor="end" { (name) }
        }
    }
}

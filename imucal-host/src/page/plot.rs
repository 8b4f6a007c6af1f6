//! A frame with two axes and marks in it.

use std::fmt::Write;

use maud::{Markup, html};

use super::scale::Scale;

/// Width of a drawing, its own units: a column on a telephone.
pub const WIDTH: f64 = 340.0;
/// Height of a frame's drawing.
const HEIGHT: f64 = 214.0;
const LEFT: f64 = 46.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 20.0;
const BOTTOM: f64 = 36.0;
/// A line has at most so many points; of more, the ends of each stretch are drawn.
const POINTS: usize = 500;

/// A frame: its axes, what they are, and the marks drawn so far.
pub struct Plot {
    x: Scale,
    y: Scale,
    names: [String; 2],
    marks: Vec<Markup>,
}

impl Plot {
    /// An empty frame; a unit may be empty.
    #[must_use]
    pub fn new(x: Scale, y: Scale, [x_name, y_name]: [(&str, &str); 2]) -> Self {
        let titled =
            |scale: &Scale, (name, unit): (&str, &str)| match format!("{}{unit}", scale.factor()).trim() {
                "" => name.to_owned(),
                unit => format!("{name}, {unit}"),
            };
        let names = [titled(&x, x_name), titled(&y, y_name)];
        Self { x, y, names, marks: Vec::new() }
    }

    fn across(&self, x: f64) -> Option<f64> {
        Some(LEFT + self.x.share(x)?.clamp(0.0, 1.0) * (WIDTH - LEFT - RIGHT))
    }

    fn down(&self, y: f64) -> Option<f64> {
        Some(HEIGHT - BOTTOM - self.y.share(y)?.clamp(0.0, 1.0) * (HEIGHT - TOP - BOTTOM))
    }

    /// A dot, with a whisker between two values of y where there is an interval.
    pub fn dot(&mut self, class: &str, x: f64, y: f64, interval: Option<[f64; 2]>) {
        let (Some(cx), Some(cy)) = (self.across(x), self.down(y)) else { return };
        let ends = interval.and_then(|[low, high]| Some((self.down(low)?, self.down(high)?)));
        self.marks.push(html! {
            @if let Some((low, high)) = ends {
                path class={ "whisker " (class) } d={ "M" (short(cx)) " " (short(low)) "V" (short(high)) } {}
            }
            circle class=(class) cx=(short(cx)) cy=(short(cy)) r="2.2" {}
        });
    }

    /// A line through points in their order; it is broken where one has no place.
    pub fn line(&mut self, class: &str, points: &[(f64, f64)]) {
        let mut path = String::new();
        let mut broken = true;
        for (x, y) in thinned(points) {
            match (self.across(x), self.down(y)) {
                (Some(x), Some(y)) => {
                    let _ = write!(path, "{}{} {}", if broken { 'M' } else { 'L' }, short(x), short(y));
                    broken = false;
                }
                _ => broken = true,
            }
        }
        self.marks.push(html! { path class={ "line " (class) } d=(path) {} });
    }

    /// What lies between two lines over the same x.
    pub fn band(&mut self, class: &str, points: &[(f64, [f64; 2])]) {
        let place = |x: f64, y: f64| Some(format!("{} {}", short(self.across(x)?), short(self.down(y)?)));
        let lower = points.iter().filter_map(|(x, [low, _])| place(*x, *low));
        let upper = points.iter().rev().filter_map(|(x, [_, high])| place(*x, *high));
        let corners: Vec<String> = lower.chain(upper).collect();
        if corners.len() > 2 {
            let path = format!("M{}Z", corners.join("L"));
            self.marks.push(html! { path class={ "band " (class) } d=(path) {} });
        }
    }

    /// Upright stretches from one x to another.
    pub fn stretches(&mut self, class: &str, spans: impl Iterator<Item = (f64, f64)>) {
        let mut path = String::new();
        for (from, to) in spans {
            let (Some(from), Some(to)) = (self.across(from), self.across(to)) else { continue };
            let (top, bottom) = (short(TOP), short(HEIGHT - BOTTOM));
            let _ = write!(path, "M{} {top}V{bottom}H{}V{top}Z", short(from), short((from + 0.5).max(to)));
        }
        self.marks.push(html! { path class=(class) d=(path) {} });
    }

    /// A level line.
    pub fn level(&mut self, class: &str, y: f64) {
        let Some(y) = self.down(y) else { return };
        let path = format!("M{} {}H{}", short(LEFT), short(y), short(WIDTH - RIGHT));
        self.marks.push(html! { path class=(class) d=(path) {} });
    }

    /// The drawing; `label` describes it to who cannot see it.
    #[must_use]
    pub fn draw(&self, label: &str) -> Markup {
        let (bottom, end) = (HEIGHT - BOTTOM, WIDTH - RIGHT);
        html! {
            svg viewBox={ "0 0 " (WIDTH) " " (HEIGHT) } role="img" aria-label=(label) {
                @for tick in self.x.ticks() {
                    @let x = LEFT + tick.at * (end - LEFT);
                    path class="grid" d={ "M" (short(x)) " " (TOP) "V" (bottom) } {}
                    text x=(short(x)) y=(bottom + 13.0) text-anchor="middle" { (tick.label) }
                }
                @for tick in self.y.ticks() {
                    @let y = bottom - tick.at * (bottom - TOP);
                    path class="grid" d={ "M" (LEFT) " " (short(y)) "H" (end) } {}
                    text x=(LEFT - 4.0) y=(short(y + 3.5)) text-anchor="end" { (tick.label) }
                }
                @for mark in &self.marks { (mark) }
                path class="frame" d={ "M" (LEFT) " " (TOP) "V" (bottom) "H" (end) } {}
                text class="name" x="2" y="11" { (self.names[1]) }
                text class="name" x=(end) y=(HEIGHT - 6.0) text-anchor="end" { (self.names[0]) }
            }
        }
    }
}

/// A coordinate, to a tenth.
pub fn short(value: f64) -> String {
    let text = format!("{value:.1}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}

/// Points by which a line looks as by all: of each stretch the least and the largest, in their order.
pub(super) fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() <= POINTS {
        return points.to_vec();
    }
    let stretch = points.len().div_ceil(POINTS / 2);
    let ends = |part: &[(f64, f64)]| {
        let by_y = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let (low, high) = (part.iter().min_by(by_y).copied(), part.iter().max_by(by_y).copied());
        let mut both: Vec<(f64, f64)> = low.into_iter().chain(high).collect();
        both.sort_by(|a, b| a.0.total_cmp(&b.0));
        both
    };
    points.chunks(stretch).flat_map(ends).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_line_keeps_its_peaks() {
        let mut points: Vec<(f64, f64)> = (0..100_000).map(|k| (f64::from(k), 0.0)).collect();
        points[77_777].1 = 9.0;
        let thin = thinned(&points);
        assert!(thin.len() <= POINTS && thin.iter().any(|(x, y)| *x == 77_777.0 && *y == 9.0));
    }

    #[test]
    fn what_has_no_place_is_not_drawn() {
        let mut plot =
            Plot::new(Scale::logarithmic([1.0, 10.0]), Scale::between(0.0, 1.0), [("a", ""), ("b", "s")]);
        plot.dot("x", f64::NAN, 0.5, None);
        plot.dot("x", -1.0, 0.5, None);
        assert!(plot.marks.is_empty());
        plot.dot("x", 2.0, 0.5, None);
        let drawn = plot.draw("what").into_string();
        assert!(drawn.contains("<circle") && drawn.contains("b, s") && !drawn.contains("NaN"), "{drawn}");
    }
}

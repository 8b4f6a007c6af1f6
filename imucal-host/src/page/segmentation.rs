//! Rests and motions of a recording over time.

use maud::{Markup, html};

use super::{figure, plot::Plot, scale::Scale};
use crate::{calibrate::SegmentationReport, recording::Recording};

/// The drawing: the gyroscope's rate, or the length of the specific force, and the rests behind it.
#[must_use]
pub fn segmentation(recording: &Recording, found: &SegmentationReport) -> Markup {
    let (values, name, unit): (Vec<f64>, _, _) = match (&recording.gyr, &recording.acc) {
        (Some(gyr), _) => (gyr.values.iter().map(|rate| rate.norm().to_degrees()).collect(), "rate", "°/s"),
        (None, Some(acc)) => {
            (acc.values.iter().map(|force| force.norm()).collect(), "specific force", "m/s²")
        }
        (None, None) => return html! {},
    };
    let time = &recording.time;
    let points: Vec<(f64, f64)> =
        time.iter().copied().zip(values.iter().copied()).filter(|(_, value)| value.is_finite()).collect();
    let mut plot = Plot::new(
        Scale::between(time.first().copied().unwrap_or(0.0), time.last().copied().unwrap_or(1.0)),
        Scale::linear(points.iter().map(|(_, value)| *value).chain([0.0])),
        [("time", "s"), (name, unit)],
    );
    let at = |row: usize| time.get(row).copied();
    let spans = found.rests.iter().filter_map(|rows| Some((at(rows.start)?, at(rows.end.checked_sub(1)?)?)));
    plot.stretches("rest", spans);
    plot.line("ink", &points);
    let count = found.rests.len();
    figure(
        "Rests and motions",
        &plot.draw(&format!("{name} over time, with {count} rests")),
        &html! { (count) " rests, shaded; nominal values before calibration." },
    )
}

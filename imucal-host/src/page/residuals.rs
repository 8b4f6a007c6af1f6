//! The residual of each observation over time.

use maud::{Markup, html};

use super::{
    figure,
    plot::{Plot, thinned},
    scale::Scale,
};
use crate::calibrate::residuals::ObservationResidual;

/// The drawing, with what the residual is and in which unit; `scale` takes SI to that unit. Nothing without residuals.
#[must_use]
pub fn residuals(
    observations: &[ObservationResidual],
    what: &str,
    unit: &str,
    scale: f64,
    rms: f64,
) -> Markup {
    let points: Vec<(f64, f64)> = observations
        .iter()
        .filter_map(|one| Some((one.at, scale * one.residual?)))
        .filter(|(at, _)| at.is_finite())
        .collect();
    if points.is_empty() {
        return html! {};
    }
    let is_signed = points.iter().any(|(_, residual)| *residual < 0.0);
    let rms = scale * rms;
    let reached =
        points.iter().map(|(_, residual)| *residual).chain([rms, if is_signed { -rms } else { 0.0 }]);
    let mut plot = Plot::new(
        Scale::linear(points.iter().map(|(at, _)| *at)),
        Scale::linear(reached),
        [("time", "s"), (what, unit)],
    );
    plot.level("floor line", rms);
    if is_signed {
        plot.level("grid", 0.0);
        plot.level("floor line", -rms);
    }
    let shown = thinned(&points);
    for (at, residual) in &shown {
        plot.dot("x", *at, *residual, None);
    }
    let thinned = points.len() > shown.len();
    let caption = html! {
        "One dot an observation; grey lines at the rms."
        @if thinned { " Of " (points.len()) " observations the extremes of each stretch are drawn." }
    };
    figure("Residual of each observation", &plot.draw(&format!("{what} over time")), &caption)
}

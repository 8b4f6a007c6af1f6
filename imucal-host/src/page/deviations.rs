//! Allan deviations over the averaging time.

use maud::{Markup, html};

use super::{axis_keys, figure, plot::Plot, scale::Scale};
use crate::store::noise_file::NoiseOfSensor;

/// The drawing of a sensor's axes, with the 95 % intervals of each deviation.
#[must_use]
pub fn deviations(sensor: &NoiseOfSensor, name: &str) -> Markup {
    let points = || sensor.known_axes().flat_map(|axis| &axis.allan);
    if points().next().is_none() {
        return html! {};
    }
    let mut plot = Plot::new(
        Scale::logarithmic(points().map(|point| point.time)),
        Scale::logarithmic(
            points().flat_map(|point| [point.deviation, point.interval[0], point.interval[1]]),
        ),
        [("averaging time", "s"), ("Allan deviation", &sensor.unit)],
    );
    for (class, axis) in ["x", "y", "z"].into_iter().zip(&sensor.axes) {
        let Some(axis) = axis else { continue };
        let band: Vec<(f64, [f64; 2])> =
            axis.allan.iter().map(|point| (point.time, point.interval)).collect();
        plot.band(class, &band);
        let line: Vec<(f64, f64)> = axis.allan.iter().map(|point| (point.time, point.deviation)).collect();
        plot.line(class, &line);
    }
    figure(
        &format!("Allan deviation of the {name}"),
        &plot.draw(&format!("overlapping Allan deviation of the {name}, axis by axis")),
        &html! { "Overlapping; shaded are 95 % intervals." (axis_keys()) },
    )
}

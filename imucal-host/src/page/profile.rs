//! The residual over the driver that it follows most, before and after the causes are added.

use maud::{Markup, html};

use super::{figure, plot::Plot, scale::Scale};
use crate::diagnosis::finding::Profile;

/// The drawing.
#[must_use]
pub fn profile(profile: &Profile) -> Markup {
    let bins = &profile.bins;
    let whisker = |value: f64, std: f64| [value - 2.0 * std, value + 2.0 * std];
    let reached = bins
        .iter()
        .flat_map(|bin| [bin.before, bin.after].into_iter().flat_map(|value| whisker(value, bin.std)));
    let name = format!("{} ({})", profile.driver, profile.function);
    let mut plot = Plot::new(
        Scale::linear(bins.iter().map(|bin| bin.driver)),
        Scale::linear(reached),
        [(&name, ""), (&format!("residual of {} {}", profile.sensor, profile.axis), &profile.unit)],
    );
    plot.level("grid", 0.0);
    for bin in bins {
        plot.dot("before", bin.driver, bin.before, Some(whisker(bin.before, bin.std)));
        plot.dot("after", bin.driver, bin.after, Some(whisker(bin.after, bin.std)));
    }
    figure(
        &format!("What the {} follows", profile.sensor),
        &plot.draw(&format!("residual of {} over {name}", profile.sensor)),
        &html! {
            "Means over blocks, k = 2; the driver in its own standard deviations."
            span class="key before" { "before" } span class="key after" { "after the causes are added" }
        },
    )
}

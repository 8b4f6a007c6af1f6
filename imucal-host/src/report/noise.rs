//! The noise of a unit, for people.

use super::{measure::plain, prose::hanging, table::words};
use crate::{
    recording::SensorKind,
    store::noise_file::{Figure, NoiseFile, NoiseOfAxis, NoiseOfSensor},
};

/// Tables of each sensor's coefficients, and what is not known.
pub fn noise(file: &NoiseFile) -> String {
    let mut text = format!("{}: {} s\n", file.recording, plain(file.duration));
    for kind in SensorKind::ALL {
        let Some(sensor) = file.sensor(kind) else { continue };
        text.push('\n');
        match &sensor.detail {
            Some(detail) => text.push_str(&hanging(&format!("{}: refused: ", words(kind)), detail)),
            None => text.push_str(&of_sensor(kind, sensor)),
        }
    }
    text
}

fn of_sensor(kind: SensorKind, sensor: &NoiseOfSensor) -> String {
    let rate = sensor.rate.unwrap_or(f64::NAN);
    let mut text =
        format!("{}: {} samples at {} Hz, {}\n", words(kind), sensor.samples, plain(rate), sensor.unit);
    let row = |name: &str, of: &dyn Fn(&NoiseOfAxis) -> String| {
        let mut row = format!("  {name:<18}");
        for axis in &sensor.axes {
            row += &format!(" {:>17}", axis.as_ref().map_or_else(|| String::from("–"), of));
        }
        row + "\n"
    };
    text += &format!("  {:<18} {:>17} {:>17} {:>17}\n", "", "x", "y", "z");
    for (name, of) in FIGURES {
        text += &row(name, &|axis| cell(of(axis)));
    }
    text += &row("least deviation", &|axis| plain(axis.least_deviation));
    text += &row("  at, s", &|axis| plain(axis.least_at));
    if let Some(axis) = sensor.known_axes().next() {
        let unit = |(name, of): &Row| format!("{} {}", name.split(' ').next().unwrap_or(name), of(axis).unit);
        let units: Vec<String> = FIGURES.iter().map(unit).collect();
        text.push_str(&hanging("  units: ", &units.join("; ")));
    }
    for (name, why) in reasons(sensor) {
        text.push_str(&hanging(&format!("  no {name}: "), &why));
    }
    text
}

/// A coefficient's name and where an axis has it.
pub(crate) type Row = (&'static str, fn(&NoiseOfAxis) -> &Figure);

/// The coefficients, in the order in which they are shown.
pub(crate) const FIGURES: [Row; 6] = [
    ("N white", |axis| &axis.white),
    ("B bias instability", |axis| &axis.bias_instability),
    ("K random walk", |axis| &axis.random_walk),
    ("Q quantisation", |axis| &axis.quantisation),
    ("T correlation time", |axis| &axis.correlation_time),
    ("Gauss–Markov bias", |axis| &axis.bias_std),
];

/// A value with its interval, or the most that it may be.
fn cell(figure: &Figure) -> String {
    match (figure.value, figure.interval, figure.at_most) {
        (Some(value), Some([low, high]), _) => interval(value, low, high),
        (_, _, Some(most)) => format!("< {most:.2e}"),
        _ => "–".into(),
    }
}

/// Three digits, and the interval's ends in percent of the value.
fn interval(value: f64, low: f64, high: f64) -> String {
    let share = |end: f64| {
        let percent = 100.0 * (end / value - 1.0);
        if percent.abs() < 9.5 { format!("{percent:+.1}") } else { format!("{percent:+.0}") }
    };
    format!("{value:.2e} {}{}%", share(high), share(low))
}

/// Why coefficients have no value, each reason once.
pub(crate) fn reasons(sensor: &NoiseOfSensor) -> Vec<(&'static str, String)> {
    let of_figure = |(name, of): Row| {
        let axes = ["x", "y", "z"].into_iter().zip(&sensor.axes);
        let mut said = axes.filter_map(|(axis, found)| {
            let reason = of(found.as_ref()?).reason.clone()?;
            Some(format!("{axis}: {reason}"))
        });
        let first = said.next()?;
        let more = if said.next().is_some() { "; other axes in the JSON" } else { "" };
        Some((name, format!("{first}{more}")))
    };
    FIGURES.into_iter().filter_map(of_figure).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_printed_in_percent_of_the_value() {
        assert_eq!(interval(1.0e-3, 0.99e-3, 1.012e-3), "1.00e-3 +1.2-1.0%");
        assert_eq!(interval(2.0e-5, 1.5e-5, 3.0e-5), "2.00e-5 +50-25%");
    }
}

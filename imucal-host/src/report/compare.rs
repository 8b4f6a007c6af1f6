//! Two calibrations of one unit, in a table and in words.

use super::{
    measure::{plain, rounded},
    table::words,
};
use crate::{
    compare::{Comparison, GainComparison, SensorComparison},
    recording::{SensorKind, unit::STANDARD_GRAVITY},
};

/// Why a sensor is not compared.
pub const OTHER_TERMS: &str = "one calibration has nonlinear terms, or terms of temperature, that the other has not, \
                               and gain and bias are fitted with them";
/// As well.
pub const WITHOUT_ERRORS: &str = "one calibration states no standard errors";

/// All sensors; ends its lines.
pub fn compared(comparison: &Comparison) -> String {
    let mut text = format!("{} days from the first to the second\n", comparison.days);
    for sensor in &comparison.sensors {
        text += &of_sensor(sensor);
    }
    for line in not_compared(comparison) {
        text += &format!("{line}\n");
    }
    text
}

/// A sentence for each sensor that is not compared.
pub fn not_compared(comparison: &Comparison) -> Vec<String> {
    let other_terms =
        comparison.other_terms.iter().map(|kind| format!("{}: not compared; {OTHER_TERMS}", words(*kind)));
    let only_one =
        comparison.only_one.iter().map(|kind| format!("{}: calibrated in one of them only", words(*kind)));
    let without_errors = comparison.without_errors.iter();
    let without_errors =
        without_errors.map(|kind| format!("{}: not compared; {WITHOUT_ERRORS}", words(*kind)));
    other_terms.chain(without_errors).chain(only_one).collect()
}

fn of_sensor(sensor: &SensorComparison) -> String {
    let moved: Vec<&str> =
        sensor.parameters.iter().filter(|parameter| parameter.moved).map(|p| p.name.as_str()).collect();
    let verdict = if moved.is_empty() {
        "no parameter has moved beyond chance".to_owned()
    } else {
        format!("moved beyond chance: {}", moved.join(", "))
    };
    let mut text =
        format!("{}: {verdict} (limit {} standard errors)\n", words(sensor.sensor), rounded(sensor.limit, 1));
    text += "                     first        second   std error   drift in std errors\n";
    for parameter in &sensor.parameters {
        text += &format!(
            "  {:<11} {:>12} {:>13} {:>11} {:>12}{}\n",
            parameter.name,
            plain(parameter.a),
            plain(parameter.b),
            format!("{:.1e}", parameter.std_error),
            format!("{:+.1}", parameter.z),
            if parameter.moved { "  moved" } else { "" }
        );
    }
    text + &meaning(sensor)
}

/// What the first calibration makes of what the second has right.
pub(crate) fn meaning(sensor: &SensorComparison) -> String {
    let three =
        |values: [f64; 3], decimals: usize| values.map(|value| format!("{value:+.decimals$}")).join(", ");
    let error = sensor.bias_error;
    let si = sensor.unit.per_known_si();
    let (bias, unit, decimals) = match (sensor.sensor, si) {
        (SensorKind::Acc, Some(si)) => {
            (error.map(|value| 1e3 * value / si / STANDARD_GRAVITY), "mg".into(), 3)
        }
        (SensorKind::Gyr, Some(si)) => (error.map(|value| (value / si).to_degrees()), "°/s".into(), 4),
        (SensorKind::Mag, Some(si)) => (error.map(|value| value / si), "µT".into(), 3),
        (_, None) => (error, sensor.unit.to_string(), 6),
    };
    let mut text = format!(
        "  With the first calibration, where the second is right:\n    bias off by     {} {unit}\n",
        three(bias, decimals)
    );
    let Some(GainComparison { scale_error, rotation, skew }) = sensor.gain else {
        return text + "    gains           not compared: they are in other axes, or of another field\n";
    };
    let degrees = |angles: [f64; 3]| three(angles.map(f64::to_degrees), 4);
    text += &format!(
        "    scale off by    {} %\n    axes turned by  {}°\n    angles off by   {}° (yz, zx, xy)\n",
        three(scale_error.map(|share| 100.0 * share), 4),
        degrees(rotation),
        degrees(skew)
    );
    text
}

//! Terms of a calibration beyond gain and bias, for people: of temperature, and nonlinear ones.

use std::fmt::{self, Write};

use super::measure::{measure, plain};
use crate::{
    recording::Unit,
    store::{StoredNonlinearity, StoredTemperature},
};

const AXES: [&str; 3] = ["x", "y", "z"];

/// How bias and scale follow the temperature. An entry that was held is not written.
pub fn write_temperature(text: &mut String, terms: &StoredTemperature, unit: Unit) -> fmt::Result {
    write!(text, "  temperature: gain and bias hold at {:.1} °C", terms.reference)?;
    match terms.quality {
        Some(quality) => writeln!(text, "; from {:.1} to {:.1} °C", quality.span[0], quality.span[1])?,
        None => writeln!(text, "; the span and the errors of the terms are not known")?,
    }
    let span = terms.quality.map(|quality| quality.span[1] - quality.span[0]);
    for axis in 0..3 {
        let bent = |of: [f64; 3], std: [f64; 3]| (of[axis], std[axis]);
        let bias = Term {
            slope: (terms.bias_slope[axis], terms.quality.map(|q| q.bias_slope_std[axis])),
            bent: terms.curvature.map(|c| bent(c.bias, c.bias_std)),
            of: "bias",
            share: 1.0,
            unit: &unit.to_string(),
            per: &unit.to_string(),
        };
        bias.write(text, AXES[axis], span)?;
        let scale = Term {
            slope: (terms.scale_slope[axis], terms.quality.map(|q| q.scale_slope_std[axis])),
            bent: terms.curvature.map(|c| bent(c.scale, c.scale_std)),
            of: "scale",
            share: 100.0,
            unit: "%",
            per: "1",
        };
        scale.write(text, AXES[axis], span)?;
    }
    Ok(())
}

/// One axis' bias or scale: slope and, where there is one, the second order, each with its standard error.
struct Term<'a> {
    slope: (f64, Option<f64>),
    bent: Option<(f64, f64)>,
    of: &'a str,
    /// From the term's unit to the one that its move is written in.
    share: f64,
    unit: &'a str,
    per: &'a str,
}

impl Term<'_> {
    fn write(&self, text: &mut String, axis: &str, span: Option<f64>) -> fmt::Result {
        let (slope, std) = self.slope;
        let (of, unit, per) = (self.of, self.unit, self.per);
        if std.map_or(slope == 0.0, |std| std <= 0.0) {
            return Ok(());
        }
        let measured = measure(slope, std.unwrap_or(0.0));
        match span {
            Some(span) => {
                let moved = plain((self.share * slope * span).abs());
                write!(
                    text,
                    "    {of} of {axis} moves {moved} {unit} over {span:.0} K ({measured} {per}/K)"
                )?;
            }
            None => write!(text, "    {of} of {axis} moves by {measured} {per}/K")?,
        }
        if let Some((value, std)) = self.bent.filter(|(_, std)| *std > 0.0) {
            write!(text, ", and {} {per}/K²", measure(value, std))?;
        }
        writeln!(text)
    }
}

/// Quadratic, cubic and cross terms, in the unit of raw values. A term that was held is not written.
pub fn write_nonlinearity(text: &mut String, found: &StoredNonlinearity, unit: Unit) -> fmt::Result {
    writeln!(
        text,
        "  nonlinear terms up to {} {unit} from the bias; beyond, they stay as there",
        plain(found.range)
    )?;
    let kinds = [
        ("quadratic", found.quadratic, found.quadratic_std, format!("1/{unit}")),
        ("cubic", found.cubic, found.cubic_std, format!("1/{unit}²")),
    ];
    for (name, value, std, per) in kinds {
        let each = (0..3).filter(|axis| value[*axis] != 0.0 || std[*axis] > 0.0);
        let parts: Vec<String> =
            each.map(|axis| format!("{} {}", AXES[axis], measure(value[axis], std[axis]))).collect();
        if !parts.is_empty() {
            writeln!(text, "    {name} [{per}]: {}", parts.join(", "))?;
        }
    }
    let mut products = Vec::new();
    for (axis, (value, std)) in found.cross.iter().zip(&found.cross_std).enumerate() {
        for (column, product) in ["xy", "yz", "zx"].into_iter().enumerate() {
            if value[column] != 0.0 || std[column] > 0.0 {
                products.push(format!("{product} in {} {}", AXES[axis], measure(value[column], std[column])));
            }
        }
    }
    if !products.is_empty() {
        writeln!(text, "    products of axes [1/{unit}]: {}", products.join(", "))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::StoredTemperatureQuality;

    fn temperature(quality: Option<StoredTemperatureQuality>) -> StoredTemperature {
        StoredTemperature {
            reference: 25.0,
            bias_slope: [0.5, 0.0, 0.0],
            scale_slope: [0.0, 1e-4, 0.0],
            quality,
            curvature: None,
        }
    }

    fn text(write: impl Fn(&mut String) -> fmt::Result) -> String {
        let mut text = String::new();
        write(&mut text).expect("writing to a string");
        text
    }

    #[test]
    fn terms_of_a_record_without_their_errors_are_written_without_a_span() {
        let written = text(|text| write_temperature(text, &temperature(None), Unit::Counts));
        assert!(written.contains("are not known"), "{written}");
        assert!(written.contains("bias of x moves by 0.5") && written.contains("scale of y"), "{written}");
        assert!(!written.contains("bias of y") && !written.contains("scale of x"), "{written}");
    }

    #[test]
    fn a_move_over_the_span_is_in_the_unit_that_stands_behind_it() {
        let quality = StoredTemperatureQuality {
            span: [10.0, 50.0],
            bias_slope_std: [0.1, 0.0, 0.0],
            scale_slope_std: [0.0, 1e-5, 0.0],
        };
        let written = text(|text| write_temperature(text, &temperature(Some(quality)), Unit::Counts));
        assert!(
            written.contains("bias of x moves 20.0") && written.contains("counts over 40 K"),
            "{written}"
        );
        assert!(written.contains("scale of y moves 0.4") && written.contains(" % over 40 K"), "{written}");
    }

    #[test]
    fn only_nonlinear_terms_that_there_are_are_written() {
        let none = [0.0; 3];
        let found = StoredNonlinearity {
            range: 6000.0,
            quadratic: none,
            cubic: [0.0, 2e-12, 0.0],
            cross: [none, none, [3e-8, 0.0, 0.0]],
            quadratic_std: none,
            cubic_std: [0.0, 1e-13, 0.0],
            cross_std: [none, none, [1e-9, 0.0, 0.0]],
        };
        let written = text(|text| write_nonlinearity(text, &found, Unit::Counts));
        assert!(written.contains("cubic [1/counts²]: y (2.00 ± 0.10)e-12"), "{written}");
        assert!(written.contains("xy in z") && !written.contains("quadratic"), "{written}");
    }
}

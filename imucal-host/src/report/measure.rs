//! A value with its standard error, in the digits that the error leaves; in words where there is no value.

/// Stands for a figure that is no number.
const NOT_KNOWN: &str = "not known";

/// `value ± std`, with two digits of the error; without an error, the value alone.
pub fn measure(value: f64, std: f64) -> String {
    if value.is_nan() {
        return NOT_KNOWN.into();
    }
    if !std.is_finite() {
        return format!("{} ± ∞", plain(value));
    }
    if std <= 0.0 {
        return plain(value);
    }
    let place = std.log10().floor() as i32 - 1;
    if (-6..=0).contains(&place) {
        let digits = usize::try_from(-place).unwrap_or(0);
        return format!("{value:.digits$} ± {std:.digits$}");
    }
    let exponent = value.abs().max(std).log10().floor() as i32;
    let digits = usize::try_from(exponent - place).unwrap_or(0);
    let scale = 10f64.powi(exponent);
    if exponent == 0 {
        return format!("{value:.digits$} ± {std:.digits$}");
    }
    format!("({:.digits$} ± {:.digits$})e{exponent}", value / scale, std / scale)
}

/// A value without an error, in four digits.
pub fn plain(value: f64) -> String {
    if value.is_nan() {
        return NOT_KNOWN.into();
    }
    if value == 0.0 {
        return "0".into();
    }
    let exponent = value.abs().log10().floor() as i32;
    if (-3..=5).contains(&exponent) {
        let digits = usize::try_from(3 - exponent).unwrap_or(0);
        format!("{value:.digits$}")
    } else {
        format!("{value:.3e}")
    }
}

/// An angle (rad) in degrees, with so many decimals.
pub fn degrees(angle: f64, decimals: usize) -> String {
    if angle.is_nan() { NOT_KNOWN.into() } else { format!("{:.decimals$}°", angle.to_degrees()) }
}

/// An angle and its standard error (rad) in degrees.
pub fn measured_degrees(angle: f64, std: f64) -> String {
    if angle.is_nan() {
        return NOT_KNOWN.into();
    }
    format!("{}°", measure(angle.to_degrees(), std.to_degrees()))
}

/// So many things, whose plural ends in s.
pub fn counted(count: impl Into<u64>, what: &str) -> String {
    match count.into() {
        1 => format!("1 {what}"),
        count => format!("{count} {what}s"),
    }
}

/// A value with so many decimals.
pub fn rounded(value: f64, decimals: usize) -> String {
    if value.is_nan() { NOT_KNOWN.into() } else { format!("{value:.decimals$}") }
}

/// A share in whole percent.
pub fn percent(share: f64) -> String {
    if share.is_nan() { NOT_KNOWN.into() } else { format!("{:.0} %", 100.0 * share) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_decides_the_digits() {
        assert_eq!(measure(33_123.838_4, 0.238), "33123.84 ± 0.24");
        assert_eq!(measure(0.002_413_05, 1.5e-7), "(2.41305 ± 0.00015)e-3");
        assert_eq!(measure(0.0, 0.0), "0");
        assert_eq!(measure(1.25, f64::INFINITY), "1.250 ± ∞");
        assert_eq!(measure(123_456.0, 2_300.0), "(1.235 ± 0.023)e5");
    }

    #[test]
    fn what_is_no_number_is_said_in_words() {
        let nan = f64::NAN;
        for text in [
            plain(nan),
            measure(nan, 1.0),
            measure(nan, nan),
            degrees(nan, 2),
            measured_degrees(nan, nan),
            rounded(nan, 1),
            percent(nan),
        ] {
            assert_eq!(text, "not known");
        }
        assert_eq!(measured_degrees(0.5, nan), "28.65 ± ∞°");
        assert_eq!(
            (degrees(0.5, 2), rounded(17.31, 1), percent(0.5)),
            ("28.65°".into(), "17.3".into(), "50 %".into())
        );
    }
}

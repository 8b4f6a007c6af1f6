//! Numbers of a text field.

/// Why a field is not a number that a recording may hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NotANumber {
    /// Not a number at all.
    Unparsable,
    /// `inf`, or so large that it becomes it.
    Infinite,
}

/// Reads a field; empty and `NaN` give NaN, "not measured". Blanks around it do not count.
///
/// Short decimals, which recordings consist of, take a path without the general parser: mantissa and
/// power of ten are exact in f64 there, so that the one division rounds as the general parser does.
pub(crate) fn parse(field: &[u8]) -> Result<f64, NotANumber> {
    match short_decimal(field) {
        Some(value) => Ok(value),
        None => general(field.trim_ascii()),
    }
}

const POWERS: [f64; 16] =
    [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];

fn short_decimal(field: &[u8]) -> Option<f64> {
    let (negative, digits) = match field.split_first()? {
        (b'-', rest) => (true, rest),
        _ => (false, field),
    };
    // Up to 15 digits stay below 2^53.
    if digits.is_empty() || digits.len() > 16 {
        return None;
    }
    let mut mantissa: u64 = 0;
    let mut point = None;
    for (i, byte) in digits.iter().enumerate() {
        match byte {
            b'0'..=b'9' => mantissa = mantissa * 10 + u64::from(byte - b'0'),
            b'.' if point.is_none() => point = Some(i),
            _ => return None,
        }
    }
    let decimals = point.map_or(0, |i| digits.len() - 1 - i);
    let count = digits.len() - usize::from(point.is_some());
    if count == 0 || count > 15 {
        return None;
    }
    let value = mantissa as f64 / POWERS[decimals];
    Some(if negative { -value } else { value })
}

fn general(field: &[u8]) -> Result<f64, NotANumber> {
    if field.is_empty() {
        return Ok(f64::NAN);
    }
    let text = std::str::from_utf8(field).map_err(|_| NotANumber::Unparsable)?;
    let value: f64 = text.parse().map_err(|_| NotANumber::Unparsable)?;
    if value.is_infinite() { Err(NotANumber::Infinite) } else { Ok(value) }
}

/// The shortest text that reads back as `value`; NaN is the empty field.
pub(crate) fn print(value: f64, out: &mut String) {
    use std::fmt::Write;
    let size = value.abs();
    if value.is_nan() {
        return;
    }
    // Writing to a String does not fail.
    let _ = if size != 0.0 && !(1e-5..1e16).contains(&size) {
        write!(out, "{value:e}")
    } else {
        write!(out, "{value}")
    };
}

/// `value` to so many significant decimal digits, which takes the rounding of a unit conversion away.
pub(crate) fn round_to_digits(value: f64, digits: usize) -> f64 {
    if !value.is_finite() {
        return value;
    }
    format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn empty_and_nan_mean_not_measured() {
        for field in ["", "  ", "NaN", "nan", " NaN "] {
            assert!(parse(field.as_bytes()).unwrap().is_nan(), "{field:?}");
        }
    }

    #[test]
    fn odd_but_valid_spellings_are_numbers() {
        for (field, value) in [("+1.5", 1.5), (" 2 ", 2.0), ("1e-3", 1e-3), (".5", 0.5), ("5.", 5.0)] {
            assert_eq!(parse(field.as_bytes()), Ok(value), "{field:?}");
        }
        assert!(parse(b"-0").unwrap().is_sign_negative());
    }

    #[test]
    fn text_is_no_number_and_infinity_is_refused() {
        for field in ["-", ".", "1.2.3", "1,5", "abc", "1e", "--1", "\u{b5}"] {
            assert_eq!(parse(field.as_bytes()), Err(NotANumber::Unparsable), "{field:?}");
        }
        for field in ["inf", "-inf", "Infinity", "1e999"] {
            assert_eq!(parse(field.as_bytes()), Err(NotANumber::Infinite), "{field:?}");
        }
    }

    #[test]
    fn rounding_restores_integers_and_leaves_nan() {
        assert_eq!(round_to_digits(33_108.000_000_000_004, 14), 33_108.0);
        assert!(round_to_digits(f64::NAN, 14).is_nan());
    }

    proptest! {
        #[test]
        fn the_short_way_rounds_as_the_general_parser(mantissa in -999_999_999_999_999i64..999_999_999_999_999, decimals in 0usize..15) {
            let text = format!("{:.*}", decimals, mantissa as f64 / 10f64.powi(decimals as i32));
            prop_assert_eq!(parse(text.as_bytes()), Ok(text.parse::<f64>().unwrap()));
        }

        #[test]
        fn what_is_printed_reads_back_the_same(value in proptest::num::f64::NORMAL | proptest::num::f64::ZERO) {
            let mut text = String::new();
            print(value, &mut text);
            prop_assert_eq!(parse(text.as_bytes()), Ok(value));
        }
    }
}

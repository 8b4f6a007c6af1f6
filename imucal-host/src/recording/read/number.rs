//! Numbers of a text field.

use std::{fmt::LowerExp, io::Write, ops::Range};

/// Why a field is not a number that a recording may hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NotANumber {
    /// Not a number at all.
    Unparsable,
    /// `inf`, or so large that it becomes it.
    Infinite,
}

/// Reads a field; empty and `NaN` give NaN, "not measured". Blanks around it do not count.
pub(crate) fn parse(field: &[u8]) -> Result<f64, NotANumber> {
    match leading(field).filter(|(_, length)| *length == field.len()) {
        Some((value, _)) => Ok(value),
        None => general(field.trim_ascii()),
    }
}

/// The finite number that a text begins with, and its length.
pub(crate) fn leading(text: &[u8]) -> Option<(f64, usize)> {
    fast_float2::parse_partial(text).ok().filter(|(value, _): &(f64, usize)| value.is_finite())
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
pub(crate) fn print(value: f64, out: &mut Vec<u8>) {
    print_shortest(value, value, out);
}

/// The shortest text that reads back as `value` when it is rounded to an `f32`; NaN is the empty field.
pub(crate) fn print_single(value: f32, out: &mut Vec<u8>) {
    print_shortest(value, value.into(), out);
}

/// Sizes that need no power of ten.
const PLAIN: Range<f64> = 1e-3..1e9;

/// `size` is the same value.
fn print_shortest(value: impl zmij::Float + LowerExp, size: f64, out: &mut Vec<u8>) {
    if size.is_nan() {
        return;
    }
    let mut buffer = zmij::Buffer::new();
    let text = buffer.format(value).as_bytes();
    match text {
        // Writing to memory does not fail.
        _ if !PLAIN.contains(&size.abs()) && text.contains(&b'e') => drop(write!(out, "{value:e}")),
        [whole @ .., b'.', b'0'] => out.extend_from_slice(whole),
        text => out.extend_from_slice(text),
    }
}

/// `value` to so many significant decimal digits, which takes the rounding of a unit conversion away.
pub(crate) fn round_to_digits(value: f64, digits: usize) -> f64 {
    if !value.is_finite() || value == 0.0 {
        return value;
    }
    round_by_one_product(value, digits)
        .unwrap_or_else(|| format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value))
}

/// The powers of ten that an `f64` holds exactly.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];
/// Below it an `f64` has halves.
const HALVES: f64 = 4_503_599_627_370_496.0;

/// The same, where one product shows the digits: the power of ten is exact, and the product is not near the middle between
/// two integers, so that its own rounding does not matter.
fn round_by_one_product(value: f64, digits: usize) -> Option<f64> {
    let (least, most) = (POWERS.get(digits.checked_sub(1)?)?, POWERS.get(digits)?);
    let size = value.abs();
    let decimals = (digits as i32 - 1).checked_sub(size.log10().floor() as i32)?;
    let power = POWERS.get(usize::try_from(decimals).ok()?)?;
    let product = size * power;
    let whole = product.round();
    let is_clear = (product - whole).abs() < 0.375 && (*least..most.min(HALVES)).contains(&whole);
    is_clear.then(|| (whole / power).copysign(value))
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
    fn numbers_are_printed_without_what_they_do_not_need() {
        let text = |value: f64| {
            let mut text = Vec::new();
            print(value, &mut text);
            String::from_utf8(text).unwrap()
        };
        for (value, expected) in [
            (33_108.0, "33108"),
            (-0.0, "-0"),
            (1e15, "1000000000000000"),
            (1e16, "1e16"),
            (1e-5, "0.00001"),
            (-1.25e-6, "-1.25e-6"),
            (f64::NAN, ""),
        ] {
            assert_eq!(text(value), expected);
        }
        let mut single = Vec::new();
        print_single(0.1, &mut single);
        assert_eq!(single, b"0.1");
    }

    #[test]
    fn rounding_restores_integers_and_leaves_nan() {
        assert_eq!(round_to_digits(33_108.000_000_000_004, 14), 33_108.0);
        assert!(round_to_digits(f64::NAN, 14).is_nan());
    }

    proptest! {
        #[test]
        fn numbers_are_rounded_as_the_standard_library_rounds_them(
            mantissa in proptest::num::i64::ANY, decimals in 0usize..20, power in -320i32..300, exponent in proptest::bool::ANY,
        ) {
            let digits = format!("{:020}", mantissa.unsigned_abs());
            let (whole, part) = digits.split_at(20 - decimals);
            let sign = if mantissa < 0 { "-" } else { "" };
            let power = if exponent { format!("e{power}") } else { String::new() };
            let text = format!("{sign}{whole}.{part}{power}");
            let expected: f64 = text.parse().unwrap();
            prop_assume!(expected.is_finite());
            prop_assert_eq!(parse(text.as_bytes()).map(f64::to_bits), Ok(expected.to_bits()));
            let (read, length) = leading(format!("{text},1").as_bytes()).unwrap();
            prop_assert_eq!((read.to_bits(), length), (expected.to_bits(), text.len()));
        }

        #[test]
        fn what_is_printed_reads_back_the_same(value in proptest::num::f64::NORMAL | proptest::num::f64::ZERO) {
            let mut text = Vec::new();
            print(value, &mut text);
            prop_assert_eq!(parse(&text), Ok(value));
        }

        #[test]
        fn what_is_printed_of_a_single_is_the_same_when_it_is_rounded_to_one(value in proptest::num::f32::NORMAL | proptest::num::f32::ZERO) {
            let mut text = Vec::new();
            print_single(value, &mut text);
            prop_assert_eq!(parse(&text).map(|read| read as f32), Ok(value));
            prop_assert!(text.len() <= value.to_string().len() + 4);
        }

        #[test]
        fn rounding_by_one_product_is_that_of_the_printed_digits(mantissa in -2e15..2e15f64, power in -12i32..12, digits in 1usize..17) {
            let value = mantissa / 10f64.powi(12 + power);
            let printed: f64 = format!("{value:.*e}", digits - 1).parse().unwrap();
            prop_assert_eq!(round_to_digits(value, digits), printed);
        }
    }
}

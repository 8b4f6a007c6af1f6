//! Where on an absolute clock a recording begins.

use super::unit::TimeUnit;

/// Decimals of a second that an epoch keeps.
const DECIMALS: u32 = 12;

/// A time of an absolute clock, most often of the one that began in 1970, exact to a picosecond: nanoseconds since 1970
/// are beyond the digits of an `f64`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Epoch {
    picoseconds: i128,
}

impl Epoch {
    /// The time so many picoseconds after the clock's zero.
    #[must_use]
    pub fn of_picoseconds(picoseconds: i128) -> Self {
        Self { picoseconds }
    }

    /// Picoseconds after the clock's zero.
    #[must_use]
    pub fn picoseconds(self) -> i128 {
        self.picoseconds
    }

    /// Seconds from an earlier time of the same clock to this one, rounded once.
    #[must_use]
    pub fn since(self, earlier: Self) -> f64 {
        let Some(mut count) = self.picoseconds.checked_sub(earlier.picoseconds) else {
            return self.picoseconds as f64 / 1e12 - earlier.picoseconds as f64 / 1e12;
        };
        let mut decimals = DECIMALS;
        while decimals > 0 && count % 1000 == 0 {
            (count, decimals) = (count / 1000, decimals - 3);
        }
        if count.unsigned_abs() < 1 << f64::MANTISSA_DIGITS {
            return count as f64 / 10f64.powi(decimals as i32);
        }
        // Longer than a double's digits: the general parser rounds once.
        format!("{count}e-{decimals}").parse().unwrap_or(f64::NAN)
    }

    /// The time `seconds` later, by the fewest decimals that are this number; `None` beyond what can be counted.
    #[must_use]
    pub fn later(self, seconds: f64) -> Option<Self> {
        let picoseconds =
            self.picoseconds.checked_add(Self::of_number(seconds, TimeUnit::Second)?.picoseconds)?;
        Some(Self { picoseconds })
    }

    /// A time in `unit`, by the fewest decimals that are this number; `None` if it is not finite or cannot be counted.
    pub(crate) fn of_number(value: f64, unit: TimeUnit) -> Option<Self> {
        // A double is printed without an exponent.
        if value.is_finite() { Self::of_text(&value.to_string(), unit) } else { None }
    }

    /// A decimal number in `unit`, without an exponent; decimals beyond the picosecond are rounded.
    pub(crate) fn of_text(text: &str, unit: TimeUnit) -> Option<Self> {
        let (negative, digits) = match text.as_bytes().split_first()? {
            (b'-', _) => (true, &text[1..]),
            (b'+', _) => (false, &text[1..]),
            _ => (false, text),
        };
        let (whole, part) = digits.split_once('.').unwrap_or((digits, ""));
        let all_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
        if whole.len() + part.len() == 0 || !all_digits(whole) || !all_digits(part) {
            return None;
        }
        let whole: i128 = if whole.is_empty() { 0 } else { whole.parse().ok()? };
        let decimals = decimals(unit) as usize;
        let kept = &part[..part.len().min(decimals)];
        let kept: i128 = format!("{kept:0<decimals$}").parse().ok()?;
        let up = part.as_bytes().get(decimals).is_some_and(|next| *next >= b'5');
        let picoseconds = whole.checked_mul(per(unit))?.checked_add(kept + i128::from(up))?;
        Some(Self { picoseconds: if negative { -picoseconds } else { picoseconds } })
    }

    /// The time as a decimal number in `unit`.
    pub(crate) fn text(self, unit: TimeUnit) -> String {
        let sign = if self.picoseconds < 0 { "-" } else { "" };
        let (count, per, decimals) =
            (self.picoseconds.unsigned_abs(), per(unit).unsigned_abs(), decimals(unit));
        let text = format!("{sign}{}.{:02$}", count / per, count % per, decimals as usize);
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    }

    /// The time in `unit`, if it is whole there.
    #[cfg(feature = "parquet")]
    pub(crate) fn whole(self, unit: TimeUnit) -> Option<i64> {
        let whole = self.picoseconds % per(unit) == 0;
        if whole { i64::try_from(self.picoseconds / per(unit)).ok() } else { None }
    }
}

/// Decimals of a unit that are a picosecond.
fn decimals(unit: TimeUnit) -> u32 {
    match unit {
        TimeUnit::Second => DECIMALS,
        TimeUnit::Millisecond => DECIMALS - 3,
        TimeUnit::Microsecond => DECIMALS - 6,
        TimeUnit::Nanosecond => DECIMALS - 9,
    }
}

/// Picoseconds of a unit.
fn per(unit: TimeUnit) -> i128 {
    10i128.pow(decimals(unit))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_time_reads_back_what_it_prints_in_each_unit() {
        for (text, unit) in [
            ("1700000000.123456", TimeUnit::Second),
            ("1700000000123.456", TimeUnit::Millisecond),
            ("1700000000123456", TimeUnit::Microsecond),
            ("1700000000123456789", TimeUnit::Nanosecond),
            ("-1700000000.5", TimeUnit::Second),
            ("0", TimeUnit::Second),
        ] {
            assert_eq!(Epoch::of_text(text, unit).unwrap().text(unit), text);
        }
        let epoch = Epoch::of_text("1700000000.123456", TimeUnit::Second).unwrap();
        assert_eq!(epoch.text(TimeUnit::Nanosecond), "1700000000123456000");
        assert_eq!(epoch.picoseconds(), 1_700_000_000_123_456_000_000);
    }

    #[test]
    fn decimals_below_the_picosecond_are_rounded_and_other_text_is_no_time() {
        let of = |text: &str| Epoch::of_text(text, TimeUnit::Nanosecond).map(Epoch::picoseconds);
        assert_eq!(
            [of("1.2345"), of("-1.2345"), of("+.5"), of("7.")],
            [Some(1235), Some(-1235), Some(500), Some(7000)]
        );
        for text in ["", "-", ".", "1e9", "1_0", "+-1", "1.2.3", "x"] {
            assert_eq!(of(text), None, "{text}");
        }
        assert_eq!(of(&"9".repeat(60)), None);
        assert_eq!(Epoch::of_number(f64::MAX, TimeUnit::Second), None);
    }

    proptest! {
        #[test]
        fn what_is_later_by_some_seconds_is_since_by_the_same(start in i64::MIN..i64::MAX, step in 0i64..10i64.pow(17)) {
            let epoch = Epoch::of_picoseconds(i128::from(start) * 1000);
            let then = Epoch::of_picoseconds((i128::from(start) + i128::from(step)) * 1000);
            let seconds = then.since(epoch);
            prop_assert_eq!(seconds, format!("{step}e-9").parse::<f64>().unwrap());
            prop_assert_eq!(epoch.later(seconds).unwrap().since(epoch), seconds);
        }
    }
}

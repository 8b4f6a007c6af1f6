//! The day of a calibration.

use core::fmt;

use serde::{Deserialize, Serialize};

/// A day of the Gregorian calendar, UTC, from 1970-01-01 on: the number of days since.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Date(u32);

impl Date {
    /// `days` after 1970-01-01.
    pub const fn from_days(days: u32) -> Self {
        Self(days)
    }

    /// The day on which `seconds` since 1970-01-01T00:00:00Z fall. Beyond the year 11 million it stays there.
    pub const fn from_unix(seconds: u64) -> Self {
        let days = seconds / 86_400;
        Self(if days > u32::MAX as u64 { u32::MAX } else { days as u32 })
    }

    /// Days since 1970-01-01.
    pub const fn days(self) -> u32 {
        self.0
    }

    /// Year, month 1 to 12, and day 1 to 31.
    ///
    /// Howard Hinnant's `civil_from_days`: years are counted from March, so that the leap day is a year's last.
    pub const fn ymd(self) -> (u32, u8, u8) {
        const DAYS_FROM_0000_03_01: u64 = 719_468;
        let days = self.0 as u64 + DAYS_FROM_0000_03_01;
        let (era, of_era) = (days / 146_097, days % 146_097);
        let year_of_era = (of_era - of_era / 1_460 + of_era / 36_524 - of_era / 146_096) / 365;
        let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
        let from_march = (5 * of_year + 2) / 153;
        let day = of_year - (153 * from_march + 2) / 5 + 1;
        let (month, later) = if from_march < 10 { (from_march + 3, 0) } else { (from_march - 9, 1) };
        ((era * 400 + year_of_era + later) as u32, month as u8, day as u8)
    }
}

/// ISO 8601: `2024-02-29`.
impl fmt::Display for Date {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (year, month, day) = self.ymd();
        write!(f, "{year:04}-{month:02}-{day:02}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn days_are_written_as_the_calendar_has_them() {
        for (days, text) in [
            (0, "1970-01-01"),
            (59, "1970-03-01"),
            (11_016, "2000-02-29"),
            (11_017, "2000-03-01"),
            (19_782, "2024-02-29"),
            (20_088, "2024-12-31"),
            (47_541, "2100-03-01"),
        ] {
            assert_eq!(Date::from_days(days).to_string(), text);
        }
        assert_eq!(Date::from_unix(86_399), Date::from_days(0));
        assert_eq!(Date::from_unix(u64::MAX).days(), u32::MAX);
        assert_eq!(Date::from_days(u32::MAX).ymd().0, 11_761_191);
    }
}

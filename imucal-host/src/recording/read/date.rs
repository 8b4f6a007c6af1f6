//! Times that a file has as dates, such as `2026-05-01T12:00:00.125Z`, or as hours of a day.
//!
//! | form | instant |
//! | --- | --- |
//! | date, `T` or a blank, hour, and `Z` or `+02:00` | as it says |
//! | the same without an offset | as if it were UTC: only differences matter |
//! | `12:00:00.125` | of one day; after midnight time runs back, which is refused |
//!
//! Dates are those of ISO 8601, also with slashes for hyphens. Others, as 05/01/2026, are not understood: they are ambiguous.

use jiff::{
    Timestamp,
    civil::{Date, DateTime, Time},
    tz::Offset,
};

use crate::recording::epoch::Epoch;

/// Picoseconds of a nanosecond.
const PICOSECONDS: i128 = 1000;

/// The instant of a field; `None` where it is no date and no hour.
pub(crate) fn parse(field: &[u8]) -> Option<Epoch> {
    let text = std::str::from_utf8(field.trim_ascii()).ok()?;
    // Shorter is none, and most fields are numbers.
    if text.len() < "0:00:00".len() || !text.contains(':') {
        return None;
    }
    let hyphened = text.as_bytes().get(4) == Some(&b'/');
    let replaced = hyphened.then(|| text.replacen('/', "-", 2));
    let text = replaced.as_deref().unwrap_or(text);
    let of_day = || Some(text.parse::<Time>().ok()?.to_datetime(Date::new(1970, 1, 1).ok()?));
    let without_offset = || text.parse::<DateTime>().ok().or_else(of_day);
    let instant = match text.parse::<Timestamp>() {
        Ok(instant) => instant,
        Err(_) => Offset::UTC.to_timestamp(without_offset()?).ok()?,
    };
    Some(Epoch::of_picoseconds(instant.as_nanosecond() * PICOSECONDS))
}

/// An instant as a date.
pub(crate) fn text(instant: Epoch) -> Option<String> {
    let nanoseconds = instant.picoseconds() / PICOSECONDS;
    Some(Timestamp::from_nanosecond(nanoseconds).ok()?.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nanoseconds(field: &str) -> Option<i128> {
        parse(field.as_bytes()).map(|instant| instant.picoseconds() / PICOSECONDS)
    }

    #[test]
    fn dates_with_and_without_an_offset_are_instants() {
        let noon = Some(1_777_636_800_125_000_000);
        for field in [
            "2026-05-01T12:00:00.125Z",
            " 2026-05-01 12:00:00.125 ",
            "2026-05-01T14:00:00.125+02:00",
            "2026/05/01 12:00:00.125",
            "2026-05-01T12:00:00.125",
        ] {
            assert_eq!(nanoseconds(field), noon, "{field}");
        }
        assert_eq!(
            text(parse(b"2026-05-01T14:00:00.125+02:00").unwrap()).unwrap(),
            "2026-05-01T12:00:00.125Z"
        );
    }

    #[test]
    fn hours_are_of_one_day() {
        assert_eq!(nanoseconds("00:00:01.000000001"), Some(1_000_000_001));
        assert_eq!(nanoseconds("23:59:59"), Some(86_399_000_000_000));
    }

    #[test]
    fn what_is_ambiguous_or_no_date_is_none() {
        for field in
            ["05/01/2026 12:00:00", "2026-13-01T00:00:00", "12:61:00", "1.5", "", "::::::::", "a:b:c:d"]
        {
            assert_eq!(parse(field.as_bytes()), None, "{field}");
        }
    }
}

//! The column `t`: times as the file counts them, or exact ones where they are of an absolute clock or dates.

use super::{
    date,
    number::{self, NotANumber},
};
use crate::recording::{epoch::Epoch, unit::TimeUnit};

/// A first time beyond this, s (eleven days), is one of an absolute clock, whose zero nobody saw.
const FAR: f64 = 1e6;

/// What the column `t` of a table counts: the file's unit, or seconds since an epoch, which is its first row's time.
#[derive(Clone, Debug)]
pub(crate) struct Clock {
    unit: TimeUnit,
    pub(crate) epoch: Option<Epoch>,
    started: bool,
    /// Times are dates, not numbers.
    dated: bool,
}

impl Clock {
    pub(crate) fn new(unit: TimeUnit) -> Self {
        Self { unit, epoch: None, started: false, dated: false }
    }

    /// A clock whose times were read already.
    pub(crate) fn of(unit: TimeUnit, epoch: Option<Epoch>) -> Self {
        Self { unit, epoch, started: true, dated: false }
    }

    /// How many of what the column counts make a second.
    pub(crate) fn per_si(&self) -> f64 {
        if self.epoch.is_some() { 1.0 } else { self.unit.per_si() }
    }

    /// Whether times are dates, which have no unit.
    pub(crate) fn is_dated(&self) -> bool {
        self.dated
    }

    /// Whether times are what the file counts, as numbers.
    pub(crate) fn is_plain(&self) -> bool {
        self.started && self.epoch.is_none()
    }

    /// A field of a text file, all of which are numbers or all dates; NaN if it is empty.
    pub(crate) fn take_text(&mut self, field: &[u8]) -> Result<f64, NotANumber> {
        let value = match number::parse(field) {
            Err(NotANumber::Unparsable) => return self.take_date(field),
            Ok(value) if self.dated && !value.is_nan() => return Err(NotANumber::Unparsable),
            value => value?,
        };
        Ok(self.take_parsed(value, field))
    }

    /// A number among numbers, and its text.
    pub(crate) fn take_parsed(&mut self, value: f64, field: &[u8]) -> f64 {
        let unit = self.unit;
        self.take(value, || {
            let text = std::str::from_utf8(field.trim_ascii()).ok()?;
            // With an exponent it has no more digits than a double.
            Epoch::of_text(text, unit).or_else(|| Epoch::of_number(value, unit))
        })
    }

    fn take_date(&mut self, field: &[u8]) -> Result<f64, NotANumber> {
        let instant = date::parse(field).ok_or(NotANumber::Unparsable)?;
        if !self.started {
            (self.started, self.dated, self.epoch) = (true, true, Some(instant));
        }
        let epoch = self.epoch.filter(|_| self.dated).ok_or(NotANumber::Unparsable)?;
        Ok(instant.since(epoch))
    }

    /// A double of a file; NaN stays NaN.
    pub(crate) fn take_number(&mut self, value: f64) -> f64 {
        let unit = self.unit;
        self.take(value, || Epoch::of_number(value, unit))
    }

    /// An integer of a file.
    pub(crate) fn take_integer(&mut self, value: i64) -> f64 {
        let unit = self.unit;
        self.take(value as f64, || Epoch::of_text(&value.to_string(), unit))
    }

    fn take(&mut self, value: f64, exact: impl Fn() -> Option<Epoch>) -> f64 {
        if value.is_nan() {
            return value;
        }
        if !self.started {
            self.started = true;
            self.epoch =
                Some(value).filter(|first| first.abs() / self.unit.per_si() > FAR).and_then(|_| exact());
        }
        match (self.epoch, exact) {
            (None, _) => value,
            (Some(epoch), exact) => exact().map_or_else(
                || value / self.unit.per_si() - epoch.since(Epoch::of_picoseconds(0)),
                |time| time.since(epoch),
            ),
        }
    }

    /// A time of the column as the file has it.
    pub(crate) fn text(&self, time: f64) -> String {
        let absolute = self.epoch.and_then(|epoch| epoch.later(time));
        if let Some(date) = absolute.filter(|_| self.dated).and_then(date::text) {
            return date;
        }
        absolute.map_or_else(|| time.to_string(), |absolute| absolute.text(self.unit))
    }

    /// A time of the column, if there is an epoch and the file's unit counts it without decimals.
    #[cfg(feature = "parquet")]
    pub(crate) fn whole(&self, time: f64) -> Option<i64> {
        self.epoch?.later(time)?.whole(self.unit)
    }

    /// A time of the column in the file's unit, as near as a double gets.
    #[cfg(feature = "parquet")]
    pub(crate) fn nearest(&self, time: f64) -> f64 {
        if self.epoch.is_some() { self.text(time).parse().unwrap_or(f64::NAN) } else { time }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(unit: TimeUnit, fields: &[&str]) -> (Vec<f64>, Option<Epoch>) {
        let mut clock = Clock::new(unit);
        let times = fields.iter().map(|field| clock.take_text(field.as_bytes()).unwrap()).collect();
        (times, clock.epoch)
    }

    #[test]
    fn times_of_a_clock_that_began_with_the_recording_stay_as_they_are() {
        for (unit, fields) in [
            (TimeUnit::Second, ["1000000", "1700000000"]),
            (TimeUnit::Nanosecond, ["-1e15", "1700000000000000000"]),
        ] {
            let (times, epoch) = taken(unit, &fields);
            assert_eq!((times, epoch), (fields.map(|field| field.parse().unwrap()).to_vec(), None));
        }
    }

    #[test]
    fn absolute_times_begin_at_zero_and_keep_every_digit() {
        for (unit, fields) in [
            (TimeUnit::Second, ["1700000000.123456", " 1700000000.133457", "1700000001.123456"]),
            (TimeUnit::Millisecond, ["1700000000123.456", "1700000000133.457 ", "1.700000001123456e12"]),
            (TimeUnit::Microsecond, ["1700000000123456", "1700000000133457", "+1700000001123456.0"]),
            (TimeUnit::Nanosecond, ["1700000000123456001", "1700000000133457001", "1700000001123456001"]),
        ] {
            let (times, epoch) = taken(unit, &fields);
            assert_eq!(times, [0.0, 0.010_001, 1.0], "{unit}");
            assert_eq!(epoch.unwrap().text(unit), fields[0]);
        }
    }

    #[test]
    fn dates_count_from_the_first_and_numbers_among_them_are_refused() {
        let mut clock = Clock::new(TimeUnit::Millisecond);
        let fields = ["2026-05-01T12:00:00.125Z", "", "2026-05-01T12:00:00.135Z", "2026-05-01T12:01:00.125Z"];
        let times: Vec<f64> = fields.iter().map(|field| clock.take_text(field.as_bytes()).unwrap()).collect();
        assert!(times[1].is_nan() && (times[0], times[2], times[3]) == (0.0, 0.01, 60.0), "{times:?}");
        assert_eq!(clock.text(0.01), fields[2]);
        assert_eq!(clock.take_text(b"12.5"), Err(NotANumber::Unparsable));
        let mut numbers = Clock::new(TimeUnit::Second);
        numbers.take_text(b"1").unwrap();
        assert_eq!(numbers.take_text(fields[0].as_bytes()), Err(NotANumber::Unparsable));
    }

    #[test]
    fn a_missing_time_is_none_and_one_beyond_counting_is_far_away() {
        let (times, epoch) = taken(TimeUnit::Second, &["2e6", "", "1e200"]);
        assert!(times[1].is_nan() && times[2] == 1e200 && epoch.is_some());
        assert_eq!(taken(TimeUnit::Second, &["1e200"]), (vec![1e200], None));
    }
}

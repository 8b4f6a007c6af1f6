//! Whose calibration it is: the wrong record on the right sensor is worse than none.

use core::fmt;

use heapless::String;
use serde::{Deserialize, Serialize};

use super::CalibrationRecord;

/// A unit, as far as it can name itself. Fields are made by `"MTx".parse()`; empty where unknown.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SensorIdentity {
    /// Make and model, for people; at most 32 bytes.
    pub name: String<32>,
    /// Serial number, which is what identifies the unit; at most 32 bytes.
    pub serial: String<32>,
}

/// What a record's identity says about the unit at hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub enum Match {
    /// The serials are the same.
    Confirmed,
    /// The record or the unit has no serial: usable, but worth a warning.
    Unknown,
}

/// The record was made for another unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WrongSensor<'a> {
    /// Serial in the record.
    pub recorded: &'a str,
    /// Serial of the unit at hand.
    pub connected: &'a str,
}

impl fmt::Display for WrongSensor<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the calibration was made for serial ")?;
        f.write_str(self.recorded)?;
        f.write_str(", but this sensor is ")?;
        f.write_str(self.connected)
    }
}

impl core::error::Error for WrongSensor<'_> {}

impl<O: Clone> CalibrationRecord<O> {
    /// Was the record, each of its triads, made for the unit with this serial? Names are not compared, for they are
    /// written in many ways.
    ///
    /// # Errors
    ///
    /// [`WrongSensor`] where both serials are known and differ. To apply the record nevertheless is the caller's
    /// decision; [`Match::Unknown`] asks him to warn.
    pub fn made_for<'a>(&'a self, connected: &'a str) -> Result<Match, WrongSensor<'a>> {
        let mut found = matched(&self.sensor.serial, connected)?;
        for (sensor, _) in self.triads() {
            if matched(self.serial_of(sensor), connected)? == Match::Unknown {
                found = Match::Unknown;
            }
        }
        Ok(found)
    }
}

fn matched<'a>(recorded: &'a str, connected: &'a str) -> Result<Match, WrongSensor<'a>> {
    match (recorded, connected) {
        ("", _) | (_, "") => Ok(Match::Unknown),
        _ if recorded == connected => Ok(Match::Confirmed),
        _ => Err(WrongSensor { recorded, connected }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Date;
    use std::string::ToString;

    fn of(serial: &str) -> CalibrationRecord {
        let sensor = SensorIdentity { name: "MTx".parse().unwrap(), serial: serial.parse().unwrap() };
        CalibrationRecord::empty(sensor, Date::from_days(0))
    }

    #[test]
    fn a_record_of_another_serial_is_refused_by_both_names() {
        let record = of("00300017");
        let refusal = record.made_for("00300018").unwrap_err().to_string();
        assert!(refusal.contains("00300017") && refusal.contains("00300018"), "{refusal}");
        assert_eq!(record.made_for("00300017"), Ok(Match::Confirmed));
    }

    #[test]
    fn without_a_serial_on_either_side_nothing_is_known() {
        assert_eq!(of("").made_for("00300017"), Ok(Match::Unknown));
        assert_eq!(of("00300017").made_for(""), Ok(Match::Unknown));
    }
}

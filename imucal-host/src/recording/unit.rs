//! Units of a recording's files, and the only place of conversion factors.

use std::{f64::consts::PI, fmt, str::FromStr};

use serde::{Deserialize, Deserializer, Serialize, de::Error as _};

use super::sensor_kind::SensorKind;

/// Standard gravity, m/s² (CGPM 1901, exact): what a file's `g` means.
pub const STANDARD_GRAVITY: f64 = 9.80665;

/// What other programs have fields in: µT in a tesla.
pub const MICROTESLA_PER_TESLA: f64 = 1e6;

/// Unit of a sensor's columns, spelt in the manifest as the contract spells it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Unit {
    /// `m/s^2`
    MetrePerSecondSquared,
    /// `g`, standard gravity
    Gravity,
    /// `mg`, a thousandth of standard gravity
    MilliGravity,
    /// `counts` of the converter; nominal conversion in `[counts]`
    Counts,
    /// `rad/s`
    RadianPerSecond,
    /// `deg/s`
    DegreePerSecond,
    /// `uT`
    MicroTesla,
    /// `mG`, milligauss
    MilliGauss,
    /// `G`, gauss
    Gauss,
    /// `nT`
    NanoTesla,
    /// `a.u.`, arbitrary: kept as it is, no µT are known
    Arbitrary,
}

/// Text that is no unit of the contract.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown unit `{found}`; expected {expected}; write it exactly so")]
pub struct UnknownUnit {
    /// The text found.
    pub found: String,
    /// The units there are, separated by commas.
    pub expected: String,
}

const NAMES: [(Unit, &str); 11] = [
    (Unit::MetrePerSecondSquared, "m/s^2"),
    (Unit::Gravity, "g"),
    (Unit::MilliGravity, "mg"),
    (Unit::Counts, "counts"),
    (Unit::RadianPerSecond, "rad/s"),
    (Unit::DegreePerSecond, "deg/s"),
    (Unit::MicroTesla, "uT"),
    (Unit::MilliGauss, "mG"),
    (Unit::Gauss, "G"),
    (Unit::NanoTesla, "nT"),
    (Unit::Arbitrary, "a.u."),
];

impl Unit {
    /// The units a sensor of this kind may be recorded in; the first is the default and the SI side.
    #[must_use]
    pub fn of(kind: SensorKind) -> &'static [Self] {
        match kind {
            SensorKind::Acc => {
                &[Self::MetrePerSecondSquared, Self::Gravity, Self::MilliGravity, Self::Counts]
            }
            SensorKind::Gyr => &[Self::RadianPerSecond, Self::DegreePerSecond, Self::Counts],
            SensorKind::Mag => &[
                Self::MicroTesla,
                Self::MilliGauss,
                Self::Gauss,
                Self::NanoTesla,
                Self::Counts,
                Self::Arbitrary,
            ],
        }
    }

    /// The SI side of a sensor: m/s², rad/s, µT.
    #[must_use]
    pub fn si(kind: SensorKind) -> Self {
        match kind {
            SensorKind::Acc => Self::MetrePerSecondSquared,
            SensorKind::Gyr => Self::RadianPerSecond,
            SensorKind::Mag => Self::MicroTesla,
        }
    }

    /// The units of [`Unit::of`] as a list for a message.
    #[must_use]
    pub fn list(kind: SensorKind) -> String {
        let names: Vec<String> = Self::of(kind).iter().map(ToString::to_string).collect();
        names.join(", ")
    }

    /// From a file's text; that of no sensor is answered with the accelerometer's units.
    pub(crate) fn deserialize_acc<'de, D: Deserializer<'de>>(text: D) -> Result<Self, D::Error> {
        Self::deserialize_of(SensorKind::Acc, text)
    }

    /// The same of a gyroscope.
    pub(crate) fn deserialize_gyr<'de, D: Deserializer<'de>>(text: D) -> Result<Self, D::Error> {
        Self::deserialize_of(SensorKind::Gyr, text)
    }

    /// The same of a magnetometer.
    pub(crate) fn deserialize_mag<'de, D: Deserializer<'de>>(text: D) -> Result<Self, D::Error> {
        Self::deserialize_of(SensorKind::Mag, text)
    }

    fn deserialize_of<'de, D: Deserializer<'de>>(kind: SensorKind, text: D) -> Result<Self, D::Error> {
        let of_sensor = |unknown| UnknownUnit { expected: Self::list(kind), ..unknown };
        String::deserialize(text)?.parse().map_err(|unknown| D::Error::custom(of_sensor(unknown)))
    }

    /// Unit of a fit's residuals, which are distances of raw values in nominal SI: that of calibrated values. Raw values in arbitrary units
    /// have no nominal SI.
    #[must_use]
    pub fn of_residuals(raw: Self, calibrated: Self) -> Self {
        if raw == Self::Arbitrary { raw } else { calibrated }
    }

    /// As [`Self::per_si`], and `None` for arbitrary units as well, which have no size of their own.
    #[must_use]
    pub fn per_known_si(self) -> Option<f64> {
        self.per_si().filter(|_| self != Self::Arbitrary)
    }

    /// How many of this unit make one of the SI side (m/s², rad/s, µT); `None` for counts, which only
    /// the manifest's `[counts]` can say. Arbitrary units count one for one.
    #[must_use]
    pub fn per_si(self) -> Option<f64> {
        Some(match self {
            Self::MetrePerSecondSquared | Self::RadianPerSecond | Self::MicroTesla | Self::Arbitrary => 1.0,
            Self::Gravity => 1.0 / STANDARD_GRAVITY,
            Self::MilliGravity => 1000.0 / STANDARD_GRAVITY,
            Self::DegreePerSecond => 180.0 / PI,
            Self::MilliGauss => 10.0,
            Self::Gauss => 0.01,
            Self::NanoTesla => 1000.0,
            Self::Counts => return None,
        })
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(name_of(&NAMES, *self))
    }
}

impl FromStr for Unit {
    type Err = UnknownUnit;

    fn from_str(text: &str) -> Result<Self, UnknownUnit> {
        unit_of(&NAMES, text)
    }
}

/// Unit of the column `t`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum TimeUnit {
    /// `s`
    Second,
    /// `ms`
    Millisecond,
    /// `us`
    Microsecond,
    /// `ns`
    Nanosecond,
}

const TIMES: [(TimeUnit, &str); 4] = [
    (TimeUnit::Second, "s"),
    (TimeUnit::Millisecond, "ms"),
    (TimeUnit::Microsecond, "us"),
    (TimeUnit::Nanosecond, "ns"),
];

impl TimeUnit {
    /// Every unit, the longest first.
    pub const ALL: [Self; 4] = [Self::Second, Self::Millisecond, Self::Microsecond, Self::Nanosecond];

    /// How many of this unit make a second.
    #[must_use]
    pub fn per_si(self) -> f64 {
        match self {
            Self::Second => 1.0,
            Self::Millisecond => 1e3,
            Self::Microsecond => 1e6,
            Self::Nanosecond => 1e9,
        }
    }
}

/// Unit of the gimbal's encoder angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum AngleUnit {
    /// `rad`
    Radian,
    /// `deg`
    Degree,
}

const ANGLES: [(AngleUnit, &str); 2] = [(AngleUnit::Radian, "rad"), (AngleUnit::Degree, "deg")];

impl AngleUnit {
    /// How many of this unit make a radian.
    #[must_use]
    pub fn per_si(self) -> f64 {
        match self {
            Self::Radian => 1.0,
            Self::Degree => 180.0 / PI,
        }
    }
}

/// Unit of the column `temp`; there is only one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum TemperatureUnit {
    /// `degC`
    Celsius,
}

const TEMPERATURES: [(TemperatureUnit, &str); 1] = [(TemperatureUnit::Celsius, "degC")];

fn name_of<U: PartialEq>(names: &[(U, &'static str)], unit: U) -> &'static str {
    names.iter().find(|(each, _)| *each == unit).map_or("", |(_, name)| name)
}

fn unit_of<U: Copy>(names: &[(U, &'static str)], text: &str) -> Result<U, UnknownUnit> {
    names.iter().find(|(_, name)| *name == text).map(|(unit, _)| *unit).ok_or_else(|| UnknownUnit {
        found: text.to_owned(),
        expected: names.iter().map(|(_, name)| *name).collect::<Vec<_>>().join(", "),
    })
}

macro_rules! spelt_as_text {
    ($($unit:ty, $names:ident);+) => {$(
        impl TryFrom<String> for $unit {
            type Error = UnknownUnit;

            fn try_from(text: String) -> Result<Self, UnknownUnit> {
                unit_of(&$names, &text)
            }
        }

        impl From<$unit> for String {
            fn from(unit: $unit) -> Self {
                name_of(&$names, unit).to_owned()
            }
        }
    )+};
}

spelt_as_text!(Unit, NAMES; TimeUnit, TIMES; AngleUnit, ANGLES; TemperatureUnit, TEMPERATURES);

impl fmt::Display for AngleUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(name_of(&ANGLES, *self))
    }
}

impl fmt::Display for TimeUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(name_of(&TIMES, *self))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::manifest::Units;

    #[test]
    fn every_unit_reads_back_what_it_prints() {
        for (unit, name) in NAMES {
            assert_eq!(unit.to_string(), name);
            assert_eq!(name.parse::<Unit>().unwrap(), unit);
        }
    }

    #[test]
    fn milligravity_and_milligauss_differ_by_case_alone() {
        assert_eq!("mg".parse::<Unit>().unwrap(), Unit::MilliGravity);
        assert_eq!("mG".parse::<Unit>().unwrap(), Unit::MilliGauss);
    }

    #[test]
    fn an_unknown_unit_names_itself_and_the_units_there_are() {
        let message = "m/s2".parse::<Unit>().unwrap_err().to_string();
        assert!(message.contains("`m/s2`") && message.contains("m/s^2, g, mg, counts"), "{message}");
    }

    #[test]
    fn an_unknown_unit_of_a_manifest_names_those_of_its_sensor() {
        let fault = |line: &str| toml::from_str::<Units>(line).unwrap_err().to_string();
        let message = fault("gyr = \"dps\"");
        assert!(message.contains("unknown unit `dps`; expected rad/s, deg/s, counts;"), "{message}");
        assert!(fault("mag = \"T\"").contains("expected uT, mG, G, nT, counts, a.u.;"));
        assert!(fault("acc = 1").contains("expected a string"));
    }

    #[test]
    fn known_quantities_convert() {
        let si = |unit: Unit, raw: f64| raw / unit.per_si().unwrap();
        assert!((si(Unit::Gravity, 1.0) - 9.80665).abs() < 1e-15);
        assert!((si(Unit::MilliGravity, 1000.0) - 9.80665).abs() < 1e-14);
        assert!((si(Unit::DegreePerSecond, 180.0) - PI).abs() < 1e-15);
        assert!((si(Unit::Gauss, 0.5) - 50.0).abs() < 1e-12);
        assert!((si(Unit::MilliGauss, 500.0) - 50.0).abs() < 1e-12);
        assert!((si(Unit::NanoTesla, 50_000.0) - 50.0).abs() < 1e-12);
        assert_eq!(Unit::Counts.per_si(), None);
    }
}

//! What is wrong with a manifest, and what a right one is.

use crate::recording::{sensor_kind::SensorKind, unit::Unit};

/// The format string of a manifest.
pub const FORMAT: &str = "imucal-recording/1";

/// A least manifest, for messages.
pub(crate) const MINIMAL: &str = "    format = \"imucal-recording/1\"
    [units]
    acc = \"m/s^2\"   # m/s^2 | g | mg | counts
    gyr = \"rad/s\"   # rad/s | deg/s | counts
    mag = \"uT\"      # uT | mG | G | nT | counts | a.u.";

/// A contradiction in a manifest; its text says what was found, what was expected and what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ManifestFault {
    /// A unit of another kind of sensor.
    #[error("found {sensor} = \"{unit}\" below [units], expected {}; write the unit the file is in", Unit::list(*.sensor))]
    UnitOfOtherSensor {
        /// The sensor.
        sensor: SensorKind,
        /// The unit found.
        unit: Unit,
    },
    /// Counts without their nominal conversion.
    #[error(
        "found {sensor} = \"counts\" and no conversion, expected `{sensor} = {{ offset = …, per_unit = … }}` below [counts]; add it from the data sheet: value = (raw − offset) / per_unit; without a manifest --unit says both, such as acc=16384/g or gyr=16.4/deg/s"
    )]
    CountsWithoutConversion {
        /// The sensor.
        sensor: SensorKind,
    },
    /// A number out of its range.
    #[error("found {section}.{key} = {found}, expected {expected}; correct it or leave it out")]
    BadNumber {
        /// Section of the manifest.
        section: &'static str,
        /// Key in the section.
        key: &'static str,
        /// The value found.
        found: f64,
        /// The values allowed.
        expected: &'static str,
    },
    /// A rig with more axes than gimbals.
    #[error(
        "found {found} axes below [rig], expected one to three, outermost first; correct it or leave it out"
    )]
    Axes {
        /// Axes found.
        found: usize,
    },
}

impl ManifestFault {
    /// Section and key the fault is about.
    #[must_use]
    pub fn key(&self) -> (&'static str, &'static str) {
        match self {
            Self::UnitOfOtherSensor { sensor, .. } | Self::CountsWithoutConversion { sensor } => {
                ("units", sensor.prefix())
            }
            Self::BadNumber { section, key, .. } => (section, key),
            Self::Axes { .. } => ("rig", "axes"),
        }
    }
}

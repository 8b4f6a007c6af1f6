//! The three kinds of sensor a recording may hold.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A triad of a recording: accelerometer, gyroscope or magnetometer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SensorKind {
    /// Accelerometer; specific force in m/s².
    Acc,
    /// Gyroscope; rate in rad/s.
    Gyr,
    /// Magnetometer; field in µT.
    Mag,
}

impl SensorKind {
    /// All kinds, in the order of the contract's table.
    pub const ALL: [Self; 3] = [Self::Acc, Self::Gyr, Self::Mag];

    /// The prefix of the sensor's columns and its key in the manifest: `acc`, `gyr` or `mag`.
    #[must_use]
    pub fn prefix(self) -> &'static str {
        match self {
            Self::Acc => "acc",
            Self::Gyr => "gyr",
            Self::Mag => "mag",
        }
    }

    /// The names of the sensor's three columns, x, y, z.
    #[must_use]
    pub fn columns(self) -> [&'static str; 3] {
        match self {
            Self::Acc => ["acc_x", "acc_y", "acc_z"],
            Self::Gyr => ["gyr_x", "gyr_y", "gyr_z"],
            Self::Mag => ["mag_x", "mag_y", "mag_z"],
        }
    }
}

impl fmt::Display for SensorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.prefix())
    }
}

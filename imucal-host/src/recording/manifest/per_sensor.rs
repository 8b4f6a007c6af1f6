//! What a manifest gives for one sensor or another.

use serde::{Deserialize, Serialize};

use crate::recording::sensor_kind::SensorKind;

/// Something of each sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PerSensor<T> {
    /// Of the accelerometer.
    #[serde(default = "Option::default", skip_serializing_if = "Option::is_none")]
    pub acc: Option<T>,
    /// Of the gyroscope.
    #[serde(default = "Option::default", skip_serializing_if = "Option::is_none")]
    pub gyr: Option<T>,
    /// Of the magnetometer.
    #[serde(default = "Option::default", skip_serializing_if = "Option::is_none")]
    pub mag: Option<T>,
}

impl<T> Default for PerSensor<T> {
    fn default() -> Self {
        Self { acc: None, gyr: None, mag: None }
    }
}

impl<T: Copy> PerSensor<T> {
    /// What is given for a sensor.
    #[must_use]
    pub fn of(&self, kind: SensorKind) -> Option<T> {
        self.of_ref(kind).copied()
    }
}

impl<T> PerSensor<T> {
    /// What is given for a sensor, where it lies.
    pub(super) fn of_ref(&self, kind: SensorKind) -> Option<&T> {
        match kind {
            SensorKind::Acc => self.acc.as_ref(),
            SensorKind::Gyr => self.gyr.as_ref(),
            SensorKind::Mag => self.mag.as_ref(),
        }
    }

    /// What is given for a sensor, to be changed.
    pub(crate) fn of_mut(&mut self, kind: SensorKind) -> &mut Option<T> {
        match kind {
            SensorKind::Acc => &mut self.acc,
            SensorKind::Gyr => &mut self.gyr,
            SensorKind::Mag => &mut self.mag,
        }
    }

    /// Nothing is given for any.
    pub(super) fn is_empty(&self) -> bool {
        self.acc.is_none() && self.gyr.is_none() && self.mag.is_none()
    }
}

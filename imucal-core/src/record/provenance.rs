//! Where each triad of a record comes from: a calibration of one triad does not touch what is known of the others.

use heapless::String;
use serde::{Deserialize, Serialize};

use super::{CalibrationRecord, Date, Sensor, SensorIdentity, TriadRecord};

/// Whose a triad's calibration is, and of which day.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Provenance {
    /// Serial of the unit that was calibrated; empty where it was not known.
    pub serial: String<32>,
    /// The day it was calibrated, UTC.
    pub date: Date,
}

impl<O: Clone> CalibrationRecord<O> {
    /// Serial of the unit that a triad was calibrated on; empty where unknown.
    pub fn serial_of(&self, sensor: Sensor) -> &str {
        self.own(sensor).map_or(&self.sensor.serial, |own| &own.serial)
    }

    /// The day that a triad was calibrated.
    pub fn date_of(&self, sensor: Sensor) -> Date {
        self.own(sensor).map_or(self.date, |own| own.date)
    }

    fn own(&self, sensor: Sensor) -> Option<&Provenance> {
        self.provenance.get(sensor as usize)?.as_ref()
    }

    /// Takes a triad that was calibrated on `unit` on `date`, in place of what there was of that sensor. The other
    /// triads keep their figures, their temperature terms and their provenance.
    pub fn adopt(&mut self, sensor: Sensor, triad: &TriadRecord<O>, unit: &SensorIdentity, date: Date) {
        for (other, own) in Sensor::ALL.into_iter().zip(&mut self.provenance) {
            let kept = match other {
                _ if other == sensor => None,
                Sensor::Accelerometer => self.acc.as_ref(),
                Sensor::Gyroscope => self.gyr.as_ref(),
                Sensor::Magnetometer => self.mag.as_ref(),
            };
            let before = own
                .take()
                .unwrap_or_else(|| Provenance { serial: self.sensor.serial.clone(), date: self.date });
            let differs = before.serial != unit.serial || before.date != date;
            *own = Some(before).filter(|_| kept.is_some() && differs);
        }
        let slot = match sensor {
            Sensor::Accelerometer => &mut self.acc,
            Sensor::Gyroscope => &mut self.gyr,
            Sensor::Magnetometer => &mut self.mag,
        };
        *slot = Some(triad.clone());
        self.sensor.clone_from(unit);
        self.date = date;
    }
}

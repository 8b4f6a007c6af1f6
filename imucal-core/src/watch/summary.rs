//! What a watch has seen, in a few hundred bytes: what is stored, sent to a host, and read by a diagnosis.

use serde::{Deserialize, Serialize};

use super::{Shift, Statistic};
use crate::record::{Date, Sensor, SensorIdentity};

/// Looks without which nothing is said of a triad.
pub const FEWEST_LOOKS: u32 = 60;

/// What a watch has seen. The order of the fields is the format: see [`VERSION`](super::VERSION).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WatchSummary {
    /// The unit, as its record names it.
    pub sensor: SensorIdentity,
    /// Date of the record.
    pub date: Date,
    /// False alarms a day of rest that the thresholds allow.
    pub false_alarms: f32,
    /// First look, s on the device's clock.
    pub started: u32,
    /// Last look, likewise.
    pub ended: u32,
    /// Looks judged: seconds of rest.
    pub watched: u32,
    /// Rests that they belong to.
    pub rests: u32,
    /// Values of triads that were not finite.
    pub rejected: u32,
    /// Looks outside the record's temperatures.
    pub outside: u32,
    /// How often the clock was set back.
    pub clock_jumps: u32,
    /// Of each triad, looks at which it was stuck.
    pub stuck: [u32; 3],
    /// Temperatures seen; `None` without a thermometer.
    pub temperature: Option<TemperatureSeen>,
    /// In the order of [`Statistic::ALL`].
    pub statistics: [StatisticSummary; 6],
}

/// Temperatures of all looks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TemperatureSeen {
    /// Lowest, °C.
    pub least: f32,
    /// Highest, °C.
    pub most: f32,
    /// How often it differed from the look before; 0 in a long watch: the thermometer is stuck.
    pub changes: u32,
}

/// A shift that came back.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Spell {
    /// When it began, s on the device's clock.
    pub from: u32,
    /// When it was found to be over.
    pub to: u32,
    /// The most that it came to.
    pub by: f32,
}

/// One statistic.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StatisticSummary {
    /// Looks at it; 0: it is not watched.
    pub looks: u32,
    /// Mean over all looks, less what is expected; unit of the record's calibrated values, of the dip none.
    pub mean: f32,
    /// Standard deviation of the looks.
    pub spread: f32,
    /// Standard deviation of a look's noise.
    pub noise: f32,
    /// What the record and the settings allow in the last pose, one standard deviation.
    pub allowed: f32,
    /// Sums of the step chart, up and down, as shares of its threshold.
    pub step: [f32; 2],
    /// Those of the record chart.
    pub record: [f32; 2],
    /// The last pose, in standard deviations of what is allowed; 0 where that is not known.
    pub latest: f32,
    /// Alarms so far, those of a return included.
    pub alarms: u16,
    /// Shifts that came back.
    pub returns: u16,
    /// The shift that there is now.
    pub shift: Option<Shift>,
    /// The last one that came back.
    pub spell: Option<Spell>,
}

/// What the watch says of a triad.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TriadState {
    /// Not enough was seen of it: nothing is known.
    Unseen,
    /// It does not change at all any more.
    Stuck,
    /// It is as its record says.
    Quiet,
    /// It has moved.
    Moved,
}

impl WatchSummary {
    /// One statistic.
    pub fn statistic(&self, statistic: Statistic) -> &StatisticSummary {
        let [force, x, y, z, field, dip] = &self.statistics;
        match statistic {
            Statistic::Force => force,
            Statistic::RateX => x,
            Statistic::RateY => y,
            Statistic::RateZ => z,
            Statistic::Field => field,
            Statistic::Dip => dip,
        }
    }

    /// The shifts that there are now of a triad. That of the dip is not the magnetometer's where the accelerometer has moved.
    pub fn shifts(&self, sensor: Sensor) -> impl Iterator<Item = (Statistic, Shift)> {
        let of_force = self.statistic(Statistic::Force).shift.is_some();
        let own = move |statistic: &Statistic| {
            statistic.sensor() == sensor && !(of_force && *statistic == Statistic::Dip)
        };
        Statistic::ALL
            .into_iter()
            .filter(own)
            .filter_map(|statistic| Some((statistic, self.statistic(statistic).shift?)))
    }

    /// What the watch says of a triad.
    pub fn state(&self, sensor: Sensor) -> TriadState {
        let own = Statistic::ALL.into_iter().filter(|statistic| statistic.sensor() == sensor);
        let looks = own.map(|statistic| self.statistic(statistic).looks).max().unwrap_or(0);
        let [acc, gyr, mag] = self.stuck;
        let stuck = match sensor {
            Sensor::Accelerometer => acc,
            Sensor::Gyroscope => gyr,
            Sensor::Magnetometer => mag,
        };
        if self.shifts(sensor).next().is_some() {
            TriadState::Moved
        } else if stuck > looks / 2 && stuck >= FEWEST_LOOKS {
            TriadState::Stuck
        } else if looks < FEWEST_LOOKS {
            TriadState::Unseen
        } else {
            TriadState::Quiet
        }
    }
}

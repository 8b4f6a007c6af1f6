//! The drift watch: whether a calibrated sensor is still what its record says, while a device does its work.
//!
//! Whenever the device lies still, each second gives a [`Look`]: means of calibrated samples. From it come six statistics, each
//! zero for a healthy sensor within what the record states:
//!
//! ```text
//! s_f = |f| − g        s_w = w_x, w_y, w_z        s_B = |B| − B₀        s_I = û · b̂ − cos(û, b̂)₀
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | f, w, B | specific force, rate, field: calibrated, in the unit the record gives |
//! | û, b̂ | their directions: s_I sees the dip |
//! | g, B₀, cos₀ | what is expected at the place; without B₀ or cos₀ a statistic is compared with itself alone |
//!
//! Two charts watch each statistic, to both sides (cumulative sums, Page 1954):
//!
//! | chart | what goes in | finds |
//! | --- | --- | --- |
//! | *step* ([`step`]) | each second, against what the minutes before let expect | a change while the sensor is at rest, within seconds |
//! | *record* ([`against_record`]) | each pose once, against what the record states | what moved unseen, or slowly |
//!
//! Their thresholds come from a rate of false alarms a day of rest that the caller states ([`run_length`]). A finding says when the sum
//! last was zero, how far the statistic has moved since, and that it came back, if it did: then something near the device
//! disturbed it, a magnet for example, and the sensor is what it was. Where it came back unseen, poses in all directions that agree with
//! the record show it (`poses`), if the shift was larger than what the record allows.
//!
//! Everything is plain data of fixed size: it can be stopped after any second, kept, and gone on with. The test `watch`
//! shows false alarms, delays and sizes on simulated months.
//!
//! Not modelled: heading, so that Earth's rate counts as a spread; a bias across gravity, which the norm of the specific force
//! does not show until another pose does; a slow turn, which is a rest to the accelerometer. A change of the field at a place and one of
//! the magnetometer look alike: who moves the device gives [`WatchSettings::place`].

pub mod against_record;
mod codec;
mod look;
mod poses;
mod reference;
pub mod run_length;
mod settings;
mod shift;
mod statistic;
pub mod step;
mod summary;

pub use codec::{MAX_LEN, SummaryError, VERSION, decode, encode};
pub use look::{CalibratedSample, Look, LookObserver, Mean};
pub use settings::{GRAVITY_ANYWHERE, WatchSettings};
pub use shift::{Compared, Shift};
pub use summary::{Spell, StatisticSummary, TemperatureSeen, TriadState, WatchSummary};

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::record::{CalibrationRecord, Date, Sensor, SensorIdentity};
use reference::{Reading, Reference};
use run_length::Thresholds;
use statistic::Chart;

/// Directions of gravity further apart than this are two poses, cosine of 2°.
const SAME_POSE: f32 = 0.999_39;
/// Seconds in a row whose samples are all alike after which a sensor counts as stuck.
const STUCK: u16 = 30;

/// What is watched. The order of the variants is the summary's format: append only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Statistic {
    /// Length of the specific force, less gravity.
    Force,
    /// Rate about the first axis.
    RateX,
    /// Rate about the second axis.
    RateY,
    /// Rate about the third axis.
    RateZ,
    /// Length of the field, less what is expected.
    Field,
    /// Cosine of the angle between specific force and field, less what is expected.
    Dip,
}

impl Statistic {
    /// All, in the order of the summary.
    pub const ALL: [Self; 6] = [Self::Force, Self::RateX, Self::RateY, Self::RateZ, Self::Field, Self::Dip];

    /// The triad that it is of; of the dip, the magnetometer.
    #[inline]
    pub fn sensor(self) -> Sensor {
        match self {
            Self::Force => Sensor::Accelerometer,
            Self::RateX | Self::RateY | Self::RateZ => Sensor::Gyroscope,
            Self::Field | Self::Dip => Sensor::Magnetometer,
        }
    }

    /// Direction in which it reads its triad in this pose; `None` where it reads one axis, whatever the pose.
    #[inline]
    fn direction(self, look: &Look) -> Option<Vector3<f32>> {
        let value = match self {
            Self::RateX | Self::RateY | Self::RateZ => None,
            Self::Field => look.mag.map(|mag| mag.value),
            Self::Force | Self::Dip => Some(look.acc.value),
        }?;
        Some(value / libm::sqrtf(value.dot(&value)))
    }
}

/// Watches a calibrated unit.
#[derive(Clone, Debug)]
pub struct Watch {
    sensor: SensorIdentity,
    date: Date,
    settings: WatchSettings,
    reference: Reference,
    thresholds: Thresholds,
    charts: [Chart; 6],
    /// Direction of gravity in this pose; `None` before the first look.
    up: Option<Vector3<f32>>,
    /// Last value of each triad, and seconds in a row in which all of its samples were alike.
    last: [Vector3<f32>; 3],
    alike: [u16; 3],
    /// It was put down while nothing was judged.
    moved: bool,
    /// Charts that have not been given a reading since it was put down; whether in another pose.
    put_down: [Option<bool>; 6],
    seen: Seen,
}

/// What was seen, judged or not.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    started: Option<u32>,
    ended: u32,
    /// Time of the last look that was judged, s.
    judged: Option<u32>,
    watched: u32,
    rests: u32,
    rejected: u32,
    outside: u32,
    clock_jumps: u32,
    stuck: [u32; 3],
    temperature: Option<TemperatureSeen>,
    reading: Option<f32>,
}

impl Watch {
    /// Of a unit with its record, before the first look. A triad that the record lacks is not watched.
    #[inline]
    pub fn new<O>(record: &CalibrationRecord<O>, settings: WatchSettings) -> Self {
        let reference = Reference::of(record, &settings);
        Self {
            sensor: record.sensor.clone(),
            date: record.date,
            thresholds: Thresholds::of(settings.false_alarms),
            charts: [Chart::default(); 6],
            up: None,
            last: [Vector3::repeat(f32::NAN); 3],
            alike: [0; 3],
            moved: false,
            put_down: [None; 6],
            seen: Seen::default(),
            settings,
            reference,
        }
    }

    /// Takes a second of rest in; true where something was found, or came back: [`summary`](Self::summary) says what.
    #[inline]
    pub fn push(&mut self, look: &Look) -> bool {
        let back = self.is_set_back(look);
        self.heed_temperature(look.temperature);
        if self.is_outside(look.temperature) {
            self.seen.outside = self.seen.outside.saturating_add(1);
            self.moved |= look.moved;
            return false;
        }
        let since = look.time.checked_sub(self.seen.judged.replace(look.time).unwrap_or(look.time));
        let late = core::mem::take(&mut self.moved);
        let moved = look.moved || late || back || self.seen.watched == 0;
        let turned = moved && !self.is_same_pose(look);
        self.seen.watched = self.seen.watched.saturating_add(1);
        self.seen.rests = self.seen.rests.saturating_add(u32::from(moved));
        let usable = self.usable(look);
        let readings = self.reference.readings(look, usable);
        let now = self.now(look, since.unwrap_or(0));
        let mut heard = false;
        let charts = self.charts.iter_mut().zip(&mut self.put_down);
        for ((statistic, reading), (chart, put_down)) in Statistic::ALL.into_iter().zip(readings).zip(charts)
        {
            if moved {
                *put_down = Some(turned || *put_down == Some(true));
            }
            let Some(reading) = reading.filter(Reading::is_usable) else { continue };
            let begins = put_down.take();
            if begins.is_some() || !chart.is_begun() {
                let (allowance, turned) =
                    (self.reference.allowance(&self.settings, statistic, look), begins == Some(true));
                heard |= chart.begin_rest(&allowance, turned, statistic.direction(look), now.time);
            }
            heard |= chart.push(&reading, &now, &self.thresholds);
        }
        heard
    }

    /// Forgets what the seconds before let expect, as after a start of the device; what was found stays.
    #[inline]
    pub fn restart(&mut self) {
        self.charts.iter_mut().for_each(Chart::restart);
        self.up = None;
    }

    /// What has been seen and found so far.
    #[inline]
    pub fn summary(&self) -> WatchSummary {
        let Seen {
            started, ended, watched, rests, rejected, outside, clock_jumps, stuck, temperature, ..
        } = self.seen;
        WatchSummary {
            sensor: self.sensor.clone(),
            date: self.date,
            false_alarms: self.settings.false_alarms,
            started: started.unwrap_or(0),
            ended,
            watched,
            rests,
            rejected,
            outside,
            clock_jumps,
            stuck,
            temperature,
            statistics: self.charts.map(|chart| chart.summary(&self.thresholds)),
        }
    }

    /// Heeds the clock; true where it was set back.
    #[inline]
    fn is_set_back(&mut self, look: &Look) -> bool {
        self.seen.started.get_or_insert(look.time);
        let back = look.time < self.seen.ended;
        self.seen.clock_jumps = self.seen.clock_jumps.saturating_add(u32::from(back));
        self.seen.ended = look.time;
        back
    }

    #[inline]
    fn heed_temperature(&mut self, temperature: f32) {
        if !temperature.is_finite() {
            return;
        }
        let changed = self.seen.reading.replace(temperature).is_some_and(|before| before != temperature);
        let seen = self.seen.temperature.get_or_insert(TemperatureSeen {
            least: temperature,
            most: temperature,
            changes: 0,
        });
        seen.changes = seen.changes.saturating_add(u32::from(changed));
        seen.least = if temperature < seen.least { temperature } else { seen.least };
        seen.most = if temperature > seen.most { temperature } else { seen.most };
    }

    /// The record was made for other temperatures.
    #[inline]
    fn is_outside(&self, temperature: f32) -> bool {
        self.settings.span.is_some_and(|[least, most]| temperature < least || temperature > most)
    }

    /// Gravity has the direction that it had; a look without an accelerometer is taken for the same pose.
    #[inline]
    fn is_same_pose(&mut self, look: &Look) -> bool {
        let up = look.acc.value / libm::sqrtf(look.acc.value.dot(&look.acc.value));
        if !up.iter().all(|component| component.is_finite()) {
            return true;
        }
        let same = self.up.is_some_and(|before| before.dot(&up) > SAME_POSE);
        if !same {
            self.up = Some(up);
        }
        same
    }

    /// Of each triad, whether its value can be judged: finite, and not stuck.
    #[inline]
    fn usable(&mut self, look: &Look) -> [bool; 3] {
        let mut usable = [false; 3];
        let means = [Some(look.acc), look.gyr, look.mag];
        let state = usable.iter_mut().zip(&mut self.last).zip(&mut self.alike).zip(&mut self.seen.stuck);
        for (mean, (((usable, last), alike), stuck)) in means.into_iter().zip(state) {
            let Some(mean) = mean else { continue };
            if !mean.is_finite() {
                self.seen.rejected = self.seen.rejected.saturating_add(1);
                continue;
            }
            let is_alike = mean.variance == Vector3::zeros() && mean.value == *last;
            *alike = if is_alike { alike.saturating_add(1) } else { 0 };
            *last = mean.value;
            *usable = *alike < STUCK;
            *stuck = stuck.saturating_add(u32::from(!*usable));
        }
        usable
    }

    #[inline]
    fn now(&self, look: &Look, since: u32) -> Now {
        let memory = if self.settings.memory > 1.0 { self.settings.memory } else { 1.0 };
        Now { time: look.time, since, memory, temperature: look.temperature }
    }
}

/// When a look is taken.
#[derive(Clone, Copy, Debug)]
struct Now {
    /// On the device's clock, s.
    time: u32,
    /// Since the look before, s.
    since: u32,
    /// Correlation time of the sensor's in-run instability, s.
    memory: f32,
    /// °C; NaN where it is not known.
    temperature: f32,
}

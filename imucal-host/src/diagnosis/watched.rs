//! What a device's drift watch says of the unit of a recording. It stands next to the diagnosis and does not change it: the watch saw
//! other hours, and only rests.

use imucal_core::{
    record::Sensor,
    watch::{Compared, Spell, Statistic, StatisticSummary, TriadState, WatchSummary},
};
use serde::{Deserialize, Serialize};

use super::finding::Cause;
use crate::recording::SensorKind;

/// Seconds of rest after which a thermometer that never changed counts as stuck.
const LONG: u32 = 3600;

/// A drift watch, in the words of the diagnosis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Watched {
    /// Name of the unit, as its record has it.
    pub sensor: String,
    /// Its serial number; empty where unknown.
    pub serial: String,
    /// Day of the record that was watched.
    pub record_date: String,
    /// First and last second of rest, s on the device's clock.
    pub from: u32,
    /// Likewise.
    pub to: u32,
    /// Seconds of rest that were judged.
    pub watched: u32,
    /// Rests that they belong to.
    pub rests: u32,
    /// False alarms a day of rest that the watch was set to.
    pub false_alarms_a_day: f64,
    /// Accelerometer, gyroscope, magnetometer.
    pub triads: Vec<WatchedTriad>,
    /// What else a reader should know.
    pub remarks: Vec<String>,
}

/// What was seen of a triad.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WatchedTriad {
    /// `acc`, `gyr` or `mag`.
    pub sensor: String,
    /// Whether it is as its record says.
    pub state: WatchedState,
    /// How far it has moved.
    pub shifts: Vec<WatchedShift>,
    /// What came and went.
    pub disturbances: Vec<Disturbance>,
    /// Causes of the diagnosis that act on this sensor.
    pub causes: Vec<String>,
}

/// Of a triad.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WatchedState {
    /// Not enough was seen of it.
    Unseen,
    /// Its values no longer change.
    Stuck,
    /// As its record says.
    Quiet,
    /// It has moved.
    Moved,
}

/// A statistic that has moved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WatchedShift {
    /// `norm`, `x`, `y`, `z` or `dip`.
    pub statistic: String,
    /// By how much, in the unit of the record's calibrated values; the dip as the cosine of an angle.
    pub by: f64,
    /// Its standard error; against the record, what the record allows.
    pub std_error: f64,
    /// When it last was as it should be, s on the device's clock.
    pub since: u32,
    /// When it was found.
    pub found: u32,
    /// °C when it was found.
    pub temperature: Option<f64>,
    /// `itself`: its values in the minutes before; `record`: what the record states.
    pub compared_with: String,
}

/// The last shift of a statistic that came back.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Disturbance {
    /// As of a shift.
    pub statistic: String,
    /// The most that it came to.
    pub by: f64,
    /// s on the device's clock.
    pub from: u32,
    /// Likewise.
    pub to: u32,
    /// How many there were of this statistic, this one included.
    pub count: u16,
}

impl Watched {
    /// A summary next to the causes of a diagnosis.
    pub fn of(summary: &WatchSummary, causes: &[Cause]) -> Self {
        Self {
            sensor: summary.sensor.name.to_string(),
            serial: summary.sensor.serial.to_string(),
            record_date: summary.date.to_string(),
            from: summary.started,
            to: summary.ended,
            watched: summary.watched,
            rests: summary.rests,
            false_alarms_a_day: f64::from(summary.false_alarms),
            triads: SensorKind::ALL.map(|kind| triad(summary, kind, causes)).to_vec(),
            remarks: remarks(summary),
        }
    }
}

fn triad(summary: &WatchSummary, kind: SensorKind, causes: &[Cause]) -> WatchedTriad {
    let sensor = Sensor::from(kind);
    let acts_on_it = |cause: &&Cause| cause.effect.split('.').next() == Some(kind.prefix());
    let own = Statistic::ALL.into_iter().filter(|statistic| statistic.sensor() == sensor);
    let disturbance = |statistic| disturbance(statistic, summary.statistic(statistic));
    WatchedTriad {
        sensor: kind.prefix().to_owned(),
        state: match summary.state(sensor) {
            TriadState::Unseen => WatchedState::Unseen,
            TriadState::Stuck => WatchedState::Stuck,
            TriadState::Quiet => WatchedState::Quiet,
            TriadState::Moved => WatchedState::Moved,
        },
        shifts: summary.shifts(sensor).map(shift).collect(),
        disturbances: own.filter_map(disturbance).collect(),
        causes: causes.iter().filter(acts_on_it).map(|cause| cause.effect.clone()).collect(),
    }
}

fn shift((statistic, shift): (Statistic, imucal_core::watch::Shift)) -> WatchedShift {
    WatchedShift {
        statistic: name(statistic).to_owned(),
        by: f64::from(shift.by),
        std_error: f64::from(shift.error),
        since: shift.since,
        found: shift.found,
        temperature: shift.temperature.map(f64::from),
        compared_with: match shift.compared {
            Compared::WithItself => "itself",
            Compared::WithRecord => "record",
        }
        .to_owned(),
    }
}

fn disturbance(statistic: Statistic, seen: &StatisticSummary) -> Option<Disturbance> {
    let Spell { from, to, by } = seen.spell?;
    let by = f64::from(by);
    Some(Disturbance { statistic: name(statistic).to_owned(), by, from, to, count: seen.returns })
}

fn name(statistic: Statistic) -> &'static str {
    match statistic {
        Statistic::Force | Statistic::Field => "norm",
        Statistic::RateX => "x",
        Statistic::RateY => "y",
        Statistic::RateZ => "z",
        Statistic::Dip => "dip",
    }
}

fn remarks(summary: &WatchSummary) -> Vec<String> {
    let mut remarks = Vec::new();
    if summary.watched == 0 {
        remarks.push("no rest was seen, so that nothing is known of the unit".to_owned());
    }
    if summary.outside > 0 {
        remarks.push(format!("{} s outside the record's temperatures are not judged", summary.outside));
    }
    if summary.temperature.is_some_and(|seen| seen.changes == 0) && summary.watched >= LONG {
        remarks.push("the thermometer never changed: it may be stuck".to_owned());
    }
    if summary.clock_jumps > 0 {
        remarks.push(format!("the device's clock was set back {} times", summary.clock_jumps));
    }
    if summary.rejected > 0 {
        remarks.push(format!("{} means were no numbers and are left out", summary.rejected));
    }
    remarks
}

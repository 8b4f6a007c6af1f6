//! What has been found of one statistic: that it moved, and whether it came back.

use serde::{Deserialize, Serialize};

use super::{
    Now, Spell,
    against_record::Pose,
    poses::Agreement,
    step::{Change, Settled},
};

/// Of a shift, what may be left of it when it has come back.
const LEFT: f32 = 0.3;
/// The same in standard errors.
const LEFT_STD: f32 = 3.0;

/// A shift that began so shortly after the end of another is a part of it, s.
const AT_ONCE: u32 = 60;

/// What a shift was found against. The order of the variants is the summary's format: append only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Compared {
    /// Against the statistic's own values in the minutes before.
    WithItself,
    /// Against what the record states.
    WithRecord,
}

/// How far a statistic has moved.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Shift {
    /// When it last was as it should be, s on the device's clock.
    pub since: u32,
    /// When it was found, likewise.
    pub found: u32,
    /// By how much, unit of the statistic: of the record's calibrated values, of the dip none.
    pub by: f32,
    /// Standard error of that; against the record, what the record allows.
    pub error: f32,
    /// Temperature when it was found, °C; `None` where it is not known.
    pub temperature: Option<f32>,
    /// Against what.
    pub compared: Compared,
}

impl Spell {
    /// What began then belongs to it.
    fn is_followed_by(&self, since: u32) -> bool {
        self.from <= since && since.saturating_sub(self.to) < AT_ONCE
    }
}

/// The shift of a statistic, and its history.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Track {
    pub(super) shift: Option<Shift>,
    pub(super) alarms: u16,
    pub(super) returns: u16,
    pub(super) spell: Option<Spell>,
    /// The most that the shift has been, with its sign.
    largest: f32,
    /// Estimate of the statistic without the shift, and its variance; kept in one rest, after a return too: where the shift comes back
    /// slowly, the end of that is no shift of its own.
    origin: Option<(f32, f32)>,
    /// A change has come after the one that opened the shift.
    again: bool,
    /// Poses since then that agree with the record.
    agreement: Agreement,
}

impl Track {
    /// The device was moved: what was estimated before it says nothing of the estimates after it.
    pub(super) fn begin_rest(&mut self, time: u32) {
        self.close_if_back(time);
        self.origin = None;
    }

    /// Takes a pose in that has ended; true where a shift that was found in one rest is over by what it and those before it show.
    pub(super) fn pose(&mut self, pose: &Pose, time: u32) -> bool {
        let Some(shift) = self.shift.filter(|shift| shift.compared == Compared::WithItself) else {
            return false;
        };
        if !pose.agrees {
            self.agreement = Agreement::default();
        } else if shift.by.abs() >= pose.shows && self.agreement.push(&pose.direction) {
            self.close(time);
            return true;
        }
        false
    }

    /// Takes a change of the step chart in.
    pub(super) fn step(&mut self, change: &Change, now: &Now) {
        self.alarms = self.alarms.saturating_add(1);
        let (from, variance) = change.from;
        let (by, error) = self.shift.map_or((0.0, 0.0), |shift| (shift.by, shift.error));
        let (origin, _) = *self.origin.get_or_insert((from - by, variance + error * error));
        self.again = self.shift.is_some() || self.origin != Some(change.from);
        if self.shift.is_none() {
            let by = from + change.by - origin;
            self.open(now, (change.since, by, libm::sqrtf(change.variance)), Compared::WithItself);
            // What is left of a disturbance that has just ended is judged by its size.
            let just_ended = self.spell.filter(|spell| spell.is_followed_by(change.since));
            self.largest = just_ended.map_or(change.by, |spell| spell.by);
        }
    }

    /// Takes the estimate after the last change in, and its variance; true where the statistic has come back.
    pub(super) fn size(&mut self, settled: &Settled, now: &Now) -> bool {
        let (Some(shift), Some((origin, variance))) = (&mut self.shift, self.origin) else { return false };
        shift.by = settled.estimate - origin;
        shift.error = libm::sqrtf(settled.variance + variance);
        if settled.is_whole && self.close_if_back(now.time) {
            return true;
        }
        self.largest =
            self.shift.map_or(
                self.largest,
                |Shift { by, .. }| if by.abs() > self.largest.abs() { by } else { self.largest },
            );
        false
    }

    /// Takes a change of the record chart in: `since`, by how much, and its standard error.
    pub(super) fn against_record(&mut self, change: (u32, f32, f32), now: &Now) {
        self.alarms = self.alarms.saturating_add(1);
        (self.origin, self.again) = (None, false);
        self.open(now, change, Compared::WithRecord);
    }

    /// It is as it was. What followed the last spell at once belongs to it.
    pub(super) fn close(&mut self, time: u32) {
        let Some(Shift { since, .. }) = self.shift.take() else { return };
        let now = Spell { from: since, to: time, by: self.largest };
        self.spell = match self.spell {
            Some(spell) if spell.is_followed_by(since) => {
                let by = if spell.by.abs() > now.by.abs() { spell.by } else { now.by };
                Some(Spell { from: spell.from, to: time, by })
            }
            _ => {
                self.returns = self.returns.saturating_add(1);
                Some(now)
            }
        };
    }

    /// Closes the shift where little is left of it; true if so.
    fn close_if_back(&mut self, time: u32) -> bool {
        let Some(shift) = self.shift.filter(|_| self.again) else { return false };
        let (share, errors) = (LEFT * self.largest.abs(), LEFT_STD * shift.error);
        let is_back = shift.by.abs() < if share > errors { share } else { errors };
        if is_back {
            self.close(time);
        }
        is_back
    }

    fn open(&mut self, now: &Now, (since, by, error): (u32, f32, f32), compared: Compared) {
        let temperature = Some(now.temperature).filter(|temperature| temperature.is_finite());
        (self.largest, self.agreement) = (by, Agreement::default());
        self.shift = Some(Shift { since, found: now.time, by, error, temperature, compared });
    }
}

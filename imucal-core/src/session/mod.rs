//! A calibration session: raw samples in, a record out, with nobody else's help.
//!
//! ```text
//! sample → observers → poses and points → fit → verdict → what to do next
//! ```
//!
//! | file | what |
//! | --- | --- |
//! | [`poses`] | what is kept of rests and turns |
//! | [`bias`] | the gyroscope's bias, and whether it wanders |
//! | `evidence` | rows of the fits, from what is kept |
//! | [`estimate`] | a sensor's triad, its errors and its verdict |
//! | `fitting`, `judgement` | fits by slices, outliers; errors and verdicts |
//! | [`sense`] | whether the gyroscope turns as gravity does |
//! | [`alignment`] | the magnetometer in the accelerometer's axes |
//! | [`axes`] | the axes of a record that a rig has made |
//! | [`design`] | which pose says most |
//! | [`guide`] | what to do next, how sure each sensor is, what was thrown away |
//! | [`store`] | whether a new record takes the place of the stored one |
//! | [`temperature`] | what warmth does, from rests at several temperatures |
//!
//! A session is plain data of fixed size. [`Session::push`] takes a sample and costs a few hundred instructions;
//! [`Session::work`] does one slice of a fit, and is called whenever there is time. All is in `f32`, and to the same bits on a host.
//!
//! Not done here: the record's write to flash, the units of raw samples (nominal SI comes in), g-sensitivity, and the host's
//! examination of residuals: what the host accepts with a suspicion, a session accepts without one.

pub mod alignment;
pub mod axes;
pub mod bias;
pub mod design;
pub mod estimate;
mod evidence;
mod fitting;
pub mod guide;
mod judgement;
pub mod poses;
pub mod sense;
pub mod store;
pub mod temperature;

use nalgebra::Vector3;

use crate::{
    observation::Moments,
    observer::{
        Sample,
        cloud::{Chosen, CloudObserver},
        inertial::{InertialObserver, Seen},
        rest::{RestSettings, Stage},
        thermometer::ThermometerObserver,
        turn::ObservedTurn,
    },
    record::Sensor,
};
use design::Scores;
use estimate::Estimate;
use fitting::Fit;
use guide::Thrown;
use poses::Poses;

/// What a session needs to know before it begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SessionSettings {
    /// Local gravity, m/s².
    pub gravity: f32,
    /// Length of the field, µT, where it is known.
    pub field: Option<f32>,
    /// Whether the field points down at this place, where it is known: it distinguishes a magnetometer that is mounted otherwise
    /// from a mirrored one.
    pub field_down: Option<bool>,
    /// Error of a calibrated vector at which a sensor is done, as a share of its length: accelerometer, gyroscope, magnetometer.
    /// Zero: the sensor is not asked for.
    pub target: [f32; 3],
    /// Values beyond which a sensor clips, nominal SI, in the same order.
    pub full_scale: [f32; 3],
    /// How long a pose is to be held, s.
    pub hold: f32,
    /// Distance of the points of a cloud at first, µT: a few times the magnetometer's noise.
    pub apart: f32,
    /// When something is still.
    pub rest: RestSettings<f32>,
}

impl Default for SessionSettings {
    fn default() -> Self {
        Self {
            gravity: 9.80665,
            field: None,
            field_down: None,
            target: [1e-3, 3e-3, 1e-2],
            full_scale: [f32::INFINITY; 3],
            hold: 2.0,
            apart: 2.0,
            rest: RestSettings::default(),
        }
    }
}

/// A session under way: `N` poses, at most 64, their turns of `B` blocks, and `M` points of a cloud, at most 64.
#[derive(Clone, Debug)]
pub struct Session<const N: usize, const B: usize, const M: usize> {
    settings: SessionSettings,
    observer: InertialObserver<f32, B>,
    cloud: CloudObserver<f32, M>,
    thermometer: ThermometerObserver<f32>,
    /// The field while a rest goes on.
    field: Moments<f32>,
    /// The last sample of the field came while it did.
    field_rests: bool,
    poses: Poses<N, B>,
    /// A turn to the rest that goes on.
    pending: Option<ObservedTurn<f32, B>>,
    fit: Option<Fit>,
    /// Sensors whose observations have changed since their last fit.
    due: [bool; 3],
    /// The gyroscope was judged, and not yet whether it turns as gravity does.
    sense_due: bool,
    /// Points since the cloud's last fit.
    new_points: u8,
    estimates: [Option<Estimate>; 3],
    /// Scores of the poses that might be next, as of the last fits.
    scores: [Scores; 2],
    thrown: Thrown,
}

/// New points of a cloud after which it is fitted again.
const POINTS_A_FIT: u8 = 8;

impl<const N: usize, const B: usize, const M: usize> Session<N, B, M> {
    /// Before the first sample.
    pub fn new(settings: SessionSettings) -> Self {
        const { assert!(M <= 64) };
        Self {
            settings,
            observer: InertialObserver::new(settings.rest),
            cloud: CloudObserver::new(settings.apart),
            thermometer: ThermometerObserver::default(),
            field: Moments::default(),
            field_rests: false,
            poses: Poses::default(),
            pending: None,
            fit: None,
            due: [false; 3],
            sense_due: false,
            new_points: 0,
            estimates: [None; 3],
            scores: [Scores::NONE; 2],
            thrown: Thrown::default(),
        }
    }

    /// Takes a sample in: nominal SI, sensor axes.
    pub fn push(&mut self, sample: &Sample<f32>) {
        if let Some(temperature) = sample.temperature {
            self.thermometer.push(sample.time, temperature);
        }
        let [acc, gyr, _] = self.settings.full_scale;
        let clips = beyond(&sample.acc, acc) || sample.gyr.as_ref().is_some_and(|rate| beyond(rate, gyr));
        if clips || !self.observer.goes_on(sample) {
            self.look(sample, clips);
        }
    }

    /// A sample that may show something new.
    #[inline(never)]
    fn look(&mut self, sample: &Sample<f32>, clips: bool) {
        let seen = if clips { self.clipped(sample) } else { self.observer.turn_over(sample) };
        if !matches!(seen, Seen::Nothing) {
            self.take(&seen);
        }
    }

    /// Something new was seen.
    #[inline(never)]
    fn take(&mut self, seen: &Seen<f32, B>) {
        match seen {
            Seen::Nothing => {}
            Seen::Rest(rest) => self.keep(rest),
            Seen::NoRest => {
                self.thrown.rests = self.thrown.rests.saturating_add(1);
                // It was a rest for the turn that led to it.
                if self.pending.take().is_some() {
                    self.poses.break_off();
                }
                (self.field, self.field_rests) = (Moments::default(), false);
            }
            Seen::Turn(turn) => self.pending = Some(turn.clone()),
        }
    }

    /// Takes a sample of the magnetometer in, nominal, µT, whenever it has one.
    pub fn push_field(&mut self, field: &Vector3<f32>) {
        if beyond(field, self.settings.full_scale[2]) {
            self.thrown.clipped = self.thrown.clipped.saturating_add(1);
            return;
        }
        match self.cloud.push(field) {
            Chosen::Unusable => {
                self.field_rests = false;
                return;
            }
            Chosen::Near => {}
            Chosen::New => {
                self.new_points = self.new_points.saturating_add(1);
                if self.new_points >= POINTS_A_FIT {
                    self.mark(Sensor::Magnetometer);
                }
            }
        }
        let rests = self.observer.rests().stage() != Stage::Moving;
        // A spike is known by the sample after it.
        if rests
            && self.field_rests
            && let Some(judged) = self.cloud.judged()
        {
            self.field.push(judged);
        }
        self.field_rests = rests;
    }

    /// No more samples come: what goes on ends, and what has changed is fitted.
    pub fn finish(&mut self) {
        if let Some(rest) = self.observer.finish() {
            self.keep(&rest);
        }
        if self.new_points > 0 {
            self.mark(Sensor::Magnetometer);
        }
    }

    /// What is known of a sensor so far.
    pub fn estimate(&self, sensor: Sensor) -> Option<&Estimate> {
        self.estimates.get(sensor as usize)?.as_ref()
    }

    /// What it was given.
    pub fn settings(&self) -> &SessionSettings {
        &self.settings
    }

    /// Rests and turns so far.
    pub fn poses(&self) -> &Poses<N, B> {
        &self.poses
    }

    /// The magnetometer's cloud so far.
    pub fn cloud(&self) -> &CloudObserver<f32, M> {
        &self.cloud
    }

    /// What is beyond a sensor's range is not what was measured.
    #[inline(never)]
    fn clipped(&mut self, sample: &Sample<f32>) -> Seen<f32, B> {
        let mut sample = *sample;
        let [acc, gyr, _] = self.settings.full_scale;
        let missing = Vector3::repeat(f32::NAN);
        self.thrown.clipped = self.thrown.clipped.saturating_add(1);
        if beyond(&sample.acc, acc) {
            sample.acc = missing;
        }
        if sample.gyr.is_some_and(|rate| beyond(&rate, gyr)) {
            sample.gyr = Some(missing);
            self.observer.interrupt();
        }
        self.observer.push(&sample)
    }

    /// A rest has ended.
    fn keep(&mut self, rest: &crate::observer::rest::ObservedRest<f32>) {
        self.field_rests = false;
        let field = core::mem::take(&mut self.field);
        let field = (field.count() > 0).then(|| field.mean());
        let turn = self.pending.take();
        self.poses.push(rest, field, turn.as_ref());
        let most = self.observer.rests().threshold();
        let noisy = self.poses.retain_quieter(most);
        self.thrown.rests = self.thrown.rests.saturating_add(u16::try_from(noisy).unwrap_or(u16::MAX));
        self.mark(Sensor::Accelerometer);
    }

    fn mark(&mut self, sensor: Sensor) {
        if let Some(due) = self.due.get_mut(sensor as usize) {
            *due = true;
        }
    }
}

/// Any component reaches the end of the range.
#[inline]
fn beyond(value: &Vector3<f32>, full_scale: f32) -> bool {
    let reaches = |component: f32| libm::fabsf(component) >= full_scale;
    reaches(value.x) || reaches(value.y) || reaches(value.z)
}

#[cfg(test)]
mod tests;

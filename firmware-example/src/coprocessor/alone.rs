//! What the co-processor does without its host's observations: a calibration session, the drift watch, and the
//! gyroscope's bias of the day.

use heapless::Vec;
use imucal_core::{
    link::{CaptureOutcome, CaptureState, CaptureTask, Fault, RawSample},
    observer::{
        self,
        rest::{RestObserver, RestSettings, Stage},
    },
    record::{RawUnit, Sensor, TriadRecord},
    session::{
        alignment::AlignmentFit,
        axes::Axes,
        bias::MeanRate,
        store::{NotStored, bias_of_the_day},
        temperature::WarmthFit,
    },
    watch::{CalibratedSample, GRAVITY_ANYWHERE, LookObserver, Mean, Watch, WatchSettings, WatchSummary},
};
use nalgebra::Vector3;

use super::calibration::{HeldRecord, HeldTriad};
use crate::standalone::{POSES, Standalone};

/// A gyroscope's bias moves less than this from day to day, rad/s.
const MOST: f32 = 0.02;

/// The memory of `N` sessions and watches: one, or none on a board without the room.
#[derive(Clone, Debug)]
pub struct Alone<const N: usize> {
    captures: Vec<Capture, N>,
    watches: Vec<Watching, N>,
    /// Samples of the link that went into watches.
    watched: u16,
    /// Rate at rest that is taken off the board's own samples, rad/s.
    of_the_day: Option<Vector3<f32>>,
    /// The gyroscope lay still since this calibration is used.
    lay_still: bool,
}

/// A session under way.
#[derive(Clone, Debug)]
pub(super) struct Capture {
    pub(super) session: Standalone,
    pub(super) task: CaptureTask,
    /// Samples taken.
    taken: u32,
    /// Terms of temperature under way, once it has ended.
    warmth: Vec<WarmthFit<POSES>, 1>,
    /// The magnetometer's rotation under way, likewise.
    alignment: Vec<AlignmentFit, 1>,
    /// Axes of the record in use, once it has ended.
    axes: Vec<Axes, 1>,
    /// What it came to: sensor after sensor, once it has ended.
    outcomes: Vec<CaptureOutcome, 3>,
}

/// A watch under way.
#[derive(Clone, Debug)]
struct Watching {
    rests: RestObserver<f32>,
    looks: LookObserver,
    watch: Watch,
}

impl<const N: usize> Default for Alone<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Alone<N> {
    /// Neither session nor watch. Nothing but zeros, so that a `static` costs no flash.
    pub const fn new() -> Self {
        Self { captures: Vec::new(), watches: Vec::new(), watched: 0, of_the_day: None, lay_still: false }
    }

    /// Begins a session; one that is under way is given up.
    ///
    /// # Errors
    ///
    /// [`Fault::Unsuited`] without memory for one, [`Fault::Malformed`] for figures that cannot be.
    pub(super) fn begin(&mut self, task: CaptureTask) -> Result<(), Fault> {
        if N == 0 {
            return Err(Fault::Unsuited);
        }
        let settings = task.settings().ok_or(Fault::Malformed)?;
        self.captures.clear();
        let _room = self.captures.push(Capture {
            session: Standalone::new(settings),
            task,
            taken: 0,
            warmth: Vec::new(),
            alignment: Vec::new(),
            axes: Vec::new(),
            outcomes: Vec::new(),
        });
        Ok(())
    }

    /// Gives the session up.
    pub(super) fn end(&mut self) {
        self.captures.clear();
    }

    /// The session under way. Of a board without the memory nothing that it would need is linked.
    #[inline]
    pub(super) fn capture(&mut self) -> Option<&mut Capture> {
        if N == 0 {
            return None;
        }
        self.captures.first_mut().filter(|capture| !capture.outcomes.is_full())
    }

    /// What the session that is over came to.
    pub(super) fn outcomes(&self) -> Option<[CaptureOutcome; 3]> {
        self.captures.first()?.outcomes.as_slice().try_into().ok()
    }

    /// What was watched and taken off belongs to the calibration before.
    pub(super) fn forget_watch(&mut self) {
        self.watches.clear();
        (self.of_the_day, self.lay_still) = (None, false);
    }

    /// Index of the next sample of the link.
    pub(super) fn next(&mut self) -> u16 {
        let watched = self.watched;
        self.capture().map_or(watched, |capture| capture.taken as u16)
    }

    /// Counts a sample of the link that goes into the watch.
    pub(super) fn count(&mut self) {
        self.watched = self.watched.wrapping_add(1);
    }

    /// Rate that is taken off, rad/s.
    pub(super) fn bias_of_the_day(&self) -> Option<[f32; 3]> {
        self.of_the_day.map(Into::into)
    }

    /// The gyroscope lay still, and showed a rate or none beyond its record. The first second of rest counts until another
    /// calibration is used: what moves later is the watch's to find.
    pub(super) fn found_at_rest(&mut self, rate: Option<Vector3<f32>>) {
        if !self.lay_still {
            (self.of_the_day, self.lay_still) = (rate, true);
        }
    }

    /// Takes it off a corrected sample.
    pub(super) fn take_bias_of_the_day_off(&self, values: &mut [Option<[f32; 3]>; 3]) {
        if let (Some(rate), [_, Some(gyr), _]) = (self.of_the_day, values) {
            *gyr = (Vector3::from(*gyr) - rate).into();
        }
    }

    /// What the watch has seen; `None` where nothing is watched.
    pub(super) fn summary(&self) -> Option<WatchSummary> {
        self.watches.first().filter(|_| N > 0).map(|watching| watching.watch.summary())
    }

    /// Takes a calibrated sample of the record into the watch, which begins with the first one. At the end of a second of rest,
    /// the rate that the gyroscope showed, if it is beyond the record.
    #[inline(never)]
    pub(super) fn watch(
        &mut self,
        record: &HeldRecord,
        time: u64,
        values: &[Option<[f32; 3]>; 3],
        temperature: f32,
    ) -> Option<Option<Vector3<f32>>> {
        if N == 0 {
            return None;
        }
        let [Some(acc), gyr, mag] = values.map(|value| value.map(Vector3::from)) else { return None };
        if self.watches.is_empty() {
            self.start_watch(record);
        }
        let watching = self.watches.first_mut()?;
        let kelvin = Some(temperature).filter(|value| value.is_finite());
        let _rest = watching.rests.push(&observer::Sample { time, acc, gyr, temperature: kelvin });
        let still = watching.rests.stage() != Stage::Moving;
        let sample = CalibratedSample { time, acc, gyr, mag, temperature };
        let look = watching.looks.push(&sample, still)?;
        watching.watch.push(&look);
        let rate = look.gyr.filter(Mean::is_finite)?;
        Some(of_the_day(&rate, record.gyr.as_ref()?))
    }

    /// Out of line: a watch is larger than a stack's frame should be.
    #[inline(never)]
    fn start_watch(&mut self, record: &HeldRecord) {
        if !is_si(record) {
            return;
        }
        let _room = self.watches.push(Watching {
            rests: RestObserver::new(RestSettings::default()),
            looks: LookObserver::default(),
            // A record does not say where the device is.
            watch: Watch::new(
                record,
                WatchSettings { gravity_error: GRAVITY_ANYWHERE, ..WatchSettings::default() },
            ),
        });
    }
}

/// What the watch expects is in m/s², rad/s and µT.
fn is_si(record: &HeldRecord) -> bool {
    let units = |(sensor, triad): (Sensor, &HeldTriad)| match sensor {
        Sensor::Accelerometer => triad.unit_out == RawUnit::MetrePerSecondSquared,
        Sensor::Gyroscope => triad.unit_out == RawUnit::RadianPerSecond,
        Sensor::Magnetometer => matches!(triad.unit_out, RawUnit::MicroTesla | RawUnit::Arbitrary),
    };
    record.triads().all(units)
}

fn of_the_day(mean: &Mean, stored: &HeldTriad) -> Option<Vector3<f32>> {
    let rate = MeanRate { mean: mean.value, variance: mean.variance, count: 1 };
    bias_of_the_day(&rate, stored, MOST)
}

impl Capture {
    /// Takes a raw sample in.
    pub(super) fn push(&mut self, sample: &RawSample) {
        self.task.push(&mut self.session, sample);
        self.taken = self.taken.wrapping_add(1);
    }

    /// One slice of what is left once no more samples come: a sensor's terms of temperature, and the magnetometer's rotation into the
    /// accelerometer's axes. The sensor that is next to be stored, where nothing else is left.
    #[inline(never)]
    pub(super) fn close(&mut self) -> Option<Sensor> {
        let sensor = *Sensor::ALL.get(self.outcomes.len())?;
        // Before any sensor is stored, since it may show that one is mirrored.
        if self.outcomes.is_empty() && self.warmth.is_empty() && self.aligns() {
            return None;
        }
        match self.warmth.first_mut() {
            Some(fit) => (!fit.work()).then_some(sensor),
            None => (!self.begin_warmth(sensor)).then_some(sensor),
        }
    }

    /// One slice of the magnetometer's rotation; whether there was one.
    fn aligns(&mut self) -> bool {
        let Some(fit) = self.alignment.first_mut() else { return self.begin_alignment() };
        // Where it cannot be turned, it stays in its own axes.
        fit.work(&self.session) || self.session.align(fit).is_ok()
    }

    /// Out of line: such a fit is larger than a stack's frame should be.
    #[inline(never)]
    fn begin_alignment(&mut self) -> bool {
        self.session.alignment().is_ok_and(|fit| self.alignment.push(fit).is_ok())
    }

    /// Out of line, likewise.
    #[inline(never)]
    fn begin_warmth(&mut self, sensor: Sensor) -> bool {
        self.session.warmth(sensor).is_ok_and(|fit| self.warmth.push(fit).is_ok())
    }

    /// What it has found of a sensor, if that is surer than what `record` holds, and in the axes that it had before the first sensor.
    pub(super) fn better(&mut self, sensor: Sensor, record: &HeldRecord) -> Result<TriadRecord, NotStored> {
        let units = |sensor: Sensor| self.task.sensors.get(sensor as usize).map(|of| of.units(sensor));
        if self.axes.is_empty()
            && let Some(units) = units(Sensor::Accelerometer)
        {
            let _room = self.axes.push(self.session.axes(&units, record.acc.as_ref()));
        }
        let axes = self.axes.first().unwrap_or(&Axes::Own);
        let units = units(sensor).ok_or(NotStored::NoEstimate)?;
        match self.warmth.first() {
            Some(fit) => self.session.better_warm(sensor, fit, &units, record.triad(sensor), axes),
            None => self.session.better(sensor, &units, record.triad(sensor), axes),
        }
    }

    /// What became of the sensor that was next; whether it was the last one.
    pub(super) fn settle(&mut self, outcome: CaptureOutcome) -> bool {
        self.warmth.clear();
        let _room = self.outcomes.push(outcome);
        self.outcomes.is_full()
    }

    /// Any sensor's calibration is in use.
    pub(super) fn is_adopted(&self) -> bool {
        self.outcomes.contains(&CaptureOutcome::Adopted)
    }

    /// How far it is.
    #[inline(never)]
    pub(super) fn state(&self) -> CaptureState {
        CaptureState { samples: self.taken, guide: self.session.guide() }
    }
}

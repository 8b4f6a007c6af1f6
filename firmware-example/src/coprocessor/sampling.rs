//! Samples of the board and of the link: corrected, and into the session under way or into the drift watch.

use embedded_storage::nor_flash::NorFlash;
use imucal_core::{
    link::{Asked, CaptureOutcome, CaptureTask, Fault, RawSample, RawSamples, Reply},
    record::{Date, Sensor},
    session::store::NotStored,
    watch,
};

use super::{Device, Due, Job};
use crate::board::{Clock, Sample, SampleSource};

impl<
    F: NorFlash,
    C: Clock,
    S: SampleSource,
    const POINTS: usize,
    const POSES: usize,
    const TURNS: usize,
    const BLOCKS: usize,
    const PARTICLES: usize,
    const ALONE: usize,
> Device<'_, F, C, S, POINTS, POSES, TURNS, BLOCKS, PARTICLES, ALONE>
{
    #[inline(never)]
    pub(super) fn start_capture(&mut self, asked: Asked, task: CaptureTask) -> Result<(), Fault> {
        for (sensor, of) in Sensor::ALL.into_iter().zip(&task.sensors) {
            self.calibration.check_unit(sensor, of.unit_in)?;
        }
        self.alone.as_mut().ok_or(Fault::Unsuited)?.begin(task)?;
        self.capture(asked)
    }

    /// Says how far the session is.
    #[inline(never)]
    pub(super) fn capture(&mut self, asked: Asked) -> Result<(), Fault> {
        let state = self.capture_state();
        self.send(asked, &state);
        Ok(())
    }

    pub(super) fn capture_state(&mut self) -> Reply<'static> {
        let alone = self.alone.as_mut();
        alone
            .and_then(|alone| alone.capture())
            .map_or(Reply::Fault(Fault::NotReady), |capture| Reply::Capture(capture.state()))
    }

    /// Takes samples of the link, one in each turn.
    #[inline(never)]
    pub(super) fn samples(&mut self, asked: Asked, index: u16, samples: RawSamples) -> Result<(), Fault> {
        let alone = self.alone.as_mut().ok_or(Fault::Unsuited)?;
        let expected = alone.next();
        if index != expected {
            return Err(Fault::OutOfSequence { expected });
        }
        let mut reversed = samples;
        reversed.reverse();
        self.job = Job::Sampling(asked, reversed);
        Ok(())
    }

    /// The next of the samples that a request has brought, and one slice of the session's work: as much as a loop that
    /// reads its own sensor would do.
    #[inline(never)]
    pub(super) fn take_next(&mut self) {
        let Job::Sampling(asked, samples) = &mut self.job else { return };
        let asked = *asked;
        if let Some(sample) = samples.pop() {
            self.observe(&sample);
            return;
        }
        let due = if self.capture_is_on() { Due::Capture } else { Due::Done };
        self.end(asked, due);
    }

    fn capture_is_on(&mut self) -> bool {
        self.alone.as_mut().is_some_and(|alone| alone.capture().is_some())
    }

    /// A sample of the link.
    fn observe(&mut self, sample: &RawSample) {
        let Some(alone) = self.alone.as_mut() else { return };
        if let Some(capture) = alone.capture() {
            capture.push(sample);
            capture.session.work();
            return;
        }
        alone.count();
        let values = self.calibration.correct_all(&sample.raw, sample.temperature);
        alone.watch(self.calibration.record(), sample.time, &values, sample.temperature);
    }

    /// Corrects a sample of the board's own sensors.
    #[inline(never)]
    pub(super) fn take_sample(&mut self) -> bool {
        let Some(sample) = self.sensors.sample() else { return false };
        self.number = self.number.wrapping_add(1);
        let mut values = self.calibration.correct_all(&sample.raw, sample.temperature);
        self.corrected = self.corrected.saturating_add(1);
        self.observe_own(&sample, &values);
        if let Some(alone) = &self.alone {
            alone.take_bias_of_the_day_off(&mut values);
        }
        self.pass_on(&values);
        true
    }

    /// Sends a corrected sample, if its turn in a stream has come.
    fn pass_on(&mut self, values: &[Option<[f32; 3]>; 3]) {
        // A session that is over takes its stream along.
        self.stream = self.stream.filter(|stream| self.guard.is_current(&stream.asked));
        let Some(stream) = &mut self.stream else { return };
        stream.left = stream.left.saturating_sub(1);
        // A stream never waits: what the link does not take is left out, and the number shows it.
        if stream.left == 0 {
            stream.left = stream.every;
            let (asked, number) = (stream.asked, self.number);
            if self.outgoing.is_free() {
                self.send(asked, &Reply::Sample { number, values: *values });
            }
        }
    }

    /// A sample of the board's own, with its corrected values. A rest of it gives the gyroscope's bias of the day.
    fn observe_own(&mut self, sample: &Sample, values: &[Option<[f32; 3]>; 3]) {
        let Some(alone) = self.alone.as_mut() else { return };
        let time = sample.time.unwrap_or_else(|| u64::from(self.clock.uptime()) * 1_000);
        let temperature = sample.temperature;
        if let Some(capture) = alone.capture() {
            capture.push(&RawSample { time, raw: sample.raw, temperature });
        } else if let Some(rate) = alone.watch(self.calibration.record(), time, values, temperature) {
            alone.found_at_rest(rate);
        }
    }

    /// One slice of the fits of a session to which the board's own sensors bring samples.
    pub(super) fn work_at_capture(&mut self) -> bool {
        let capture = self.alone.as_mut().and_then(|alone| alone.capture());
        capture.is_some_and(|capture| capture.session.work())
    }

    /// Ends the session; of one that is over says again what it came to.
    #[inline(never)]
    pub(super) fn finish_capture(&mut self, asked: Asked, date: Date) -> Result<(), Fault> {
        let alone = self.alone.as_mut().ok_or(Fault::Unsuited)?;
        if let Some(outcomes) = alone.outcomes() {
            self.send(asked, &Reply::Captured(outcomes));
            return Ok(());
        }
        alone.capture().ok_or(Fault::NotReady)?.session.finish();
        self.job = Job::Closing(asked, date);
        Ok(())
    }

    /// What the session that is over came to.
    pub(super) fn captured(&self) -> Reply<'static> {
        let outcomes = self.alone.as_ref().and_then(|alone| alone.outcomes());
        outcomes.map_or(Reply::Fault(Fault::NotReady), Reply::Captured)
    }

    /// A slice of the last fits; after them what is surer is taken, a sensor in a slice.
    #[inline(never)]
    pub(super) fn close_capture(&mut self, asked: Asked, date: Date) {
        if self.work_at_capture() {
            return;
        }
        let Some(capture) = self.alone.as_mut().and_then(|alone| alone.capture()) else {
            return self.end(asked, Due::Captured);
        };
        let Some(sensor) = capture.close() else { return };
        let outcome = self.adopt(sensor, date);
        let Some(capture) = self.alone.as_mut().and_then(|alone| alone.capture()) else { return };
        if capture.settle(outcome) {
            if capture.is_adopted() {
                self.forget_watch();
            }
            self.end(asked, Due::Captured);
        }
    }

    /// Takes what the session has found of a sensor, if it is surer than what is in use.
    #[inline(never)]
    fn adopt(&mut self, sensor: Sensor, date: Date) -> CaptureOutcome {
        let Some(capture) = self.alone.as_mut().and_then(|alone| alone.capture()) else {
            return CaptureOutcome::TooLittle;
        };
        if capture.task.sensors.get(sensor as usize).is_none_or(|of| of.target <= 0.0) {
            return CaptureOutcome::TooLittle;
        }
        match capture.better(sensor, self.calibration.record()) {
            Err(NotStored::NoEstimate) => CaptureOutcome::TooLittle,
            Err(NotStored::Refused(refusal)) => CaptureOutcome::Refused(refusal),
            Err(NotStored::Surer { stored, new }) => CaptureOutcome::Surer { stored, new },
            Err(NotStored::HigherOrder) => CaptureOutcome::HigherOrder,
            Err(NotStored::OwnAxes) => CaptureOutcome::OwnAxes,
            Err(NotStored::OtherAxes { strain, most }) => CaptureOutcome::OtherAxes { strain, most },
            Err(NotStored::OtherUnit) => CaptureOutcome::OtherUnit,
            Ok(triad) => match self.calibration.adopt(sensor, &triad, date) {
                Ok(()) => CaptureOutcome::Adopted,
                Err(Fault::Implausible(defect)) => CaptureOutcome::Implausible(defect),
                Err(_) => CaptureOutcome::TooLittle,
            },
        }
    }

    pub(super) fn abort_capture(&mut self, asked: Asked) -> Result<(), Fault> {
        if let Some(alone) = self.alone.as_mut() {
            alone.end();
        }
        self.done(asked)
    }

    /// The record in use is another: its watch begins again.
    pub(super) fn forget_watch(&mut self) {
        if let Some(alone) = self.alone.as_mut() {
            alone.forget_watch();
        }
    }

    /// Says what the watch has seen.
    #[inline(never)]
    pub(super) fn watch(&mut self, asked: Asked) -> Result<(), Fault> {
        let alone = self.alone.as_mut().ok_or(Fault::Unsuited)?;
        let summary = alone.summary().ok_or(Fault::NotReady)?;
        let mut buffer = [0; watch::MAX_LEN];
        let bytes = watch::encode(&summary, &mut buffer).map_err(|_| Fault::NotReady)?;
        self.send(asked, &Reply::Watch(bytes));
        Ok(())
    }
}

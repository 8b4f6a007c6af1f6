//! What the co-processor does with each request.

use embedded_storage::nor_flash::NorFlash;
use imucal_core::{
    link::{Asked, Fault, FitTask, Identity, Observation, Reply, Request, Status, Values},
    record::{self, Date, Sensor},
};

use super::{Device, Due, Job, Stream, calibration};
use crate::{
    board::{Clock, SampleSource},
    fitting::Fitting,
    storage::StorageError,
};

/// Version of the firmware.
const FIRMWARE: (u8, u8, u8) = (0, 1, 0);
/// Slices of a fit that is to go on to its end.
const TO_THE_END: u16 = u16::MAX;

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
    /// Does what a request asks for, or says why not.
    pub(super) fn handle(&mut self, asked: Asked, request: Request<'_>) {
        let done = match request {
            Request::Identify { .. } => self.identify(asked),
            Request::Status => self.status(asked),
            Request::GetRecord => self.get_record(asked),
            Request::Correct { sensor, temperature, raw } => self.correct(asked, sensor, temperature, &raw),
            Request::Stream { every } => {
                let stream = Stream { asked, every, left: every };
                self.stream = Some(stream).filter(|stream| stream.every > 0);
                self.done(asked)
            }
            Request::LastReset => {
                self.send(asked, &Reply::LastReset(self.last_reset));
                Ok(())
            }
            Request::AbortFit => self.abort(asked),
            Request::Lock | Request::Unlock => self.done(asked),
            Request::Capture => self.capture(asked),
            Request::Watch => self.watch(asked),
            Request::BiasOfTheDay => {
                let bias = self.alone.as_ref().and_then(|alone| alone.bias_of_the_day());
                self.send(asked, &Reply::BiasOfTheDay(bias));
                Ok(())
            }
            _ if self.is_busy() => Err(Fault::Busy),
            Request::PutRecord { record, replace } => self.put_record(asked, record, replace),
            Request::Store { replace } => self.store(asked, replace),
            Request::StartFit(task) => self.start_fit(asked, task),
            Request::Feed { index, observations } => self.feed(asked, index, &observations),
            Request::StepFit { slices } => self.step_fit(asked, slices),
            Request::FinishFit { date } => self.finish_fit(asked, date),
            Request::StartCapture(task) => self.start_capture(asked, task),
            Request::Samples { index, samples } => self.samples(asked, index, samples),
            Request::FinishCapture { date } => self.finish_capture(asked, date),
            Request::AbortCapture => self.abort_capture(asked),
            Request::RestorePrevious { of } => self.restore_previous(asked, of),
            _ => Err(Fault::Malformed),
        };
        if let Err(fault) = done {
            self.refuse(asked, fault);
        }
    }

    fn is_busy(&self) -> bool {
        !matches!(self.job, Job::None) || self.due.is_some()
    }

    pub(super) fn done(&mut self, asked: Asked) -> Result<(), Fault> {
        self.send(asked, &Reply::Done);
        Ok(())
    }

    #[inline(never)]
    fn identify(&mut self, asked: Asked) -> Result<(), Fault> {
        let identity = Identity {
            unit: self.calibration.unit.clone(),
            firmware: FIRMWARE,
            record_version: calibration::VERSION,
            nonce: self.guard.nonce(),
            keyed: self.guard.is_keyed(),
            capacity: Fitting::<POINTS, POSES, TURNS, BLOCKS, PARTICLES>::CAPACITY,
        };
        self.send(asked, &Reply::Identity(identity));
        Ok(())
    }

    #[inline(never)]
    fn status(&mut self, asked: Asked) -> Result<(), Fault> {
        let newest = self.slots.as_ref().and_then(|slots| slots.newest());
        let status = Status {
            uptime: self.clock.uptime(),
            record: self.calibration.state,
            sequence: newest.map_or(0, |newest| newest.sequence),
            unsaved: self.calibration.unsaved,
            locked: self.guard.is_locked(),
            corrected: self.corrected,
            refused: self.refused,
            stack: (self.stack)(),
            fit: self.fitting.progress(),
        };
        self.send(asked, &Reply::Status(status));
        Ok(())
    }

    #[inline(never)]
    fn get_record(&mut self, asked: Asked) -> Result<(), Fault> {
        let mut buffer = [0; record::MAX_LEN];
        let slots = self.slots.as_mut().ok_or(Fault::Flash)?;
        if slots.is_newer() {
            return Err(Fault::NewerFormat);
        }
        if slots.newest().is_none() {
            return Err(Fault::NoRecord);
        }
        let bytes = slots.read(&mut buffer).map_err(|error| match error {
            StorageError::TooLong => Fault::NewerFormat,
            _ => Fault::Flash,
        })?;
        self.send(asked, &Reply::Record(bytes));
        Ok(())
    }

    #[inline(never)]
    fn correct(&mut self, asked: Asked, sensor: Sensor, temperature: f32, raw: &Values) -> Result<(), Fault> {
        let mut values = Values::new();
        for raw in raw {
            let value = self.calibration.correct(sensor, *raw, temperature).ok_or(Fault::NoRecord)?;
            values.push(value).map_err(|_| Fault::Full)?;
        }
        self.corrected = self.corrected.saturating_add(raw.len() as u32);
        self.send(asked, &Reply::Corrected(values));
        Ok(())
    }

    #[inline(never)]
    fn put_record(&mut self, asked: Asked, bytes: &[u8], replace: bool) -> Result<(), Fault> {
        match self.calibration.refusal(bytes) {
            Some(fault) => Err(fault),
            None => self.write(asked, bytes, replace),
        }
    }

    #[inline(never)]
    fn store(&mut self, asked: Asked, replace: bool) -> Result<(), Fault> {
        if !self.calibration.is_in_use() {
            return Err(Fault::NoRecord);
        }
        let mut buffer = [0xFF; record::MAX_LEN];
        let length = self.calibration.encode(&mut buffer)?.len();
        self.write(asked, buffer.get(..length).unwrap_or_default(), replace)
    }

    fn write(&mut self, asked: Asked, bytes: &[u8], replace: bool) -> Result<(), Fault> {
        if self.calibration.is_occupied() && !replace {
            return Err(Fault::Occupied);
        }
        let slots = self.slots.as_mut().ok_or(Fault::Flash)?;
        let writing = slots.begin(bytes).map_err(|error| match error {
            StorageError::TooLong => Fault::BadRecord,
            _ => Fault::Flash,
        })?;
        self.job = Job::Storing(asked, writing);
        Ok(())
    }

    /// Goes back in the next turn, from the bottom of the stack.
    fn restore_previous(&mut self, asked: Asked, of: u32) -> Result<(), Fault> {
        let slots = self.slots.as_ref().ok_or(Fault::Flash)?;
        let sequence = slots.newest().ok_or(Fault::NoRecord)?.sequence;
        if sequence == of {
            self.job = Job::Restoring(asked);
        } else {
            self.send(asked, &Reply::Stored { sequence });
        }
        Ok(())
    }

    /// The record before the stored one takes its place, as a new one: the stored one is then the one before.
    #[inline(never)]
    pub(super) fn restore(&mut self, asked: Asked) -> Result<(), Fault> {
        let mut buffer = [0; record::MAX_LEN];
        let slots = self.slots.as_mut().ok_or(Fault::Flash)?;
        let bytes = slots.read_previous(&mut buffer).map_err(|error| match error {
            StorageError::TooLong => Fault::NewerFormat,
            _ => Fault::Flash,
        })?;
        if bytes.is_empty() {
            return Err(Fault::NoRecord);
        }
        self.put_record(asked, bytes, false)
    }

    fn start_fit(&mut self, asked: Asked, task: FitTask) -> Result<(), Fault> {
        self.calibration.check_unit(task.model.sensor(), task.unit_in)?;
        self.fitting.begin(task)?;
        self.send(asked, &self.progress());
        Ok(())
    }

    #[inline(never)]
    fn feed(&mut self, asked: Asked, index: u16, observations: &[Observation]) -> Result<(), Fault> {
        let expected = self.fitting.progress().ok_or(Fault::NotReady)?.observations;
        if index != expected {
            return Err(Fault::OutOfSequence { expected });
        }
        // Up to the first that is not taken: the answer to whoever goes on has the index.
        observations.iter().try_for_each(|observation| self.fitting.take(observation))?;
        self.send(asked, &self.progress());
        Ok(())
    }

    fn step_fit(&mut self, asked: Asked, slices: u16) -> Result<(), Fault> {
        self.fitting.progress().ok_or(Fault::NotReady)?;
        self.job = Job::Stepping(asked, Some(slices).filter(|slices| *slices != TO_THE_END));
        Ok(())
    }

    /// Judges in the next turn, from the bottom of the stack.
    fn finish_fit(&mut self, asked: Asked, date: Date) -> Result<(), Fault> {
        if !self.fitting.progress().is_some_and(|progress| progress.stopped) {
            return Err(Fault::NotReady);
        }
        self.job = Job::Judging(asked, date);
        Ok(())
    }

    #[inline(never)]
    pub(super) fn answer_report(&mut self, asked: Asked) -> bool {
        let report = self.finished.take().map(|finished| Reply::Report(finished.report));
        self.send(asked, &report.unwrap_or(Reply::Fault(Fault::NotReady)));
        true
    }

    #[inline(never)]
    pub(super) fn judge(&mut self, asked: Asked, date: Date) {
        self.finished = self.fitting.finish().ok();
        let accepted = self.finished.as_ref().and_then(|finished| finished.accepted.as_ref());
        let adopted = accepted.map(|(sensor, triad)| self.calibration.adopt(*sensor, triad, date));
        if adopted == Some(Ok(())) {
            self.forget_watch();
        }
        self.end(asked, adopted.unwrap_or(Ok(())).map_or_else(Due::Fault, |()| Due::Report));
    }

    /// Gives the fit up; a request that waits for it is answered first come, later.
    fn abort(&mut self, asked: Asked) -> Result<(), Fault> {
        if let Job::Stepping(waiting, _) = self.job {
            self.end(waiting, Due::Fault(Fault::NotReady));
        }
        self.fitting.clear();
        self.done(asked)
    }

    pub(super) fn progress(&self) -> Reply<'static> {
        self.fitting.progress().map_or(Reply::Fault(Fault::NotReady), Reply::Progress)
    }
}

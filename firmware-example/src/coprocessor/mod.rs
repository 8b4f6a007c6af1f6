//! The co-processor: corrects samples, talks to its host, fits and stores, and never waits.
//!
//! ```text
//! poll:  send what the link takes → answer what is due → take a frame → correct a sample → or else: a slice of work
//! ```
//!
//! Work waits for bytes and samples, unless they never end: what came during a long slice is caught up before the next.
//! The board keeps it until then. A slice takes as long as `tests/device_cost.rs` says of an iteration or a judgement.
//!
//! A slice is one flash operation of [`crate::storage`] or one slice of [`crate::fitting`]. A request that takes many
//! slices is answered when it is done; until then one that would need its result is [`Fault::Busy`], and samples are
//! corrected, from the sensors and from the host alike. The rules of the link stand in [`imucal_core::link`].
//!
//! With memory for it ([`Alone`]) raw samples also go into a calibration session, where one was begun, and otherwise
//! into the drift watch. A session is lost with the power; its host sees that by [`Fault::NotReady`], and the record
//! that was stored before is in use.

mod alone;
mod calibration;
mod job;
mod outgoing;
mod requests;
mod sampling;

use embedded_storage::nor_flash::NorFlash;
use imucal_core::{
    link::{
        Asked, Fault, FitProgress, Frame, FrameError, Guard, LastReset, Receiver, RecordState, Reply, split,
    },
    record::{self, SensorIdentity},
};

use crate::{
    board::{Board, ByteLink, Clock, SampleSource},
    fitting::{Finished, Fitting, Memory},
    storage::{Slots, StorageError},
};
pub use alone::Alone;
use calibration::Calibration;
use job::{Due, Job, Stream};
use outgoing::Outgoing;

/// Bytes taken from the link in one turn, so that a flood of them leaves time for samples.
const BYTES_A_TURN: usize = 64;

/// Turns with bytes or samples after which a slice of work is done all the same.
const TURNS_WITHOUT_WORK: u8 = 32;

/// The co-processor on its board. The sizes are those of [`Memory`].
#[derive(Debug)]
pub struct Coprocessor<
    'a,
    L: ByteLink,
    F: NorFlash,
    C: Clock,
    S: SampleSource,
    const POINTS: usize,
    const POSES: usize,
    const TURNS: usize,
    const BLOCKS: usize,
    const PARTICLES: usize,
    const ALONE: usize = 0,
> {
    link: L,
    receiver: Receiver,
    /// Apart from the receiver, whose bytes a request borrows.
    device: Device<'a, F, C, S, POINTS, POSES, TURNS, BLOCKS, PARTICLES, ALONE>,
}

/// All but the way in.
#[derive(Debug)]
struct Device<
    'a,
    F: NorFlash,
    C: Clock,
    S: SampleSource,
    const POINTS: usize,
    const POSES: usize,
    const TURNS: usize,
    const BLOCKS: usize,
    const PARTICLES: usize,
    const ALONE: usize,
> {
    clock: C,
    sensors: S,
    stack: fn() -> Option<u32>,
    last_reset: LastReset,
    /// `None` where the flash cannot be used.
    slots: Option<Slots<F>>,
    outgoing: Outgoing,
    calibration: Calibration,
    fitting: Fitting<'a, POINTS, POSES, TURNS, BLOCKS, PARTICLES>,
    alone: Option<&'a mut Alone<ALONE>>,
    job: Job,
    /// Turns that bytes or samples have kept the work waiting.
    waited: u8,
    due: Option<(Asked, Due)>,
    /// The last fit that was judged.
    finished: Option<Finished>,
    stream: Option<Stream>,
    guard: Guard<'a>,
    refused: u32,
    corrected: u32,
    number: u32,
}

impl<
    'a,
    L: ByteLink,
    F: NorFlash,
    C: Clock,
    S: SampleSource,
    const POINTS: usize,
    const POSES: usize,
    const TURNS: usize,
    const BLOCKS: usize,
    const PARTICLES: usize,
> Coprocessor<'a, L, F, C, S, POINTS, POSES, TURNS, BLOCKS, PARTICLES, 0>
{
    /// Looks for the record in the flash; the first turn reads it. `guard` is of this start alone.
    pub fn new(
        board: Board<L, F, C, S>,
        unit: SensorIdentity,
        guard: Guard<'a>,
        memory: &'a mut Memory<POINTS, POSES, TURNS, BLOCKS, PARTICLES>,
    ) -> Self {
        Self::start(board, unit, guard, memory, None)
    }
}

impl<
    'a,
    L: ByteLink,
    F: NorFlash,
    C: Clock,
    S: SampleSource,
    const POINTS: usize,
    const POSES: usize,
    const TURNS: usize,
    const BLOCKS: usize,
    const PARTICLES: usize,
    const ALONE: usize,
> Coprocessor<'a, L, F, C, S, POINTS, POSES, TURNS, BLOCKS, PARTICLES, ALONE>
{
    /// The same with memory for a session and a watch.
    pub fn with_sessions(
        board: Board<L, F, C, S>,
        unit: SensorIdentity,
        guard: Guard<'a>,
        memory: &'a mut Memory<POINTS, POSES, TURNS, BLOCKS, PARTICLES>,
        alone: &'a mut Alone<ALONE>,
    ) -> Self {
        Self::start(board, unit, guard, memory, Some(alone))
    }

    fn start(
        board: Board<L, F, C, S>,
        unit: SensorIdentity,
        guard: Guard<'a>,
        memory: &'a mut Memory<POINTS, POSES, TURNS, BLOCKS, PARTICLES>,
        alone: Option<&'a mut Alone<ALONE>>,
    ) -> Self {
        let Board { link, flash, clock, sensors, stack, last_reset } = board;
        let slots = Slots::open(flash).ok();
        let calibration = Calibration::new(unit, sensors.units());
        let device = Device {
            clock,
            sensors,
            stack,
            last_reset,
            slots,
            outgoing: Outgoing::new(),
            calibration,
            fitting: Fitting::new(memory),
            alone,
            job: Job::Booting,
            waited: 0,
            due: None,
            finished: None,
            stream: None,
            guard,
            refused: 0,
            corrected: 0,
            number: 0,
        };
        Self { link, receiver: Receiver::default(), device }
    }

    /// One turn; to be called over and over. True where there was something to do.
    pub fn poll(&mut self) -> bool {
        if matches!(self.device.job, Job::Booting) {
            self.device.boot();
        }
        self.device.clock.uptime();
        self.device.outgoing.flush(&mut self.link);
        let mut busy = !self.device.outgoing.is_free();
        busy |= self.device.answer_due();
        let came = self.listen() | self.device.take_sample();
        busy | came | self.device.work_or_wait(came)
    }

    /// How far the fit is; `None` without one.
    pub fn fit(&self) -> Option<FitProgress> {
        self.device.fitting.progress()
    }

    /// Takes bytes up to the end of a frame, while there is room for its answer; whether there were any.
    fn listen(&mut self) -> bool {
        for count in 0..BYTES_A_TURN {
            if !self.device.outgoing.is_free() {
                return count > 0;
            }
            let Some(byte) = self.link.receive() else { return count > 0 };
            if let Some(frame) = self.receiver.push(byte) {
                self.device.receive(frame);
            }
        }
        true
    }

    /// The board's link and flash, after all is done; no flash where it could not be used.
    pub fn into_parts(self) -> (L, Option<F>) {
        (self.link, self.device.slots.map(Slots::close))
    }
}

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
    /// Uses what the flash holds.
    #[inline(never)]
    fn boot(&mut self) {
        self.job = Job::None;
        let Some(slots) = &mut self.slots else { return };
        if slots.is_newer() {
            self.calibration.state = RecordState::NewerFormat;
            return;
        }
        let mut buffer = [0; record::MAX_LEN];
        let state = match slots.read(&mut buffer) {
            Ok([]) => RecordState::Empty,
            Ok(bytes) => self.calibration.load(bytes),
            Err(StorageError::TooLong) => RecordState::NewerFormat,
            Err(_) => RecordState::Unusable,
        };
        self.calibration.state = match state {
            RecordState::InUse | RecordState::Unconfirmed if slots.lost().is_some() => RecordState::Previous,
            RecordState::Empty if slots.lost().is_some() => RecordState::Lost,
            state => state,
        };
    }

    /// Sends an answer that has waited for the link.
    #[inline(never)]
    fn answer_due(&mut self) -> bool {
        if !self.outgoing.is_free() {
            return false;
        }
        let Some((asked, due)) = self.due.take() else { return false };
        let reply = match due {
            Due::Stored(sequence) => Reply::Stored { sequence },
            Due::Progress => self.progress(),
            Due::Fault(fault) => Reply::Fault(fault),
            Due::Report => return self.answer_report(asked),
            Due::Capture => self.capture_state(),
            Due::Captured => self.captured(),
            Due::Done => Reply::Done,
        };
        self.send(asked, &reply);
        true
    }

    /// Apart from who waits for bytes: a request takes its memory only while it is worked at.
    #[inline(never)]
    fn receive(&mut self, frame: Result<&[u8], FrameError>) {
        match frame.and_then(split) {
            Ok(frame) if self.guard.is_for_us(&frame) => self.take(&frame),
            // An echo, or another device: an answer might be answered for ever.
            Ok(_) | Err(FrameError::Refused { .. }) => {}
            Err(FrameError::Version { id, .. }) => {
                self.refused = self.refused.saturating_add(1);
                self.outgoing.refuse_version(id);
            }
            Err(error) if self.guard.may_complain() => self.refuse(Asked::NOBODY, of_frame(error)),
            Err(_) => self.refused = self.refused.saturating_add(1),
        }
    }

    fn take(&mut self, frame: &Frame<'_>) {
        let request = match frame.read() {
            Ok(request) => request,
            Err(error) => return self.refuse(Asked::by(&frame.header), of_frame(error)),
        };
        match self.guard.admit(frame, &request) {
            Ok(asked) => self.handle(asked, request),
            Err(fault) => self.refuse(Asked::by(&frame.header), fault),
        }
    }

    fn refuse(&mut self, asked: Asked, fault: Fault) {
        self.refused = self.refused.saturating_add(1);
        self.send(asked, &Reply::Fault(fault));
    }

    fn send(&mut self, asked: Asked, reply: &Reply<'_>) {
        self.outgoing.send(&asked, self.guard.seal_for(&asked), reply);
    }

    /// A slice, unless something came, and not too often.
    fn work_or_wait(&mut self, came: bool) -> bool {
        if came && self.waited < TURNS_WITHOUT_WORK {
            self.waited += 1;
            return true;
        }
        self.waited = 0;
        self.work()
    }

    /// One slice of what takes many.
    #[inline(never)]
    fn work(&mut self) -> bool {
        match &mut self.job {
            Job::Booting => return false,
            Job::None => return self.work_at_capture(),
            Job::Storing(asked, writing) => {
                let asked = *asked;
                let done = match &mut self.slots {
                    Some(slots) => slots.step(writing),
                    None => return false,
                };
                match done {
                    Ok(None) => {}
                    Ok(Some(sequence)) => self.stored(asked, sequence),
                    Err(_) => self.end(asked, Due::Fault(Fault::Flash)),
                }
            }
            Job::Stepping(asked, left) => {
                let asked = *asked;
                let stopped = self.fitting.step();
                if let Some(left) = left {
                    *left = left.saturating_sub(1);
                }
                if stopped || *left == Some(0) {
                    self.end(asked, Due::Progress);
                }
            }
            Job::Judging(asked, date) => {
                let (asked, date) = (*asked, *date);
                self.judge(asked, date);
            }
            Job::Restoring(asked) => {
                let asked = *asked;
                if let Err(fault) = self.restore(asked) {
                    self.end(asked, Due::Fault(fault));
                }
            }
            Job::Sampling(..) => self.take_next(),
            Job::Closing(asked, date) => {
                let (asked, date) = (*asked, *date);
                self.close_capture(asked, date);
            }
        }
        true
    }

    fn end(&mut self, asked: Asked, due: Due) {
        self.job = Job::None;
        self.due = Some((asked, due));
    }

    /// A record is whole in flash: it is in use from now on.
    #[inline(never)]
    fn stored(&mut self, asked: Asked, sequence: u32) {
        let mut buffer = [0; record::MAX_LEN];
        let bytes = self.slots.as_mut().and_then(|slots| slots.read(&mut buffer).ok());
        self.calibration.state = bytes.map_or(RecordState::Unusable, |bytes| self.calibration.load(bytes));
        self.calibration.unsaved = false;
        self.forget_watch();
        self.end(asked, Due::Stored(sequence));
    }
}

fn of_frame(error: FrameError) -> Fault {
    match error {
        FrameError::Oversized => Fault::Oversized,
        FrameError::Damaged => Fault::Damaged,
        _ => Fault::Malformed,
    }
}

//! What lies between the tasks of an executor and the co-processor, which never waits.
//!
//! ```text
//! line ─ receive ─▶ incoming ─▶┌────────────┐
//! line ◀ transmit ─ outgoing ◀─│ poll, in a │
//! IMU ───── offer ─▶ samples ─▶│ task: work │
//!                              └────────────┘
//! ```
//!
//! Each of `receive`, `transmit` and `work` is the whole of a task, and none is dropped in the middle of a read: no byte
//! is lost by that. `offer` is called by whoever reads the sensors. The queues take up what comes while a slice of a fit
//! holds the processor, if the line's and the sensors' tasks run at a higher priority than `work`, or their drivers keep it.

use core::cell::Cell;

use embassy_futures::{select::select, yield_now};
use embassy_sync::{
    blocking_mutex::{Mutex, raw::RawMutex},
    channel::Channel,
    pipe::Pipe,
    signal::Signal,
};
use embedded_io_async::{Read, Write};
use imucal_core::record::RawUnit;

use super::byte_io::passes;
use crate::board::{ByteLink, Sample, SampleSource};

/// Bytes of one read or write of the line.
const CHUNK: usize = 64;

/// What was lost on the way so far; each up to `u32::MAX`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Losses {
    /// Errors of the line while it was read.
    pub reads: u32,
    /// Errors of the line while it was written; what was to be written then is left out.
    pub writes: u32,
    /// Samples that newer ones have pushed out.
    pub samples: u32,
}

/// Queues of `IN` and `OUT` bytes and of `SAMPLES` samples. `M`: `NoopRawMutex` where all tasks are one executor's;
/// `CriticalSectionRawMutex` where they run at several priorities.
pub struct Exchange<M: RawMutex, const IN: usize, const OUT: usize, const SAMPLES: usize> {
    incoming: Pipe<M, IN>,
    outgoing: Pipe<M, OUT>,
    samples: Channel<M, Sample, SAMPLES>,
    /// There is something to do.
    news: Signal<M, ()>,
    losses: Mutex<M, Cell<Losses>>,
}

impl<M: RawMutex, const IN: usize, const OUT: usize, const SAMPLES: usize> Default
    for Exchange<M, IN, OUT, SAMPLES>
{
    fn default() -> Self {
        Self::new()
    }
}

impl<M: RawMutex, const IN: usize, const OUT: usize, const SAMPLES: usize> Exchange<M, IN, OUT, SAMPLES> {
    /// Empty.
    pub const fn new() -> Self {
        // A queue of nothing would keep every byte, or every sample, for ever.
        const { assert!(IN > 0 && OUT > 0 && SAMPLES > 0) };
        Self {
            incoming: Pipe::new(),
            outgoing: Pipe::new(),
            samples: Channel::new(),
            news: Signal::new(),
            losses: Mutex::new(Cell::new(Losses { reads: 0, writes: 0, samples: 0 })),
        }
    }

    /// Reads the line; ends at its end of file, which a UART has not. After an error it reads on.
    pub async fn receive(&self, mut line: impl Read) {
        let mut bytes = [0; CHUNK];
        loop {
            match line.read(&mut bytes).await {
                Ok(0) => return,
                Ok(count) => self.take_all(bytes.get(..count).unwrap_or_default()).await,
                Err(error) => {
                    if !passes(&error) {
                        self.lose(|losses| &mut losses.reads);
                    }
                    // A driver that fails at once, over and over, leaves time for the others.
                    yield_now().await;
                }
            }
        }
    }

    async fn take_all(&self, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            let taken = self.incoming.write(bytes).await;
            bytes = bytes.get(taken..).unwrap_or_default();
            self.news.signal(());
        }
    }

    /// Writes the line, for ever. After an error it leaves out what it had to write then: that frame fails its checksum,
    /// and the host asks again.
    pub async fn transmit(&self, mut line: impl Write) {
        let mut bytes = [0; CHUNK];
        loop {
            let count = self.outgoing.read(&mut bytes).await;
            self.news.signal(());
            let mut left = bytes.get(..count).unwrap_or_default();
            while !left.is_empty() {
                match line.write(left).await {
                    // Of nothing: a driver may not do that, and would do it again.
                    Ok(0) => left = self.leave_out(),
                    Ok(taken) => left = left.get(taken..).unwrap_or_default(),
                    Err(error) if passes(&error) => yield_now().await,
                    Err(_) => left = self.leave_out(),
                }
            }
            if self.outgoing.is_empty() && line.flush().await.is_err_and(|error| !passes(&error)) {
                self.lose(|losses| &mut losses.writes);
            }
        }
    }

    fn leave_out(&self) -> &'static [u8] {
        self.lose(|losses| &mut losses.writes);
        &[]
    }

    /// Takes a sample, without a wait; the oldest gives way where there is no room.
    pub fn offer(&self, sample: Sample) {
        if self.samples.is_full() && self.samples.try_receive().is_ok() {
            self.lose(|losses| &mut losses.samples);
        }
        if self.samples.try_send(sample).is_err() {
            self.lose(|losses| &mut losses.samples);
        }
        self.news.signal(());
    }

    /// Lets the co-processor work, for ever: `poll` is its own, or does it and feeds a watchdog. Between two turns the
    /// tasks of the same executor run. Without work it waits for news, or for `pause` to end, which is shorter than the
    /// watchdog's patience and than a round of the clock.
    pub async fn work(&self, mut poll: impl FnMut() -> bool, mut pause: impl AsyncFnMut()) {
        loop {
            if poll() {
                yield_now().await;
            } else {
                select(self.news.wait(), pause()).await;
            }
        }
    }

    /// The co-processor's end of the line.
    pub const fn link(&self) -> ExchangeLink<'_, M, IN, OUT, SAMPLES> {
        ExchangeLink(self)
    }

    /// The co-processor's end of the sensors, which give these units.
    pub const fn sensors(&self, units: [Option<RawUnit>; 3]) -> ExchangeSensors<'_, M, IN, OUT, SAMPLES> {
        ExchangeSensors { exchange: self, units }
    }

    /// What was lost so far.
    pub fn losses(&self) -> Losses {
        self.losses.lock(Cell::get)
    }

    fn lose(&self, which: impl FnOnce(&mut Losses) -> &mut u32) {
        self.losses.lock(|cell| {
            let mut losses = cell.get();
            let count = which(&mut losses);
            *count = count.saturating_add(1);
            cell.set(losses);
        });
    }
}

/// [`Exchange::link`].
pub struct ExchangeLink<'a, M: RawMutex, const IN: usize, const OUT: usize, const SAMPLES: usize>(
    &'a Exchange<M, IN, OUT, SAMPLES>,
);

impl<M: RawMutex, const IN: usize, const OUT: usize, const SAMPLES: usize> ByteLink
    for ExchangeLink<'_, M, IN, OUT, SAMPLES>
{
    fn receive(&mut self) -> Option<u8> {
        let mut byte = [0];
        self.0.incoming.try_read(&mut byte).is_ok_and(|count| count > 0).then_some(byte[0])
    }

    fn send(&mut self, byte: u8) -> bool {
        self.0.outgoing.try_write(&[byte]).is_ok_and(|count| count > 0)
    }
}

/// [`Exchange::sensors`].
pub struct ExchangeSensors<'a, M: RawMutex, const IN: usize, const OUT: usize, const SAMPLES: usize> {
    exchange: &'a Exchange<M, IN, OUT, SAMPLES>,
    units: [Option<RawUnit>; 3],
}

impl<M: RawMutex, const IN: usize, const OUT: usize, const SAMPLES: usize> SampleSource
    for ExchangeSensors<'_, M, IN, OUT, SAMPLES>
{
    fn sample(&mut self) -> Option<Sample> {
        self.exchange.samples.try_receive().ok()
    }

    fn units(&self) -> [Option<RawUnit>; 3] {
        self.units
    }
}

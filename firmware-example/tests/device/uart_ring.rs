//! A record that comes over a UART while the IMU is read and the flash is erased: the image of the nRF52840, whose UART
//! writes into a ring, and as it would be with one byte kept.

use std::{cell::Cell, collections::VecDeque, rc::Rc};

use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use firmware_example::{
    board::{Board, ByteLink, Sample, SampleSource},
    coprocessor::Coprocessor,
    ring::Ring,
};
use imucal_core::{
    link::{Guard, Receiver, Reply, Request, split},
    record::RawUnit,
};

use crate::{
    bad_link::records,
    bench::{BenchMemory, LAST_RESET, SERIAL, Ticks, framed, unit},
    nor::{Nor, NorError, PAGE},
};

/// A byte at 115 200 baud, ms.
const BYTE: f64 = 10.0 / 115.2;
/// Between samples, a read of one over I²C, a turn, the erase of a page and the write of a word, ms.
const INTERVAL: f64 = 10.0;
const READ: f64 = 0.5;
const TURN: f64 = 0.02;
const ERASE: f64 = 85.0;
const WRITE: f64 = 0.041;
/// Bytes of the ring, as in `src/bin/nrf52840`.
const RING: usize = 2048;

/// Time, ms.
type Time = Rc<Cell<f64>>;

fn pass(time: &Time, span: f64) {
    time.set(time.get() + span);
}

/// What the UART keeps until the core looks.
enum Kept {
    Ring(Box<[u8; RING]>, Ring<RING>),
    One(Option<u8>),
}

/// A UART: bytes come at their time, whether anybody looks or not.
struct Uart {
    time: Time,
    coming: Rc<std::cell::RefCell<VecDeque<(f64, u8)>>>,
    counted: u32,
    kept: Kept,
    sent: Rc<std::cell::RefCell<Vec<u8>>>,
}

impl ByteLink for Uart {
    fn receive(&mut self) -> Option<u8> {
        let mut coming = self.coming.borrow_mut();
        while coming.front().is_some_and(|(at, _)| *at <= self.time.get()) {
            let (_, byte) = coming.pop_front().expect("there");
            match &mut self.kept {
                Kept::Ring(memory, _) => memory[self.counted as usize % RING] = byte,
                Kept::One(kept) => *kept = kept.or(Some(byte)),
            }
            self.counted = self.counted.wrapping_add(1);
        }
        match &mut self.kept {
            Kept::Ring(memory, ring) => ring.next(self.counted).map(|place| memory[place]),
            Kept::One(kept) => kept.take(),
        }
    }

    fn send(&mut self, byte: u8) -> bool {
        self.sent.borrow_mut().push(byte);
        true
    }
}

/// An IMU whose samples come at their time, and stop the core while they are read.
struct Imu {
    time: Time,
    next: f64,
}

impl SampleSource for Imu {
    fn sample(&mut self) -> Option<Sample> {
        if self.time.get() < self.next {
            return None;
        }
        self.next += INTERVAL;
        pass(&self.time, READ);
        Some(Sample { raw: [Some([33_000.0; 3]), Some([32_000.0; 3]), None], temperature: 25.0, time: None })
    }

    fn units(&self) -> [Option<RawUnit>; 3] {
        [Some(RawUnit::Counts), Some(RawUnit::Counts), None]
    }
}

/// Flash that stops the core while it is written.
struct Slow(Nor, Time);

impl ErrorType for Slow {
    type Error = NorError;
}

impl ReadNorFlash for Slow {
    const READ_SIZE: usize = Nor::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorError> {
        self.0.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl NorFlash for Slow {
    const WRITE_SIZE: usize = Nor::WRITE_SIZE;
    const ERASE_SIZE: usize = Nor::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorError> {
        pass(&self.1, ERASE * f64::from(to - from) / PAGE as f64);
        self.0.erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorError> {
        pass(&self.1, WRITE * bytes.len() as f64 / 4.0);
        self.0.write(offset, bytes)
    }
}

/// Of so many records, each followed at once by a request, how many are stored with both answered.
fn received(count: usize, kept: Kept) -> usize {
    let time = Time::default();
    let (coming, sent) = (Rc::default(), Rc::default());
    let link =
        Uart { time: time.clone(), coming: Rc::clone(&coming), counted: 0, kept, sent: Rc::clone(&sent) };
    let board = Board {
        link,
        flash: Slow(Nor::new(4), time.clone()),
        clock: Ticks::default(),
        sensors: Imu { time: time.clone(), next: 0.0 },
        stack: || None,
        last_reset: LAST_RESET,
    };
    let mut memory = BenchMemory::new();
    let mut device = Coprocessor::new(board, unit(SERIAL), Guard::new(None, 1), &mut memory);
    let mut receiver = Receiver::default();
    // Sends bytes at the line's speed, and gives the frames that come back within a second.
    let mut ask = |bytes: Vec<u8>, frames: usize| {
        let start = time.get();
        coming.borrow_mut().extend((1..).map(|k| start + f64::from(k) * BYTE).zip(bytes));
        let mut answers = Vec::new();
        while time.get() < start + 1_000.0 && answers.len() < frames {
            device.poll();
            pass(&time, TURN);
            for byte in sent.borrow_mut().drain(..) {
                let Some(Ok(plain)) = receiver.push(byte) else { continue };
                let frame = split(plain).expect("intact");
                let is_fault = matches!(frame.read(), Ok(Reply::Fault(_)));
                answers.push((frame.header.session, frame.header.id, is_fault));
            }
        }
        answers
    };
    // Byte by byte, so that one that keeps one byte gets a session at all.
    let identify = framed(0, 1, &Request::Identify { nonce: 1 });
    let session = (0..50).find_map(|_| ask(identify.clone(), 1).first().map(|answer| answer.0));
    let Some(session) = session else { return 0 };
    let stored = records(count as u32).into_iter().zip((1..).step_by(2)).filter(|(record, id)| {
        let put = framed(session, *id, &Request::PutRecord { record, replace: false });
        let status = framed(session, id + 1, &Request::Status);
        let answers = ask([put, status].concat(), 2);
        // Another phase against the samples.
        pass(&time, 0.05 * f64::from(*id));
        [*id, id + 1].iter().all(|id| answers.contains(&(session, *id, false)))
    });
    stored.count()
}

#[test]
fn two_hundred_of_two_hundred_records_come_while_the_imu_runs() {
    let ring = Kept::Ring(Box::new([0; RING]), Ring::new());
    assert_eq!(received(200, ring), 200);
    // The same line where the UART keeps one byte: the reads of the IMU alone take more than that.
    assert_eq!(received(20, Kept::One(None)), 0);
}

#[test]
fn a_ring_that_was_written_over_goes_on_with_what_comes_then() {
    let mut ring = Ring::<32>::new();
    assert_eq!((ring.next(3), ring.next(3), ring.next(3)), (None, Some(0), Some(1)));
    // Fifty more: what was unread is lost.
    assert_eq!((ring.next(53), ring.next(53)), (None, None));
    assert_eq!(
        (ring.next(55), ring.next(55), ring.next(55), ring.next(55)),
        (None, Some(21), Some(22), None)
    );
    // Round the counter's end.
    let mut ring = Ring::<32>::new();
    ring.next(u32::MAX);
    ring.next(u32::MAX);
    assert_eq!((ring.next(1), ring.next(1), ring.next(1), ring.next(1)), (None, Some(31), Some(0), None));
}

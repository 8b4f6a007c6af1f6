//! Drivers by the common traits of embedded Rust, slow, short and faulty ones: what a co-processor says over them.

mod byte_io;
mod exchange;
mod imu;
mod region;

use embedded_storage::nor_flash::NorFlash;
use firmware_example::{
    RECORD,
    board::{Board, ByteLink, SampleSource},
    coprocessor::Coprocessor,
};
use imucal_core::{
    link::{Guard, Header, Receiver, Reply, Request, Values, split},
    record::Sensor,
};

use crate::{
    bench::{BenchMemory, Counting, LAST_RESET, SERIAL, Ticks, Wire, framed, unit},
    nor::Nor,
};

/// Turns without anything to do after which nothing more is expected.
const PATIENCE: u32 = 2_000;

/// What a device is asked here, frame by frame: a session, a record to keep, samples to correct, the record again.
fn requests() -> Vec<Vec<u8>> {
    let first = framed(0, u32::MAX, &Request::Identify { nonce: 1 });
    let session = replies(&answers_in_peace(std::slice::from_ref(&first)))[0].0.session;
    let values: Values = (0..30).map(|k| [33_000.0 + k as f32, 32_000.0, 31_000.0]).collect();
    let correct = Request::Correct { sensor: Sensor::Accelerometer, temperature: 31.0, raw: values };
    let put = Request::PutRecord { record: RECORD, replace: false };
    let rest = [put, correct.clone(), Request::GetRecord, correct, Request::GetRecord];
    let rest = (1..).zip(&rest).map(|(id, request)| framed(session, id, request));
    [first].into_iter().chain(rest).collect()
}

fn board<L: ByteLink, F: NorFlash, S: SampleSource>(link: L, flash: F, sensors: S) -> Board<L, F, Ticks, S> {
    Board { link, flash, clock: Ticks::default(), sensors, stack: || None, last_reset: LAST_RESET }
}

/// All that a device says by this link to what a host puts on the wire behind it, frame by frame, each after the answer
/// to the one before.
fn answers(link: impl ByteLink, wire: &Wire, requests: &[Vec<u8>]) -> Vec<u8> {
    answers_of(link, Nor::new(2), wire, requests).0
}

/// The same, and its flash afterwards.
fn answers_of<F: NorFlash>(link: impl ByteLink, flash: F, wire: &Wire, requests: &[Vec<u8>]) -> (Vec<u8>, F) {
    let mut memory = BenchMemory::new();
    let board = board(link, flash, Counting::default());
    let mut device = Coprocessor::new(board, unit(SERIAL), Guard::new(None, 1), &mut memory);
    for request in requests {
        wire.to_device.borrow_mut().extend(request);
        let mut idle = 0;
        while idle < PATIENCE {
            idle = if device.poll() { 0 } else { idle + 1 };
        }
    }
    let flash = device.into_parts().1.expect("the flash serves");
    (wire.to_host.borrow_mut().drain(..).collect(), flash)
}

/// What it says over a wire without a fault.
fn answers_in_peace(requests: &[Vec<u8>]) -> Vec<u8> {
    let wire = Wire::default();
    answers(wire.clone(), &wire, requests)
}

/// The replies that arrived intact.
fn replies(bytes: &[u8]) -> Vec<(Header, String)> {
    let mut receiver = Receiver::default();
    let mut replies = Vec::new();
    for byte in bytes {
        let Some(Ok(frame)) = receiver.push(*byte) else { continue };
        let Ok(frame) = split(frame) else { continue };
        let reply: Reply<'_> = frame.read().expect("a frame that is intact has a reply");
        replies.push((frame.header, format!("{reply:?}")));
    }
    replies
}

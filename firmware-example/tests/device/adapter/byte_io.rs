//! Blocking drivers of embedded-io.

use std::collections::HashSet;

use embedded_io::{ErrorKind, ErrorType, Read, ReadReady, Write, WriteReady};
use firmware_example::{adapter::byte_io::IoLink, board::ByteLink};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{answers, answers_in_peace, replies, requests};
use crate::bench::Wire;

/// A serial driver over a wire, whose whims are drawn, and whose errors come at bytes that are named.
struct Line {
    wire: Wire,
    rng: ChaCha8Rng,
    /// Share of the calls that find it not ready, or interrupted.
    lazy: f64,
    /// Bytes, counted from 0 in each direction, that are lost by an error.
    bad_reads: HashSet<usize>,
    bad_writes: HashSet<usize>,
    read: usize,
    written: usize,
    /// A read or a write that would have had to wait.
    waited: bool,
}

impl Line {
    fn new(wire: Wire, seed: u64, lazy: f64) -> Self {
        Self {
            wire,
            rng: ChaCha8Rng::seed_from_u64(seed),
            lazy,
            bad_reads: HashSet::new(),
            bad_writes: HashSet::new(),
            read: 0,
            written: 0,
            waited: false,
        }
    }

    fn is_lazy(&mut self) -> bool {
        self.rng.random_bool(self.lazy)
    }
}

impl ErrorType for Line {
    type Error = ErrorKind;
}

impl ReadReady for Line {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        Ok(!self.is_lazy() && !self.wire.to_device.borrow().is_empty())
    }
}

impl Read for Line {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        if self.is_lazy() {
            return Err(ErrorKind::Interrupted);
        }
        let Some(byte) = self.wire.to_device.borrow_mut().pop_front() else {
            self.waited = true;
            return Ok(0);
        };
        self.read += 1;
        if self.bad_reads.contains(&(self.read - 1)) {
            return Err(ErrorKind::Other);
        }
        bytes[0] = byte;
        Ok(1)
    }
}

impl WriteReady for Line {
    fn write_ready(&mut self) -> Result<bool, ErrorKind> {
        Ok(!self.is_lazy())
    }
}

impl Write for Line {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        if self.is_lazy() {
            return Err(ErrorKind::Interrupted);
        }
        self.written += 1;
        if self.bad_writes.contains(&(self.written - 1)) {
            return Err(ErrorKind::Other);
        }
        self.wire.to_host.borrow_mut().push_back(bytes[0]);
        Ok(1)
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        self.waited = true;
        Ok(())
    }
}

/// A link that can be looked at after the device has had it.
struct Lent<'a>(&'a mut IoLink<Line>);

impl ByteLink for Lent<'_> {
    fn receive(&mut self) -> Option<u8> {
        self.0.receive()
    }

    fn send(&mut self, byte: u8) -> bool {
        self.0.send(byte)
    }
}

/// What a device answers over this line, and the errors that the link has counted.
fn over(line: Line, requests: &[Vec<u8>]) -> (Vec<u8>, u32) {
    let wire = line.wire.clone();
    let mut link = IoLink::new(line);
    let answers = answers(Lent(&mut link), &wire, requests);
    let errors = link.errors();
    assert!(!link.into_inner().waited, "the link asked for what it would have waited for");
    (answers, errors)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn a_line_that_is_seldom_ready_and_often_interrupted_changes_no_byte(seed in any::<u64>(), lazy in 0.0..0.9) {
        let requests = requests();
        let (answers, errors) = over(Line::new(Wire::default(), seed, lazy), &requests);
        prop_assert_eq!(answers, answers_in_peace(&requests));
        prop_assert_eq!(errors, 0);
    }
}

#[test]
fn a_byte_that_is_lost_while_it_is_read_costs_its_frame_and_no_other() {
    let requests = requests();
    let peace = replies(&answers_in_peace(&requests));
    // The third frame corrects samples: it is not needed by those that follow.
    let start: usize = requests[..2].iter().map(Vec::len).sum();
    for at in start..start + requests[2].len() - 1 {
        let mut line = Line::new(Wire::default(), 1, 0.0);
        line.bad_reads.insert(at);
        let (answers, errors) = over(line, &requests);
        let got = replies(&answers);
        assert_eq!(errors, 1);
        let id = peace[2].0.id;
        assert!(got.iter().all(|(header, reply)| header.id != id || reply.contains("Fault")), "byte {at}");
        for other in peace.iter().filter(|(header, _)| header.id != id) {
            assert!(got.contains(other), "byte {at}: no {other:?} in {got:?}");
        }
    }
}

#[test]
fn a_byte_that_cannot_be_written_is_left_out_and_what_follows_is_said() {
    let requests = requests();
    let expected = answers_in_peace(&requests);
    let peace = replies(&expected);
    for at in (0..expected.len()).step_by(7) {
        let mut line = Line::new(Wire::default(), 1, 0.0);
        line.bad_writes.insert(at);
        let (answers, errors) = over(line, &requests);
        let mut without = expected.clone();
        without.remove(at);
        assert_eq!((answers == without, errors), (true, 1), "byte {at}");
        // Two, where the byte was the end between two frames.
        assert!(replies(&answers).len() + 2 >= peace.len());
    }
}

#[test]
fn a_line_that_fails_for_good_keeps_no_request_from_being_carried_out() {
    let requests = requests();
    let mut line = Line::new(Wire::default(), 1, 0.0);
    line.bad_writes.extend(0..1_000_000);
    let wire = line.wire.clone();
    let (answers, errors) = over(line, &requests);
    assert!(answers.is_empty() && errors > 100, "{errors}");
    assert!(wire.to_device.borrow().is_empty(), "requests were left on the line");
}

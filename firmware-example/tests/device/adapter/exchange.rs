//! Async drivers of embedded-io-async, in tasks around the co-processor.

use std::{cell::RefCell, future::pending};

use embassy_futures::{
    block_on,
    select::{Either, select, select3},
    yield_now,
};
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embedded_io::{ErrorKind, ErrorType};
use embedded_io_async::{Read, Write};
use firmware_example::{
    adapter::exchange::{Exchange, Losses},
    board::{ByteLink, Sample, SampleSource},
    coprocessor::Coprocessor,
};
use imucal_core::{link::Guard, record::RawUnit};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{answers_in_peace, board, replies, requests};
use crate::{
    bench::{BenchMemory, SERIAL, Wire, unit},
    nor::Nor,
};

type Small = Exchange<NoopRawMutex, 16, 8, 3>;

/// One end of a wire: it lets others run, takes and gives a few bytes at a time, is interrupted, and fails at a byte.
struct End<'a> {
    wire: Wire,
    rng: &'a RefCell<ChaCha8Rng>,
    bad: Option<usize>,
    done: usize,
}

impl<'a> End<'a> {
    fn new(wire: &Wire, rng: &'a RefCell<ChaCha8Rng>, bad: Option<usize>) -> Self {
        Self { wire: wire.clone(), rng, bad, done: 0 }
    }

    /// Bytes of this call, out of so many, after some time; `None`: interrupted.
    async fn share(&self, most: usize) -> Option<usize> {
        let (yields, share, interrupted) = {
            let mut rng = self.rng.borrow_mut();
            (rng.random_range(0..4), rng.random_range(1..=most), rng.random_bool(0.1))
        };
        for _ in 0..yields {
            yield_now().await;
        }
        (!interrupted).then_some(share)
    }

    /// An error is due at one of the next so many bytes.
    fn fails(&mut self, next: usize) -> bool {
        let fails = self.bad.is_some_and(|at| (self.done..self.done + next).contains(&at));
        self.done += next;
        fails
    }
}

impl ErrorType for End<'_> {
    type Error = ErrorKind;
}

impl Read for End<'_> {
    async fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        let share = self.share(bytes.len()).await.ok_or(ErrorKind::Interrupted)?;
        while self.wire.to_device.borrow().is_empty() {
            yield_now().await;
        }
        let count = share.min(self.wire.to_device.borrow().len());
        for (byte, next) in bytes.iter_mut().zip(self.wire.to_device.borrow_mut().drain(..count)) {
            *byte = next;
        }
        // What had come until then is lost.
        if self.fails(count) { Err(ErrorKind::Other) } else { Ok(count) }
    }
}

impl Write for End<'_> {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        let share = self.share(bytes.len()).await.ok_or(ErrorKind::Interrupted)?;
        if self.fails(share) {
            return Err(ErrorKind::Other);
        }
        self.wire.to_host.borrow_mut().extend(&bytes[..share]);
        Ok(share)
    }

    async fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}

/// Rounds of the executor without a byte after which nothing more is expected.
const PATIENCE: u32 = 300;

/// A host that sends a frame when nothing more comes after the one before.
async fn ask(wire: &Wire, requests: &[Vec<u8>]) {
    for request in requests {
        wire.to_device.borrow_mut().extend(request);
        let lengths = || (wire.to_device.borrow().len(), wire.to_host.borrow().len());
        let (mut last, mut quiet) = (lengths(), 0);
        while quiet < PATIENCE {
            yield_now().await;
            quiet = if lengths() == last { quiet + 1 } else { 0 };
            last = lengths();
        }
    }
}

/// What a device says through the tasks, with errors at a byte read and a byte written, and what was lost.
fn over(requests: &[Vec<u8>], seed: u64, bad: [Option<usize>; 2]) -> (Vec<u8>, Losses) {
    let (wire, exchange) = (Wire::default(), Small::new());
    let mut memory = BenchMemory::new();
    let board = board(exchange.link(), Nor::new(2), exchange.sensors([None; 3]));
    let mut device = Coprocessor::new(board, unit(SERIAL), Guard::new(None, 1), &mut memory);
    let rng = RefCell::new(ChaCha8Rng::seed_from_u64(seed));
    let tasks = select3(
        exchange.receive(End::new(&wire, &rng, bad[0])),
        exchange.transmit(End::new(&wire, &rng, bad[1])),
        // Without news it would wait for ever.
        exchange.work(|| device.poll(), pending::<()>),
    );
    assert!(matches!(block_on(select(tasks, ask(&wire, requests))), Either::Second(())), "a task has ended");
    let answers = wire.to_host.borrow_mut().drain(..).collect();
    (answers, exchange.losses())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn tasks_with_short_reads_and_writes_change_no_byte(seed in any::<u64>()) {
        let requests = requests();
        let expected = answers_in_peace(&requests);
        let (answers, losses) = over(&requests, seed, [None; 2]);
        prop_assert_eq!(answers, expected);
        prop_assert_eq!(losses, Losses::default());
    }

    #[test]
    fn an_error_of_the_line_loses_frames_about_it_and_none_after(seed in any::<u64>(), at in 0usize..60) {
        let requests = requests();
        // A new session at the end, which hangs on nothing before it.
        let again: Vec<_> = requests.iter().chain(&requests[..1]).cloned().collect();
        let peace = replies(&answers_in_peace(&again));
        let at = requests[..2].concat().len() + at;
        for bad in [[Some(at), None], [None, Some(at)]] {
            let (answers, losses) = over(&again, seed, bad);
            prop_assert_eq!(losses.reads + losses.writes, 1);
            let got = replies(&answers);
            prop_assert_eq!(&got.last().expect("it is answered").1, &peace.last().expect("it is answered").1);
        }
    }
}

#[test]
fn a_line_that_ends_ends_its_task() {
    let exchange = Small::new();
    let nothing: &[u8] = &[];
    block_on(exchange.receive(nothing));
    assert_eq!(exchange.losses(), Losses::default());
    assert_eq!(exchange.link().receive(), None);
}

#[test]
fn work_goes_on_when_the_pause_ends_without_news() {
    let exchange = Small::new();
    let turns = RefCell::new(0);
    let poll = || {
        *turns.borrow_mut() += 1;
        false
    };
    let pauses = async {
        while *turns.borrow() < 10 {
            yield_now().await;
        }
    };
    block_on(select(exchange.work(poll, async || yield_now().await), pauses));
    assert!(*turns.borrow() >= 10);
}

#[test]
fn the_newest_samples_are_kept_in_their_order_and_the_others_counted() {
    let exchange = Small::new();
    let units = [Some(RawUnit::Counts), None, None];
    let mut sensors = exchange.sensors(units);
    assert_eq!((sensors.units(), sensors.sample()), (units, None));
    for number in 0..5 {
        exchange.offer(Sample { raw: [Some([number as f32; 3]), None, None], temperature: 25.0, time: None });
    }
    let kept: Vec<_> = std::iter::from_fn(|| sensors.sample()).map(|sample| sample.raw[0]).collect();
    assert_eq!(kept, [2.0, 3.0, 4.0].map(|number| Some([number; 3])));
    assert_eq!(exchange.losses(), Losses { samples: 2, ..Losses::default() });
}

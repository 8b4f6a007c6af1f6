//! Samples that come a hundred times a second while a fit takes slices longer than that.

use std::collections::VecDeque;

use firmware_example::{
    RECORD,
    board::{Board, Sample},
    coprocessor::Coprocessor,
    drill,
    fitting::Memory,
    scene::Noise,
};
use imucal_core::{
    link::{BATCH, FitModel, Guard, Observation, Receiver, Reply, Request, Values, split},
    record::{Date, Sensor},
};

use crate::{
    bench::{LAST_RESET, Queued, SERIAL, Ticks, Wire, framed, unit},
    nor::Nor,
};

/// Between samples, ms.
const INTERVAL: f64 = 10.0;
/// A slice of a fit, ms: longer than the longest iteration and judgement of `tests/device_cost.rs` at 100 MHz.
const SLICE: f64 = 25.0;
/// Another turn, ms: a frame or a sample.
const TURN: f64 = 0.5;
/// Samples that an IMU keeps, and bytes that a UART's driver keeps, while the processor is busy.
const FIFO: usize = 8;
const UART: usize = 256;

type Device<'a> = Coprocessor<'a, Wire, Nor, Ticks, Queued, 256, 64, 48, 512, 10>;

/// A co-processor, what comes to it, and the time it takes.
struct Stand<'a> {
    device: Device<'a>,
    wire: Wire,
    sensors: Queued,
    receiver: Receiver,
    session: u32,
    next: u32,
    time: f64,
    /// Samples that have come.
    come: u32,
    /// Most that have waited, of samples and of bytes.
    waited: (usize, usize),
}

impl<'a> Stand<'a> {
    fn new(memory: &'a mut Memory<256, 64, 48, 512, 10>) -> Self {
        let (wire, sensors) = (Wire::default(), Queued::default());
        let board = Board {
            link: wire.clone(),
            flash: Nor::new(2),
            clock: Ticks::default(),
            sensors: sensors.clone(),
            stack: || None,
            last_reset: LAST_RESET,
        };
        let device = Coprocessor::new(board, unit(SERIAL), Guard::new(None, 1), memory);
        let (receiver, waited) = (Receiver::default(), (0, 0));
        let mut stand =
            Self { device, wire, sensors, receiver, session: 0, next: 1, time: 0.0, come: 0, waited };
        stand.send(&Request::Identify { nonce: 1 });
        stand.settle();
        stand
    }

    fn send(&mut self, request: &Request<'_>) -> u32 {
        let id = self.next;
        self.next += 1;
        self.wire.to_device.borrow_mut().extend(framed(self.session, id, request));
        id
    }

    /// A turn, and the time that it takes: a slice's where the fit went on, and where nothing else was done.
    fn turn(&mut self) {
        let waiting = self.sensors.0.borrow().len() + self.wire.to_device.borrow().len();
        let before = self.device.fit();
        self.device.poll();
        let left = self.sensors.0.borrow().len() + self.wire.to_device.borrow().len();
        self.time += if left == waiting || self.device.fit() != before { SLICE } else { TURN };
    }

    /// What the device has sent.
    fn replies(&mut self) -> Vec<(u32, String)> {
        let bytes: VecDeque<u8> = std::mem::take(&mut *self.wire.to_host.borrow_mut());
        let mut replies = Vec::new();
        for byte in bytes {
            let Some(frame) = self.receiver.push(byte) else { continue };
            let frame = split(frame.expect("intact")).expect("intact");
            self.session = frame.header.session;
            replies.push((frame.header.id, format!("{:?}", frame.read::<Reply<'_>>().expect("a reply"))));
        }
        replies
    }

    /// Everything done; what was answered.
    fn settle(&mut self) -> Vec<(u32, String)> {
        while self.device.poll() {}
        self.replies()
    }

    fn status(&mut self) -> String {
        let id = self.send(&Request::Status);
        let replies = self.settle();
        replies.into_iter().find(|(got, _)| *got == id).expect("answered").1
    }

    /// A fit that is begun and fed, under a record.
    fn begin(&mut self, model: FitModel, count: usize) {
        self.send(&Request::PutRecord { record: RECORD, replace: false });
        self.settle();
        self.send(&Request::StartFit(drill::task(model)));
        self.settle();
        let mut observations: Vec<Observation> = Vec::new();
        drill::observe(model, count, &mut Noise(1), |observation| observations.push(observation));
        for (batch, index) in observations.chunks(BATCH).zip((0..).step_by(BATCH)) {
            let observations = batch.iter().copied().collect();
            self.send(&Request::Feed { index, observations });
            self.settle();
        }
    }

    /// Fits to the end and judges, while `come` lets a sample come at each interval; ids of the two requests.
    fn run(&mut self, mut come: impl FnMut(&mut Self)) -> [u32; 2] {
        let step = self.send(&Request::StepFit { slices: u16::MAX });
        let (mut finish, mut end) = (None, f64::INFINITY);
        while self.time < end {
            while f64::from(self.come) * INTERVAL <= self.time {
                come(self);
                self.come += 1;
            }
            let waiting = (self.sensors.0.borrow().len(), self.wire.to_device.borrow().len());
            self.waited = (self.waited.0.max(waiting.0), self.waited.1.max(waiting.1));
            self.turn();
            if finish.is_none() && self.device.fit().expect("a fit").stopped {
                finish = Some(self.send(&Request::FinishFit { date: Date::from_days(1) }));
                end = self.time + 10.0 * INTERVAL;
            }
            assert!(self.come < 10_000, "the fit does not get on");
        }
        [step, finish.expect("sent")]
    }
}

/// Where the fit's own answers are.
fn answered(replies: &[(u32, String)], [step, finish]: [u32; 2]) -> bool {
    let is =
        |wanted: u32, part: &str| replies.iter().any(|(id, reply)| *id == wanted && reply.contains(part));
    is(step, "stopped: true") && is(finish, "Report")
}

/// Models, and how many of their observations: many slices each.
const FITS: [(FitModel, usize); 4] =
    [(FitModel::T9, 40), (FitModel::I14, 40), (FitModel::E9, 200), (FitModel::K12, 20)];

#[test]
fn no_sample_of_the_board_s_sensor_is_lost_during_a_fit() {
    for (model, count) in FITS {
        let mut memory = Memory::new();
        let mut stand = Stand::new(&mut memory);
        stand.begin(model, count);
        let stream = stand.send(&Request::Stream { every: 1 });
        stand.settle();
        let requests = stand.run(|stand| {
            let raw = [Some([33_000.0; 3]), Some([32_000.0; 3]), None];
            stand.sensors.0.borrow_mut().push_back(Sample { raw, temperature: 25.0, time: None });
        });
        let replies = stand.settle();
        let sent = replies.iter().filter(|(id, reply)| *id == stream && reply.starts_with("Sample")).count();
        let (come, status) = (stand.come as usize, stand.status());
        println!("{model:?}: {} samples came, {} waited at the most", stand.come, stand.waited.0);
        assert!(status.contains(&format!("corrected: {come},")), "{model:?}: {come} of {status}");
        // A stream never waits: where the fit's two answers go, a sample is not sent.
        assert!(sent + 2 >= come, "{model:?}: {sent} of {come}");
        assert!(answered(&replies, requests), "{model:?}");
        assert!(come > 10 && stand.waited.0 > 1 && stand.waited.0 <= FIFO, "{model:?}: {:?}", stand.waited);
    }
}

#[test]
fn every_sample_over_the_link_is_answered_while_a_fit_runs() {
    for (model, count) in FITS {
        let mut memory = Memory::new();
        let mut stand = Stand::new(&mut memory);
        stand.begin(model, count);
        let mut asked = Vec::new();
        let requests = stand.run(|stand| {
            let raw = Values::from_slice(&[[33_000.0; 3]]).expect("room");
            asked.push(stand.send(&Request::Correct {
                sensor: Sensor::Accelerometer,
                temperature: 25.0,
                raw,
            }));
        });
        let replies = stand.settle();
        let corrected: Vec<u32> =
            replies.iter().filter(|(_, reply)| reply.starts_with("Corrected")).map(|(id, _)| *id).collect();
        println!("{model:?}: {} frames came, {} B waited at the most", asked.len(), stand.waited.1);
        assert_eq!(corrected, asked, "{model:?}");
        assert!(answered(&replies, requests), "{model:?}");
        assert!(corrected.len() > 10 && stand.waited.1 > 0 && stand.waited.1 <= UART, "{:?}", stand.waited);
    }
}

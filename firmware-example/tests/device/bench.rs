//! A co-processor on the bench: its link and flash are in our hands.

use std::{cell::RefCell, collections::VecDeque, rc::Rc};

use firmware_example::{
    board::{Board, ByteLink, Clock, Sample, SampleSource},
    coprocessor::{Alone, Coprocessor},
    fitting::Memory,
};
use imucal_core::{
    link::{
        Guard, Header, LastReset, MAX_FRAME, Origin, Receiver, Reply, Request, ResetCause, encode, split,
    },
    record::{RawUnit, SensorIdentity},
};

use crate::nor::Nor;

/// Bytes on their way, both ways.
#[derive(Clone, Debug, Default)]
pub struct Wire {
    pub to_device: Rc<RefCell<VecDeque<u8>>>,
    pub to_host: Rc<RefCell<VecDeque<u8>>>,
}

impl ByteLink for Wire {
    fn receive(&mut self) -> Option<u8> {
        self.to_device.borrow_mut().pop_front()
    }

    fn send(&mut self, byte: u8) -> bool {
        self.to_host.borrow_mut().push_back(byte);
        true
    }
}

/// Milliseconds that pass when asked for.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ticks(u32);

impl Clock for Ticks {
    fn uptime(&mut self) -> u32 {
        self.0 += 1;
        self.0
    }
}

/// Sensors that count.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counting {
    pub count: f32,
    /// They put samples out.
    pub on: bool,
    /// In these units.
    pub units: [Option<RawUnit>; 3],
}

/// Sensors whose samples wait in a queue, which is in our hands.
#[derive(Clone, Debug, Default)]
pub struct Queued(pub Rc<RefCell<VecDeque<Sample>>>);

impl SampleSource for Queued {
    fn sample(&mut self) -> Option<Sample> {
        self.0.borrow_mut().pop_front()
    }

    fn units(&self) -> [Option<RawUnit>; 3] {
        [None; 3]
    }
}

impl SampleSource for Counting {
    fn sample(&mut self) -> Option<Sample> {
        self.count += 1.0;
        let raw = [Some([self.count; 3]), Some([self.count; 3]), None];
        self.on.then_some(Sample { raw, temperature: 25.0, time: None })
    }

    fn units(&self) -> [Option<RawUnit>; 3] {
        self.units
    }
}

/// The sizes of the bench's fits.
pub type BenchMemory = Memory<256, 64, 48, 512, 10>;
type Device<'a, S> = Coprocessor<'a, Wire, Nor, Ticks, S, 256, 64, 48, 512, 10, 1>;

/// A request's frame.
pub fn framed(session: u32, id: u32, request: &Request<'_>) -> Vec<u8> {
    let header = Header { id, origin: Origin::Host, session };
    encode(&header, request, None, &mut [0; MAX_FRAME]).expect("a request fits").to_vec()
}

/// How the bench's device ended its last run.
pub const LAST_RESET: LastReset = LastReset { cause: ResetCause::Watchdog, address: 0x0001_2345, resets: 3 };

/// Serial of the record that the images carry.
pub const SERIAL: &str = "00300017";

pub fn unit(serial: &str) -> SensorIdentity {
    SensorIdentity { name: "bench".parse().expect("short"), serial: serial.parse().expect("short") }
}

pub struct Bench<'a, S: SampleSource = Counting> {
    pub device: Device<'a, S>,
    pub wire: Wire,
    receiver: Receiver,
    /// The session that requests are sent in.
    pub session: u32,
    next: u32,
}

impl<'a, S: SampleSource> Bench<'a, S> {
    /// With a session begun.
    pub fn new(nor: Nor, serial: &str, sensors: S, memory: &'a mut BenchMemory) -> Self {
        let mut bench = Self::started(nor, serial, sensors, Guard::new(None, 1), memory);
        bench.identify(1);
        bench
    }

    /// Without a session.
    pub fn started(
        nor: Nor,
        serial: &str,
        sensors: S,
        guard: Guard<'a>,
        memory: &'a mut BenchMemory,
    ) -> Self {
        let wire = Wire::default();
        let board = Board {
            link: wire.clone(),
            flash: nor,
            clock: Ticks::default(),
            sensors,
            stack: || None,
            last_reset: LAST_RESET,
        };
        // For as long as the test lasts.
        let alone = Box::leak(Box::new(Alone::new()));
        let device = Coprocessor::with_sessions(board, unit(serial), guard, memory, alone);
        Self { device, wire, receiver: Receiver::default(), session: 0, next: 1 }
    }

    /// Asks for a session; its requests begin with the id 1.
    pub fn identify(&mut self, nonce: u64) {
        self.send_as(u32::MAX, &Request::Identify { nonce });
        let mut sessions = Vec::new();
        while sessions.is_empty() {
            self.device.poll();
            sessions = self.sent(|header, reply| {
                assert!(matches!(reply, Reply::Identity(_)), "{reply:?}");
                header.session
            });
        }
        (self.session, self.next) = (sessions[0], 1);
    }

    /// Takes the power away.
    pub fn off(self) -> Nor {
        self.device.into_parts().1.expect("the flash serves")
    }

    /// Sends under the next id, which it gives.
    pub fn send(&mut self, request: &Request<'_>) -> u32 {
        let id = self.next;
        self.next += 1;
        self.send_as(id, request);
        id
    }

    pub fn send_as(&mut self, id: u32, request: &Request<'_>) {
        self.put(&framed(self.session, id, request));
    }

    /// Puts bytes on the wire.
    pub fn put(&mut self, bytes: &[u8]) {
        self.wire.to_device.borrow_mut().extend(bytes);
    }

    /// Polls until the device has nothing to do; the replies that came, each with its id.
    pub fn replies<R>(&mut self, mut each: impl FnMut(u32, &Reply<'_>) -> R) -> Vec<R> {
        self.heard(|header, reply| each(header.id, reply))
    }

    /// Polls until the device has nothing to do; the same with each reply's header.
    pub fn heard<R>(&mut self, mut each: impl FnMut(&Header, &Reply<'_>) -> R) -> Vec<R> {
        let mut turns = 0;
        let mut replies = Vec::new();
        let mut busy = true;
        while busy {
            busy = self.device.poll();
            turns += 1;
            assert!(turns < 1_000_000, "the device hangs");
            replies.extend(self.sent(&mut each));
        }
        replies
    }

    /// What the device has sent.
    fn sent<R>(&mut self, mut each: impl FnMut(&Header, &Reply<'_>) -> R) -> Vec<R> {
        let bytes: Vec<u8> = self.wire.to_host.borrow_mut().drain(..).collect();
        let mut replies = Vec::new();
        for byte in bytes {
            let Some(frame) = self.receiver.push(byte) else { continue };
            let frame = split(frame.expect("intact")).expect("intact");
            assert_eq!(frame.header.origin, Origin::Device);
            replies.push(each(&frame.header, &frame.read().expect("a reply")));
        }
        replies
    }

    /// Asks, and gives the one answer.
    pub fn ask<R>(&mut self, request: &Request<'_>, mut each: impl FnMut(&Reply<'_>) -> R) -> R {
        let id = self.send(request);
        let mut replies = self.replies(|got, reply| {
            assert_eq!(got, id, "{reply:?}");
            each(reply)
        });
        assert_eq!(replies.len(), 1);
        replies.remove(0)
    }

    /// Asks under an id of one's own.
    pub fn ask_from<R>(&mut self, id: u32, request: &Request<'_>, each: impl FnMut(&Reply<'_>) -> R) -> R {
        self.next = id;
        self.ask(request, each)
    }
}

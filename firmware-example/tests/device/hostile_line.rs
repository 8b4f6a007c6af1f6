//! A line that repeats, echoes, records and forges frames: what `imucal_core::link` says of them.

use firmware_example::RECORD;
use imucal_core::link::{
    Fault, Guard, Header, Key, MAX_FRAME, Nonces, Origin, RecordState, Reply, Request, Seal, Status, WINDOW,
    encode,
};

use crate::{
    bench::{Bench, BenchMemory, Counting, SERIAL, framed},
    nor::Nor,
};

const PUT: Request<'_> = Request::PutRecord { record: RECORD, replace: true };

fn bench(memory: &mut BenchMemory) -> Bench<'_> {
    Bench::new(Nor::new(2), SERIAL, Counting::default(), memory)
}

fn fault(reply: &Reply<'_>) -> Option<Fault> {
    match reply {
        Reply::Fault(fault) => Some(*fault),
        _ => None,
    }
}

fn status(reply: &Reply<'_>) -> Status {
    match reply {
        Reply::Status(status) => *status,
        other => panic!("{other:?}"),
    }
}

#[test]
fn no_id_locks_the_link_and_none_is_taken_twice() {
    let mut memory = BenchMemory::new();
    let mut bench = bench(&mut memory);
    let ids = [7, u32::MAX, 7, 3, 0, 8, 8 + WINDOW + 1, 8 + WINDOW];
    ids.into_iter().for_each(|id| bench.send_as(id, &Request::Status));
    let stale = |last| Some(Fault::Stale { last });
    let expected = [
        (7, None),
        (u32::MAX, stale(7)),
        (7, stale(7)),
        (3, stale(7)),
        (0, Some(Fault::Malformed)),
        (8, None),
        (8 + WINDOW + 1, stale(8)),
        (8 + WINDOW, None),
    ];
    assert_eq!(bench.replies(|id, reply| (id, fault(reply))), expected);
}

#[test]
fn frames_recorded_before_a_reset_do_nothing_after_it() {
    let (mut memory, mut recorded) = (BenchMemory::new(), Vec::new());
    let mut bench = bench(&mut memory);
    recorded.extend(framed(0, 1, &Request::Identify { nonce: 1 }));
    for id in 1..=3 {
        recorded.extend(framed(bench.session, id, &PUT));
    }
    bench.put(&recorded);
    assert!(bench.replies(|_, reply| fault(reply)).contains(&None));
    drop(bench);

    let guard = Guard::new(None, 2);
    let mut bench = Bench::started(Nor::new(2), SERIAL, Counting::default(), guard, &mut memory);
    bench.put(&recorded);
    let session = Some(Fault::Session);
    assert_eq!(bench.replies(|_, reply| fault(reply)), [None, session, session, session]);
    bench.identify(9);
    assert_eq!(bench.ask(&Request::Status, |reply| status(reply).record), RecordState::Empty);
}

#[test]
fn frames_of_an_earlier_session_do_nothing_in_the_next() {
    let mut memory = BenchMemory::new();
    let mut bench = bench(&mut memory);
    let early = framed(bench.session, 5, &PUT);
    // The same number of the host: the device's own makes the difference.
    bench.identify(1);
    assert_eq!(bench.ask(&Request::Status, fault), None);
    bench.put(&early);
    assert_eq!(bench.replies(|_, reply| fault(reply)), [Some(Fault::Session)]);
}

#[test]
fn a_stray_identify_ends_no_session() {
    let mut memory = BenchMemory::new();
    let mut bench = bench(&mut memory);
    assert_eq!(bench.ask(&Request::Status, fault), None);
    bench.put(&framed(0, 1, &Request::Identify { nonce: 77 }));
    assert_eq!(bench.replies(|id, _| id), [1]);
    assert_eq!(bench.ask(&Request::Status, fault), None);
}

#[test]
fn a_stream_ends_with_its_session() {
    let mut memory = BenchMemory::new();
    let sensors = Counting { on: true, ..Counting::default() };
    let mut bench = Bench::started(Nor::new(2), SERIAL, sensors, Guard::new(None, 1), &mut memory);
    let mut samples = |bytes: Vec<u8>| {
        bench.put(&bytes);
        for _ in 0..50 {
            bench.device.poll();
        }
        let sent: Vec<u8> = bench.wire.to_host.borrow_mut().drain(..).collect();
        (sent.iter().filter(|byte| **byte == 0).count(), session_of(&sent))
    };
    let (_, first) = samples(framed(0, 1, &Request::Identify { nonce: 1 }));
    assert!(samples(framed(first, 1, &Request::Stream { every: 1 })).0 > 20);
    let (still, second) = samples(framed(0, 1, &Request::Identify { nonce: 2 }));
    assert!(still > 20);
    assert!(samples(framed(second, 1, &Request::Status)).0 <= 2);
}

/// The session of the last identity among frames.
fn session_of(bytes: &[u8]) -> u32 {
    let mut receiver = imucal_core::link::Receiver::default();
    let mut session = 0;
    for byte in bytes {
        let Some(Ok(plain)) = receiver.push(*byte) else { continue };
        let frame = imucal_core::link::split(plain).expect("intact");
        if matches!(frame.read(), Ok(Reply::Identity(_))) {
            session = frame.header.session;
        }
    }
    session
}

#[test]
fn an_echoing_line_falls_silent_whether_it_damages_or_not() {
    for damage in [0, 0x10] {
        let mut memory = BenchMemory::new();
        let mut bench = bench(&mut memory);
        bench.send(&Request::Status);
        bench.put(&[0x55, 0x33, 0]);
        bench.put(&plain_of_version_1(7));
        let (mut sent, mut silent) = (0, 0);
        while silent < 10 {
            bench.device.poll();
            let echo: Vec<u8> = bench.wire.to_host.borrow_mut().drain(..).collect();
            silent = if echo.is_empty() { silent + 1 } else { 0 };
            sent += echo.len();
            assert!(sent < 2_000, "the device answers itself");
            // A zero stays one, so that the device sees damaged frames and not one without an end.
            bench.put(&echo.iter().map(|b| if *b == 0 { 0 } else { b ^ damage }).collect::<Vec<_>>());
        }
        assert!(sent > 50, "{sent}");
    }
}

/// A status request as version 1 wrote it.
fn plain_of_version_1(id: u8) -> Vec<u8> {
    let plain = [1, id, 0, 0, 0, 1];
    let checksum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&plain).to_le_bytes();
    // By COBS, by hand: three zeros, and a checksum without any.
    assert!(!checksum.contains(&0));
    [&[3, 1, id, 1, 1, 6, 1][..], &checksum, &[0]].concat()
}

#[test]
fn a_host_of_version_1_is_refused_in_its_own_words() {
    let mut memory = BenchMemory::new();
    let mut bench = bench(&mut memory);
    bench.put(&plain_of_version_1(7));
    while bench.device.poll() {}
    let sent: Vec<u8> = bench.wire.to_host.borrow_mut().drain(..).collect();
    let mut receiver = imucal_core::link::Receiver::default();
    let plain = sent.iter().find_map(|byte| receiver.push(*byte).map(|f| f.expect("whole").to_vec()));
    // A fault (9) of the version (2), which is 2.
    assert_eq!(plain.expect("an answer")[..8], [1, 7, 0, 0, 0, 9, 2, 2]);
}

#[test]
fn what_cannot_be_read_is_answered_once_until_a_request_is_taken() {
    let mut memory = BenchMemory::new();
    let mut bench = bench(&mut memory);
    for _ in 0..2 {
        (0..5).for_each(|_| bench.put(&[0x55, 0x33, 0]));
        assert_eq!(bench.replies(|id, reply| (id, fault(reply))), [(0, Some(Fault::Damaged))]);
        assert_eq!(bench.ask(&Request::Status, fault), None);
    }
}

#[test]
fn a_locked_device_changes_nothing_until_its_power_goes() {
    let mut memory = BenchMemory::new();
    let mut bench = bench(&mut memory);
    assert_eq!(bench.ask(&Request::Lock, fault), None);
    for refused in [PUT, Request::Store { replace: true }, Request::AbortFit, Request::Unlock] {
        assert_eq!(bench.ask(&refused, fault), Some(Fault::Locked), "{refused:?}");
    }
    // Nor for the next session.
    bench.identify(2);
    assert_eq!(bench.ask(&PUT, fault), Some(Fault::Locked));
    let status = bench.ask(&Request::Status, status);
    assert!(status.locked && status.record == RecordState::Empty, "{status:?}");
    let nor = bench.off();
    let mut bench = Bench::new(nor, SERIAL, Counting::default(), &mut memory);
    assert_eq!(bench.ask(&PUT, fault), None);
}

/// A host with a key, before a device with one.
struct Keyed<'a> {
    bench: Bench<'a>,
    nonces: Nonces,
    next: u32,
}

static KEY: Key = Key::new([3; 32]);

impl<'a> Keyed<'a> {
    fn new(memory: &'a mut BenchMemory) -> Self {
        let guard = Guard::new(Some(&KEY), 1);
        let mut bench = Bench::started(Nor::new(2), SERIAL, Counting::default(), guard, memory);
        bench.put(&framed(0, 1, &Request::Identify { nonce: 5 }));
        let device = bench.replies(|_, reply| match reply {
            Reply::Identity(identity) if identity.keyed => identity.nonce,
            other => panic!("{other:?}"),
        })[0];
        let nonces = Nonces { host: 5, device };
        bench.session = nonces.session();
        Self { bench, nonces, next: 1 }
    }

    /// A sealed frame.
    fn sealed(&mut self, key: &Key, request: &Request<'_>) -> Vec<u8> {
        let header = Header { id: self.next, origin: Origin::Host, session: self.bench.session };
        self.next += 1;
        let seal = Seal { key, nonces: self.nonces };
        encode(&header, request, Some(seal), &mut [0; MAX_FRAME]).expect("room").to_vec()
    }

    fn ask(&mut self, key: Option<&Key>, request: &Request<'_>) -> Option<Fault> {
        let frame = match key {
            Some(key) => self.sealed(key, request),
            None => {
                self.next += 1;
                framed(self.bench.session, self.next - 1, request)
            }
        };
        self.bench.put(&frame);
        self.bench.replies(|_, reply| fault(reply))[0]
    }
}

#[test]
fn without_its_key_no_record_is_replaced() {
    let mut memory = BenchMemory::new();
    let mut host = Keyed::new(&mut memory);
    for request in [PUT, Request::Store { replace: true }, Request::AbortFit, Request::Unlock] {
        assert_eq!(host.ask(None, &request), Some(Fault::KeyNeeded), "{request:?}");
        assert_eq!(host.ask(Some(&Key::new([4; 32])), &request), Some(Fault::WrongSeal), "{request:?}");
    }
    assert_eq!(host.ask(None, &Request::Status), None);
    let sealed = host.sealed(&KEY, &PUT);
    host.bench.put(&sealed);
    assert_eq!(host.bench.replies(|_, reply| fault(reply)), [None]);
    // Recorded, and sent again.
    host.bench.put(&sealed);
    assert!(matches!(host.bench.replies(|_, reply| fault(reply))[..], [Some(Fault::Stale { .. })]));
}

#[test]
fn a_forged_frame_does_not_use_up_the_id_of_a_sealed_one() {
    let mut memory = BenchMemory::new();
    let mut host = Keyed::new(&mut memory);
    let sealed = host.sealed(&KEY, &PUT);
    host.next = 1;
    assert_eq!(host.ask(Some(&Key::new([4; 32])), &PUT), Some(Fault::WrongSeal));
    host.bench.put(&sealed);
    assert_eq!(host.bench.replies(|_, reply| fault(reply)), [None]);
}

#[test]
fn the_key_opens_a_lock() {
    let mut memory = BenchMemory::new();
    let mut host = Keyed::new(&mut memory);
    assert_eq!(host.ask(None, &Request::Lock), None);
    assert_eq!(host.ask(Some(&KEY), &PUT), Some(Fault::Locked));
    assert_eq!(host.ask(Some(&KEY), &Request::Unlock), None);
    assert_eq!(host.ask(Some(&KEY), &PUT), None);
}

//! The protocol's document, `imucal-host/docs/protocol.md`, held to the code: its numbers, its golden frames, and its
//! client against the co-processor's own logic at a TCP port. And what a host with and without the key gets there.

use std::{
    cell::Cell,
    collections::VecDeque,
    io::{ErrorKind, Read, Write},
    net::{TcpListener, TcpStream},
    path::{Path, PathBuf},
    process::Command,
    rc::Rc,
    thread,
    time::{Duration, Instant},
};

use firmware_example::{
    RECORD,
    board::{Board, ByteLink, Clock, NoSensor},
    coprocessor::Coprocessor,
    fitting::Memory,
};
use imucal_core::{
    corrector::Corrector,
    link::{
        Fault, Guard, Header, Identity, Key, LastReset, MAX_FRAME, Nonces, Origin, RecordState, Reply,
        Request, ResetCause, Seal, encode, refuse_version,
    },
    record::{self, Defect, Figures, SensorIdentity},
};
use imucal_host::device::{DeviceError, Session};
use nalgebra::Vector3;

#[allow(dead_code, reason = "power cuts and wear are the storage's own tests")]
#[path = "../firmware-example/tests/device/nor.rs"]
mod nor;

const SERIAL: &str = "00300017";
const NONCES: Nonces = Nonces { host: 0x0102_0304_0506_0708, device: 0x1112_1314_1516_1718 };

fn documents() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../imucal-host/docs")
}

fn document() -> String {
    std::fs::read_to_string(documents().join("protocol.md")).expect("the document")
}

/// The bytes 0 to 31.
fn key() -> Key {
    Key::new(core::array::from_fn(|k| k as u8))
}

fn unit() -> SensorIdentity {
    SensorIdentity { name: "bench".parse().expect("short"), serial: SERIAL.parse().expect("short") }
}

/// Rows of the tables under a heading of the document: cells without blanks around them.
fn rows(heading: &str) -> Vec<Vec<String>> {
    let text = document();
    let (_, under) = text.split_once(&format!("\n## {heading}\n")).expect("the heading");
    let under = under.split("\n## ").next().unwrap_or_default();
    let cells = |line: &str| line.split('|').map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
    under.lines().filter(|line| line.starts_with('|')).map(|line| cells(line)[1..].to_vec()).collect()
}

/// Message bytes behind the header, by the shortest way.
fn message(message: &impl serde::Serialize, origin: Origin) -> Vec<u8> {
    let frame = framed(message, origin, 1, None);
    let mut receiver = imucal_core::link::Receiver::default();
    let plain = frame.iter().find_map(|byte| receiver.push(*byte).map(|f| f.expect("whole").to_vec()));
    let plain = plain.expect("a frame");
    plain[10..plain.len() - 4].to_vec()
}

fn framed(message: &impl serde::Serialize, origin: Origin, id: u32, key: Option<&Key>) -> Vec<u8> {
    let header = Header { id, origin, session: NONCES.session() };
    let seal = key.map(|key| Seal { key, nonces: NONCES });
    encode(&header, message, seal, &mut [0; MAX_FRAME]).expect("room").to_vec()
}

fn golden() -> Vec<(&'static str, Vec<u8>)> {
    let identify = Header { id: 1, origin: Origin::Host, session: 0 };
    let identity = Identity {
        unit: unit(),
        firmware: (0, 1, 0),
        record_version: (1, 0),
        nonce: NONCES.device,
        keyed: true,
        capacity: imucal_core::link::Capacity {
            points: 256,
            poses: 64,
            turns: 48,
            blocks: 2048,
            particles: 40,
        },
    };
    let identify = encode(&identify, &Request::Identify { nonce: NONCES.host }, None, &mut [0; MAX_FRAME])
        .expect("room")
        .to_vec();
    let put = Request::PutRecord { record: &[1, 2, 3], replace: false };
    let raw = imucal_core::link::Values::from_slice(&[[1.0, -2.0, 0.5]]).expect("room");
    let correct = Request::Correct { sensor: record::Sensor::Gyroscope, temperature: 25.0, raw: raw.clone() };
    let (host, device, key) = (Origin::Host, Origin::Device, Some(&key()));
    vec![
        ("Identify, id 1", identify),
        ("Identity, id 1", framed(&Reply::Identity(identity), device, 1, None)),
        ("Status, id 1", framed(&Request::Status, host, 1, None)),
        ("Correct, id 2: gyroscope, 25 °C, (1, −2, 0.5)", framed(&correct, host, 2, None)),
        ("Corrected, id 2: (1, −2, 0.5)", framed(&Reply::Corrected(raw), device, 2, None)),
        ("PutRecord, id 3: 01 02 03, without replace, no seal", framed(&put, host, 3, None)),
        ("Fault, id 3: KeyNeeded", framed(&Reply::Fault(Fault::KeyNeeded), device, 3, None)),
        ("PutRecord, id 4, the same with a seal", framed(&put, host, 4, key)),
        ("Stored, id 4: 300, with a seal", framed(&Reply::Stored { sequence: 300 }, device, 4, key)),
        (
            "Fault, id 4294967295: Stale, last 4",
            framed(&Reply::Fault(Fault::Stale { last: 4 }), device, u32::MAX, None),
        ),
        ("refusal of a frame of version 3, id 5", refuse_version(5, &mut [0; MAX_FRAME]).to_vec()),
    ]
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
}

#[test]
fn the_golden_frames_of_the_document_are_those_of_the_code() {
    let written: Vec<String> = rows("Golden frames")[2..].iter().map(|row| row[..2].join(" | ")).collect();
    let expected: Vec<String> =
        golden().iter().map(|(name, frame)| format!("{name} | `{}`", hex(frame))).collect();
    let table: Vec<String> = expected.iter().map(|row| format!("| {row} |")).collect();
    assert_eq!(written, expected, "the table is:\n{}", table.join("\n"));
    assert!(document().contains(&format!("0x{:08x}", NONCES.session())));
}

#[test]
fn the_numbers_of_the_document_are_those_of_the_code() {
    let name = |debug: String| debug.split([' ', '(', '{']).next().unwrap_or_default().to_owned();
    let written = |heading: &str, columns: usize| -> Vec<(String, u8)> {
        let rows = rows(heading).into_iter().filter(|row| row.len() == columns);
        rows.filter_map(|row| Some((row[1].clone(), row[0].parse().ok()?))).collect()
    };
    // Each number, read as a message with fields of zeros, is the variant of that name.
    let requests = written("Requests", 6);
    for (expected, number) in &requests {
        let bytes = [&[*number][..], &[0; 80]].concat();
        let (request, _) = postcard::take_from_bytes::<Request<'_>>(&bytes).expect("a request");
        assert_eq!(
            (name(format!("{request:?}")), &message(&request, Origin::Host)[0]),
            (expected.clone(), number)
        );
    }
    let replies = written("Replies", 4);
    let (faults, replies): (Vec<_>, Vec<_>) = (written("Replies", 5), replies);
    for (expected, number) in &replies {
        let bytes = [&[*number][..], &[0; 80]].concat();
        let (reply, _) = postcard::take_from_bytes::<Reply<'_>>(&bytes).expect("a reply");
        assert_eq!(&name(format!("{reply:?}")), expected);
    }
    for (expected, number) in &faults {
        let bytes = [*number, 0, 0, 0];
        let (fault, _) = postcard::take_from_bytes::<Fault>(&bytes).expect("a fault");
        assert_eq!(&name(format!("{fault:?}")), expected);
    }
    for number in 0..5 {
        let bytes = [&[number][..], &[0; 20]].concat();
        let (defect, _) = postcard::take_from_bytes::<Defect>(&bytes).expect("a defect");
        let expected = format!("{number} {} (", name(format!("{defect:?}")));
        assert!(document().contains(&expected), "{expected}");
    }
    // And the next number is none.
    assert!(postcard::take_from_bytes::<Defect>(&[5, 0, 0, 0]).is_err());
    assert!(
        postcard::take_from_bytes::<Figures>(&[22]).is_ok_and(|(last, _)| last == Figures::NonlinearityStd)
    );
    assert!(postcard::take_from_bytes::<Figures>(&[23]).is_err());
    assert!(postcard::take_from_bytes::<RecordState>(&[7]).is_ok_and(|(last, _)| last == RecordState::Lost));
    assert!(postcard::take_from_bytes::<RecordState>(&[8]).is_err());
    assert!(
        postcard::take_from_bytes::<Request<'_>>(&[[requests.len() as u8; 1].as_slice(), &[0; 80]].concat())
            .is_err()
    );
    assert!(
        postcard::take_from_bytes::<Reply<'_>>(&[[replies.len() as u8; 1].as_slice(), &[0; 80]].concat())
            .is_err()
    );
    assert!(postcard::take_from_bytes::<Fault>(&[faults.len() as u8, 0, 0, 0]).is_err());
}

/// A line of TCP.
struct Wire {
    stream: TcpStream,
    come: VecDeque<u8>,
    closed: Rc<Cell<bool>>,
}

impl ByteLink for Wire {
    fn receive(&mut self) -> Option<u8> {
        if self.come.is_empty() {
            let mut bytes = [0; 256];
            match self.stream.read(&mut bytes) {
                Ok(0) => self.closed.set(true),
                Ok(count) => self.come.extend(&bytes[..count]),
                Err(cause) if cause.kind() == ErrorKind::WouldBlock => {}
                Err(_) => self.closed.set(true),
            }
        }
        self.come.pop_front()
    }

    fn send(&mut self, byte: u8) -> bool {
        match self.stream.write(&[byte]) {
            Ok(count) => count == 1,
            // What nobody reads any more is gone.
            Err(cause) => cause.kind() != ErrorKind::WouldBlock,
        }
    }
}

/// The milliseconds of this machine.
struct Uptime(Instant);

impl Clock for Uptime {
    fn uptime(&mut self) -> u32 {
        self.0.elapsed().as_millis() as u32
    }
}

/// A co-processor at a port of this machine, which starts again for each that connects; its port.
fn served(key: Option<&'static Key>) -> u16 {
    let listener = TcpListener::bind(("127.0.0.1", 0)).expect("a port");
    let port = listener.local_addr().expect("bound").port();
    thread::spawn(move || {
        let mut flash = nor::Nor::new(2);
        for (boot, stream) in (1..).zip(listener.incoming()) {
            let stream = stream.expect("a connection");
            stream.set_nonblocking(true).expect("a socket");
            stream.set_nodelay(true).expect("a socket");
            flash = serve(stream, flash, key, boot);
        }
    });
    port
}

/// Serves one connection; the flash it leaves.
fn serve(stream: TcpStream, flash: nor::Nor, key: Option<&Key>, boot: u64) -> nor::Nor {
    let closed = Rc::new(Cell::new(false));
    let link = Wire { stream, come: VecDeque::new(), closed: closed.clone() };
    let clock = Uptime(Instant::now());
    let last_reset = LastReset { cause: ResetCause::PowerOn, address: 0, resets: 0 };
    let board = Board { link, flash, clock, sensors: NoSensor, stack: || None, last_reset };
    let mut memory = Memory::<40, 12, 8, 48, 3>::new();
    let mut device = Coprocessor::new(board, unit(), Guard::new(key, boot), &mut memory);
    while !closed.get() {
        if !device.poll() {
            thread::sleep(Duration::from_micros(200));
        }
    }
    device.into_parts().1.expect("the flash serves")
}

/// Runs Python where the client lies; what it printed.
fn python(arguments: &[&str]) -> String {
    let output = Command::new("python3")
        .current_dir(documents())
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .args(arguments)
        .output()
        .expect("python3 is there");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

#[test]
fn the_client_of_the_document_writes_and_reads_the_golden_frames() {
    let frames = golden();
    let bytes = |name: &str| {
        hex(&frames.iter().find(|(found, _)| found.starts_with(name)).expect("golden").1).replace(' ', "")
    };
    let script = format!(
        "import client as c\n\
         print(c.frame(1, 0, b'\\0' + c.varint({})).hex())\n\
         print(c.frame(1, {}, b'\\1').hex())\n\
         print(c.plain_of(bytes.fromhex('{}')[:-1])[10:-4].hex())\n",
        NONCES.host,
        NONCES.session(),
        bytes("Stored"),
    );
    // Number 3, 300 as a varint, and the seal.
    let printed = python(&["-c", &script]);
    let lines: Vec<&str> = printed.lines().collect();
    assert_eq!(lines[..2], [bytes("Identify"), bytes("Status")]);
    assert!(lines[2].starts_with("03ac02") && lines[2].len() == 2 * (3 + 16), "{printed}");
}

#[test]
fn the_client_of_the_document_puts_a_record_and_corrects_by_it() {
    let folder = tempfile::tempdir().expect("a scratch folder");
    let path = folder.path().join("cal.bin");
    std::fs::write(&path, RECORD).expect("written");
    let record = record::decode(RECORD).expect("golden");
    let corrector = Corrector::<f32>::from(record.acc.as_ref().expect("it has one"));
    let corrected = corrector.apply_at(&Vector3::new(33_000.0, 32_000.0, 31_000.0), 31.0);
    let bytes: Vec<u8> = corrected.iter().flat_map(|x| x.to_le_bytes()).collect();
    let printed = python(&["client.py", "127.0.0.1", &served(None).to_string(), &path.display().to_string()]);
    let expected = format!(
        "bench, serial {SERIAL}\nstored as record 1\ngiven back alike\ncorrected {}\n",
        hex(&bytes).replace(' ', "")
    );
    assert_eq!(printed, expected);
}

static KEY: Key = Key::new([9; 32]);

fn session(port: u16, key: Option<Key>) -> Session {
    let address = format!("tcp:127.0.0.1:{port}").parse().expect("an address");
    Session::open_with(&address, None, key).unwrap_or_else(|error| panic!("{error}"))
}

fn fault<T: std::fmt::Debug>(done: Result<T, DeviceError>) -> Fault {
    match done {
        Err(DeviceError::Refused { fault, .. }) => fault,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_host_with_the_key_replaces_a_record_and_one_without_does_not() {
    let port = served(Some(&KEY));
    let mut host = session(port, None);
    assert!(host.identity().keyed);
    assert_eq!(fault(host.put_record(RECORD, true)), Fault::KeyNeeded);
    drop(host);
    let mut host = session(port, Some(Key::new([8; 32])));
    assert_eq!(fault(host.put_record(RECORD, true)), Fault::WrongSeal);
    drop(host);
    let mut host = session(port, Some(KEY.clone()));
    assert_eq!(host.put_record(RECORD, true).unwrap_or_else(|error| panic!("{error}")), 1);
    let stored = host.record().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(stored.as_deref(), Some(RECORD));
    host.lock().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(fault(host.put_record(RECORD, true)), Fault::Locked);
    host.unlock().unwrap_or_else(|error| panic!("{error}"));
    host.put_record(RECORD, true).unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn a_host_without_a_key_locks_a_device_and_cannot_unlock_it() {
    let mut host = session(served(None), None);
    host.put_record(RECORD, false).unwrap_or_else(|error| panic!("{error}"));
    host.lock().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(fault(host.put_record(RECORD, false)), Fault::Locked);
    assert_eq!(fault(host.unlock()), Fault::Locked);
    assert!(host.status().is_ok_and(|status| status.locked));
}

#[test]
fn a_device_of_version_1_is_an_error_that_says_so() {
    let listener = TcpListener::bind(("127.0.0.1", 0)).expect("a port");
    let address = format!("tcp:{}", listener.local_addr().expect("bound")).parse().expect("an address");
    thread::spawn(move || {
        let (mut stream, _) = listener.accept().expect("the host connects");
        let _frame = stream.read(&mut [0; 256]);
        // Its words are those of a refusal, of the id 1: but that it speaks version 1.
        let plain = [1, 1, 0, 0, 0, 9, 2, 1];
        let checksum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&plain).to_le_bytes();
        assert!(!checksum.contains(&0));
        let frame = [&[3, 1, 1, 1, 1, 8, 9, 2, 1][..], &checksum, &[0]].concat();
        stream.write_all(&frame).expect("it is read");
        let _end = stream.read_to_end(&mut Vec::new());
    });
    let error = Session::open(&address, None).err().expect("another version").to_string();
    assert!(error.contains("it speaks version 1 of the protocol, and this program version 2"), "{error}");
}

//! The program and the emulated co-processor, and what lies between: TCP with a device that computes otherwise, and a
//! serial port.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use imucal_core::link::{MAX_FRAME, Receiver, Reply, encode, split};
use imucal_tests::firmware::{BOARDS, build, ready};
use imucal_tests::program::{self, Ended};
use imucal_tests::simulated;

const PROGRAM: &str = env!("CARGO_BIN_EXE_imucal-under-test");

fn image() -> PathBuf {
    build(BOARDS[0], "coprocessor", &[]).unwrap_or_else(|refusal| panic!("{refusal}"))
}

/// A folder with a recording, `small.csv`, and its calibration, `cal.bin`.
struct Bench(tempfile::TempDir);

impl Bench {
    fn new() -> Self {
        let bench = Self(tempfile::tempdir().expect("there is room for a folder"));
        simulated::write_small(bench.0.path());
        bench.run("calibrate small.csv --record cal.bin", "").with(0);
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Arguments between blanks, those with a dot files of the folder, and where the device is.
    fn run(&self, line: &str, device: &str) -> Ended {
        let word = |word: &str| {
            if word.contains('.') { self.path(word).display().to_string() } else { word.into() }
        };
        let mut arguments: Vec<String> = line.split_whitespace().map(word).collect();
        if !device.is_empty() {
            arguments.extend(["--device".into(), device.into()]);
        }
        program::run(PROGRAM, &[], &arguments)
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|cause| panic!("{name}: {cause}"))
    }
}

/// QEMU, ended with its test.
struct Emulated(Child);

impl Emulated {
    /// With its UART at the end of that.
    fn start(uart: &str) -> Self {
        let child = Command::new("qemu-system-arm")
            .args(["-machine", BOARDS[0].machine, "-display", "none", "-monitor", "none", "-serial", uart])
            .arg("-kernel")
            .arg(image())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        Self(child.expect("QEMU starts"))
    }
}

impl Drop for Emulated {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A co-processor at a port of this machine, whose answers pass through `change`; its address.
fn changed(change: impl FnMut(&mut Reply<'_>) + Send + 'static) -> (Emulated, String) {
    let [inner, outer] = [(); 2].map(|()| TcpListener::bind(("127.0.0.1", 0)).expect("a port"));
    let uart = format!("tcp:{},nodelay=on", inner.local_addr().expect("bound"));
    let qemu = Emulated::start(&uart);
    let address = format!("tcp:{}", outer.local_addr().expect("bound"));
    std::thread::spawn(move || {
        let (device, _) = inner.accept().expect("QEMU connects");
        let (host, _) = outer.accept().expect("the program connects");
        let (mut to_device, mut from_host) = (clone(&device), clone(&host));
        std::thread::spawn(move || std::io::copy(&mut from_host, &mut to_device));
        pass(device, host, change);
    });
    (qemu, address)
}

fn clone(stream: &TcpStream) -> TcpStream {
    stream.set_nodelay(true).expect("a socket");
    stream.try_clone().expect("a socket")
}

/// Passes frames on until either end is gone.
fn pass(device: TcpStream, mut host: TcpStream, mut change: impl FnMut(&mut Reply<'_>)) {
    let mut receiver = Receiver::default();
    for byte in BufReader::new(device).bytes() {
        let Ok(byte) = byte else { return };
        let Some(Ok(frame)) = receiver.push(byte) else { continue };
        let frame = split(frame).expect("whole");
        let mut reply: Reply<'_> = frame.read().expect("a reply");
        change(&mut reply);
        let mut buffer = [0; MAX_FRAME];
        if host.write_all(encode(&frame.header, &reply, None, &mut buffer).expect("it fits")).is_err() {
            return;
        }
    }
}

#[test]
fn verify_replays_through_the_device_and_finds_every_bit_the_same() {
    if !ready() {
        return;
    }
    let bench = Bench::new();
    let device = format!("qemu:{}", image().display());
    bench.run("verify small.csv --calibration cal.bin", &device).with(0).printing(&[
        "accelerometer: fitted on the device: equal bit for bit",
        "gyroscope: fitted on the device: equal bit for bit",
        "magnetometer: fitted on the device: equal bit for bit",
        "stored and read back: equal bit for bit",
        "samples corrected on the device: equal bit for bit\n",
        "\nequivalent\n",
    ]);
}

#[test]
fn verify_reports_a_device_one_ulp_off_in_a_sample_or_parameter() {
    if !ready() {
        return;
    }
    let bench = Bench::new();
    let verify = "verify small.csv --calibration cal.bin";
    let mut frames = 0;
    let (_qemu, device) = changed(move |reply| {
        if let Reply::Corrected(values) = reply {
            frames += 1;
            if frames == 3 {
                values[5][1] = values[5][1].next_up();
            }
        }
    });
    // The sixth sample of the third frame of 48.
    bench.run(verify, &device).with(1).printing(&[
        "magnetometer: fitted on the device: equal bit for bit",
        "corrected on the device: DIFFERENT: 1 of them, the first is 101\n",
        "\nNOT equivalent\n",
    ]);

    let (_qemu, device) = changed(|reply| {
        if let Reply::Report(report) = reply {
            report.theta[8] = report.theta[8].next_down();
        }
    });
    let ended = bench.run(verify, &device).with(1);
    ended.printing(&["accelerometer: fitted on the device: DIFFERENT", "\nNOT equivalent\n"]);
}

#[test]
fn a_device_that_is_not_there_is_an_error_that_says_what_to_do() {
    let bench = Bench::new();
    let verify = "verify small.csv --calibration cal.bin";
    let advice = ["cannot be opened", "build the image"];
    bench.run(verify, "qemu:no-such-image").with(2).telling(&advice);
    let advice = ["cannot be opened", "check the port's name"];
    bench.run(verify, "serial:/dev/no-such-port@9600").with(2).telling(&advice);
    // Nothing has bound it since it was given back.
    let gone = TcpListener::bind(("127.0.0.1", 0)).and_then(|port| port.local_addr()).expect("a port");
    bench
        .run(verify, &format!("tcp:{gone}"))
        .with(2)
        .telling(&["cannot be opened", "something listens there"]);
}

#[cfg(unix)]
#[test]
fn over_a_serial_port_a_record_is_put_got_and_used() {
    if !ready() {
        return;
    }
    let bench = Bench::new();
    let mut qemu = Emulated::start("pty");
    let said = qemu.0.stdout.take().expect("piped");
    // `char device redirected to /dev/pts/1 (label serial0)`
    let line = BufReader::new(said).lines().next().expect("a line").expect("text");
    let port = line.split_whitespace().find(|word| Path::new(word).is_absolute());
    let device = format!("serial:{}", port.unwrap_or_else(|| panic!("no port in {line}")));

    bench.run("device identify", &format!("{device}@115200")).with(0).printing(&[
        "emulated",
        "record 0: none is stored",
        "since its power came on",
    ]);
    bench.run("device stream small.csv --out early.csv", &device).with(1).telling(&["no record is stored"]);
    bench.run("device put cal.bin", &device).with(0).printing(&["stored as record 1"]);
    bench.run("device get --out got.bin", &device).with(0);
    assert_eq!(bench.bytes("got.bin"), bench.bytes("cal.bin"));
    bench.run("device stream small.csv --out device.csv", &device).with(0);
    bench.run("apply small.csv --calibration cal.bin --out host.csv", "").with(0);
    assert_eq!(bench.bytes("device.csv"), bench.bytes("host.csv"));
}

//! The image that calibrates without a host, under QEMU: raw samples in its memory, a record in its flash.

use std::{
    fs::OpenOptions,
    io::{Read, Seek, SeekFrom, Write},
    path::Path,
    time::Duration,
};

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use firmware_example::{
    RECORD_2,
    standalone::{self, HEADER, MAGIC, SAMPLE, Standalone},
    storage::Slots,
};
use imucal_core::record::{self, SensorIdentity};
use imucal_host::{
    calibrate::{Options, calibrate},
    effect,
    recording::{Recording, SensorKind, check::integrity, unit::STANDARD_GRAVITY},
    simulator::{Dose, Programme, Simulation},
};
use imucal_tests::{
    data,
    firmware::{BOARDS, build, ready},
    simulated,
};

/// PSRAM of the emulated board, and where the tape lies in it.
const PSRAM: u64 = 16 << 20;
const TAPE: u64 = 1 << 20;
/// The record's pages.
const FLASH: usize = 4 * 4096;

/// A recording as a tape: raw values, as its file has them.
fn tape(recording: &Recording) -> Vec<u8> {
    let integrity = integrity::inspect(recording);
    let gravity = recording.manifest.site.gravity().unwrap_or(STANDARD_GRAVITY) as f32;
    let mut bytes = Vec::with_capacity(HEADER + SAMPLE * recording.time.len());
    bytes.extend(MAGIC);
    bytes.extend((recording.time.len() as u32).to_le_bytes());
    bytes.extend(20_000u32.to_le_bytes());
    bytes.extend([gravity, f32::NAN].map(f32::to_le_bytes).concat());
    for kind in SensorKind::ALL {
        let nominal = recording.sensor(kind).map(|sensor| sensor.nominal);
        let (offset, per_unit) = nominal.map_or((0.0, 1.0), |n| (n.to_raw(0.0), n.per_unit));
        bytes.extend([offset as f32, per_unit as f32].map(f32::to_le_bytes).concat());
    }
    bytes.extend([f32::INFINITY; 3].map(f32::to_le_bytes).concat());
    let down = recording.manifest.site.field_points_down();
    bytes.extend(down.map_or(0.0f32, |down| if down { 1.0 } else { -1.0 }).to_le_bytes());
    assert_eq!(bytes.len(), HEADER);
    for (row, time) in recording.time.iter().enumerate() {
        bytes.extend((((time - recording.time[0]) * 1e6).round() as u64).to_le_bytes());
        for kind in SensorKind::ALL {
            let usable = integrity.sensor(kind).is_none_or(|sensor| sensor.usable[row]);
            let raw =
                recording.sensor(kind).filter(|_| usable).map(|s| s.values[row].map(|v| s.nominal.to_raw(v)));
            let raw = raw.map_or([f32::NAN; 3], |raw| raw.map(|value| value as f32).into());
            bytes.extend(raw.map(f32::to_le_bytes).concat());
        }
        let temperature = recording.temperature.as_ref().map_or(f32::NAN, |rows| rows[row] as f32);
        bytes.extend(temperature.to_le_bytes());
    }
    bytes
}

/// Flash in memory, without the rules of NOR: those are `firmware-example`'s own tests.
struct Memory(Vec<u8>);

impl ErrorType for Memory {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Memory {
    const READ_SIZE: usize = 4;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        bytes.copy_from_slice(&self.0[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl NorFlash for Memory {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = 4096;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        self.0[from as usize..to as usize].fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        self.0[offset as usize..][..bytes.len()].copy_from_slice(bytes);
        Ok(())
    }
}

/// The same code on the host; its lines, and what its flash holds.
fn on_host(tape: &[u8], flash: &mut Vec<u8>) -> String {
    let unit =
        SensorIdentity { name: "emulated".parse().expect("short"), serial: "".parse().expect("short") };
    let mut lines = String::new();
    let place = |settings| Box::leak(Box::new(Standalone::new(settings)));
    // The flash is lent: what is written stays.
    let mut memory = Memory(std::mem::take(flash));
    standalone::run(place, &mut &*tape, &mut memory, &unit, &mut lines).expect("a String takes lines");
    *flash = memory.0;
    lines
}

/// The image with a tape; its lines.
fn on_device(folder: &Path, tape: &[u8]) -> String {
    let path = build(BOARDS[0], "standalone", &[]).unwrap_or_else(|refusal| panic!("{refusal}"));
    let memory = folder.join("memory.bin");
    let mut file = OpenOptions::new().create(true).truncate(false).write(true).open(&memory).expect("a file");
    file.set_len(PSRAM).expect("room");
    file.seek(SeekFrom::Start(TAPE)).expect("a place");
    file.write_all(tape).expect("room");
    let backend = format!("memory-backend-file,id=nv,size=16M,mem-path={},share=on", memory.display());
    let output = assert_cmd::Command::new("qemu-system-arm")
        .args(["-object", &backend, "-machine", &format!("{},memory-backend=nv", BOARDS[0].machine)])
        .args(["-nographic", "-monitor", "none", "-serial", "none", "-chardev", "stdio,id=console"])
        .args(["-semihosting-config", "enable=on,target=native,chardev=console", "-kernel"])
        .arg(path)
        .timeout(Duration::from_secs(60))
        .output()
        .expect("QEMU starts");
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    String::from_utf8(output.stdout).expect("the image writes text")
}

/// The record in the flash of the emulated board.
fn stored(folder: &Path) -> Option<record::CalibrationRecord> {
    let mut bytes = vec![0; FLASH];
    std::fs::File::open(folder.join("memory.bin")).expect("a file").read_exact(&mut bytes).expect("bytes");
    record_in(bytes)
}

fn record_in(bytes: Vec<u8>) -> Option<record::CalibrationRecord> {
    let mut buffer = [0; record::MAX_LEN];
    let mut slots = Slots::open(Memory(bytes)).expect("a flash");
    record::decode(slots.read(&mut buffer).expect("readable")).ok()
}

#[test]
fn raw_samples_alone_end_in_a_stored_record_with_the_bits_of_the_host() {
    if !ready() {
        return;
    }
    for name in ["mpu9150-0.csv.gz", "mpu9150-1.csv.gz", "xsens-mti.csv.gz", "broad-01-undisturbed.csv.gz"] {
        let Some(path) = data::real(name) else { return };
        let recording = Recording::read(&path).expect("a good recording");
        let folder = tempfile::tempdir().expect("a folder");
        let tape = tape(&recording);
        let device = on_device(folder.path(), &tape);
        println!("{name}\n{device}");
        let mut flash = vec![0; FLASH];
        assert_eq!(device, on_host(&tape, &mut flash), "{name}");
        let record = stored(folder.path()).expect("a record");
        let calibration = calibrate(&recording, &Options::default(), &|_| {});
        assert_eq!(
            record.acc.is_some(),
            calibration.sensor(SensorKind::Acc).is_some_and(|acc| acc.passed().is_some())
        );
        // Stored once, it is not replaced by a session that is no surer.
        assert!(on_device(folder.path(), &tape).contains("nothing stored"));
    }
}

#[test]
fn a_magnetometer_ends_in_the_accelerometer_s_axes_with_the_bits_of_the_host() {
    if !ready() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let tape = tape(&simulated::tumbled(24, 4000));
    let device = on_device(folder.path(), &tape);
    let mut flash = vec![0; FLASH];
    assert_eq!(device, on_host(&tape, &mut flash));
    let [there, here] = [stored(folder.path()), record_in(flash)]
        .map(|record| record.expect("a record").mag.expect("accepted"));
    assert_eq!((there.gain, there.quality), (here.gain, here.quality));
    // In its own axes it would be upper triangular.
    let [_, [y, ..], [z, w, _]] = there.gain;
    assert!([y, z, w].iter().all(|entry| *entry != 0.0), "{:?}", there.gain);
}

#[test]
fn a_session_that_warms_and_cools_ends_in_a_record_with_terms_of_temperature() {
    if !ready() {
        return;
    }
    let dose = |id: &str, values: [f64; 3]| Dose {
        effect: effect::find(id).expect("an effect"),
        values: values.to_vec(),
    };
    let slopes = [2.1e-3, -1.3e-3, 0.8e-3];
    let doses = vec![dose("acc.temp_bias", slopes), dose("acc.temp_scale", [1.5e-4; 3])];
    let simulation =
        Simulation { programme: Programme::Full, rate: 50.0, seed: 100, doses, ..Simulation::default() };
    let recording = simulation.record("thermal.csv").expect("a possible recording");
    let folder = tempfile::tempdir().expect("a folder");
    let tape = tape(&recording);
    let device = on_device(folder.path(), &tape);
    let mut flash = vec![0; FLASH];
    assert_eq!(device, on_host(&tape, &mut flash));
    let [there, here] = [stored(folder.path()), record_in(flash)]
        .map(|record| record.expect("a record").acc.expect("accepted"));
    assert_eq!(there.temperature, here.temperature);
    let per_unit = recording.acc.as_ref().expect("recorded").nominal.per_unit;
    let found = there.temperature.expect("terms").bias_slope.map(|slope| f64::from(slope) / per_unit);
    assert!(found.iter().zip(slopes).all(|(found, slope)| (found - slope).abs() < 4e-4), "{found:?}");
}

#[test]
fn a_record_that_the_firmware_cannot_read_stays_where_it_is() {
    let tape = tape(&simulated::tumbled(24, 4000));
    for unreadable in [RECORD_2, &[0x55; 40]] {
        let mut slots = Slots::open(Memory(vec![0xFF; FLASH])).expect("a flash");
        let mut writing = slots.begin(unreadable).expect("it is short");
        while slots.step(&mut writing).expect("a flash").is_none() {}
        let mut flash = slots.close().0;
        let before = flash.clone();
        let lines = on_host(&tape, &mut flash);
        assert!(lines.contains("accepted") && lines.contains("firmware cannot read"), "{lines}");
        assert!(flash == before);
    }
}

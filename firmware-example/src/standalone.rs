//! A session without a host: raw samples in, a stored record out.
//!
//! Samples come from a tape, memory that something else has filled (of the emulated board, a file):
//!
//! | offset | bytes | what |
//! | --- | --- | --- |
//! | 0 | 4 | `TAPE` |
//! | 4 | 4 | number of samples |
//! | 8 | 4 | date, days since 1970 |
//! | 12 | 4, 4 | gravity, m/s², and length of the field, µT (NaN: not known) |
//! | 20 | 3 × 8 | of each sensor: raw value at zero, and raw units a nominal one |
//! | 44 | 3 × 4 | of each sensor: raw value beyond which it clips |
//! | 56 | 4 | where the field points: above zero down, below zero up, zero where that is not known |
//! | 60 | 48 each | a sample: time, µs (8); three raw values of each sensor, NaN where it has none (36); temperature, °C (4) |
//!
//! All numbers are little-endian. A sample is corrected to nominal SI, pushed, and one slice of work is done, as a main loop would.

use core::fmt::{self, Write};

use crate::storage::{Slots, StorageError};
use embedded_storage::nor_flash::NorFlash;
use imucal_core::{
    link::{CaptureSensor, CaptureTask, RawSample},
    record::{self, CalibrationRecord, Date, RawUnit, Sensor, SensorIdentity},
    session::{Session, SessionSettings},
};

/// What a tape begins with.
pub const MAGIC: [u8; 4] = *b"TAPE";
/// Bytes before the first sample.
pub const HEADER: usize = 60;
/// Bytes of a sample.
pub const SAMPLE: usize = 48;

/// The session that there is memory for: its poses, its turns by their blocks, and 64 places of the field.
pub type Standalone = Session<POSES, BLOCKS, 64>;
/// Rests that it keeps.
pub const POSES: usize = 38;
/// Blocks of a turn.
pub const BLOCKS: usize = 4;

/// Gives bytes of the tape, from an offset on.
pub trait Tape {
    /// Fills the buffer; with zeros beyond the end.
    fn read(&mut self, offset: usize, into: &mut [u8]);
}

impl Tape for &[u8] {
    fn read(&mut self, offset: usize, into: &mut [u8]) {
        let from = self.get(offset..).unwrap_or_default();
        for (slot, byte) in into.iter_mut().zip(from.iter().chain(core::iter::repeat(&0))) {
            *slot = *byte;
        }
    }
}

/// What a tape says of itself.
struct Header {
    samples: u32,
    date: Date,
    task: CaptureTask,
    settings: SessionSettings,
}

fn number(bytes: &[u8], at: usize) -> f32 {
    f32::from_bits(whole(bytes, at))
}

fn whole(bytes: &[u8], at: usize) -> u32 {
    let four = bytes.get(at..).and_then(|rest| rest.first_chunk::<4>());
    u32::from_le_bytes(four.copied().unwrap_or_default())
}

fn three(bytes: &[u8], at: usize) -> [f32; 3] {
    [number(bytes, at), number(bytes, at + 4), number(bytes, at + 8)]
}

impl Header {
    fn read(tape: &mut impl Tape) -> Option<Self> {
        let mut bytes = [0; HEADER];
        tape.read(0, &mut bytes);
        if !bytes.starts_with(&MAGIC) {
            return None;
        }
        let usual = SessionSettings::default();
        let sensors = [0, 1, 2].map(|index| {
            let (offset, per_unit) = (number(&bytes, 20 + 8 * index), number(&bytes, 24 + 8 * index));
            CaptureSensor {
                target: usual.target.get(index).copied().unwrap_or(0.0),
                full_scale: libm::fabsf(number(&bytes, 44 + 4 * index) / per_unit),
                unit_in: RawUnit::Counts,
                offset,
                per_unit,
            }
        });
        let field = Some(number(&bytes, 16)).filter(|field| field.is_finite());
        let down = number(&bytes, 56);
        let field_down = (down != 0.0 && down.is_finite()).then_some(down > 0.0);
        let task = CaptureTask { gravity: number(&bytes, 12), field, field_down, hold: usual.hold, sensors };
        let date = Date::from_days(u16::try_from(whole(&bytes, 8)).unwrap_or(0).into());
        Some(Self { samples: whole(&bytes, 4), date, task, settings: task.settings()? })
    }
}

/// Feeds a session from a tape, and stores what it finds where it is surer than what the flash holds; writes a line for each sensor
/// and one for the flash. `place` puts a session where it stays: it is larger than a stack may be.
///
/// # Errors
///
/// Those of `out`. A tape or a flash that cannot be used is a line, and not an error.
pub fn run<'s, F: NorFlash>(
    place: impl FnOnce(SessionSettings) -> &'s mut Standalone,
    tape: &mut impl Tape,
    flash: F,
    unit: &SensorIdentity,
    out: &mut impl Write,
) -> fmt::Result {
    let Some(header) = Header::read(tape) else { return writeln!(out, "no tape") };
    let session = place(header.settings);
    play(session, tape, &header);
    for sensor in Sensor::ALL {
        report(session, sensor, out)?;
    }
    let guide = session.guide();
    writeln!(out, "{} rests, {} turns, {} places", guide.rests, guide.turns, guide.points)?;
    match store(session, &header, flash, unit) {
        Ok(Some(number)) => writeln!(out, "stored as number {number}"),
        Ok(None) => writeln!(out, "nothing stored: no sensor is accepted and surer than before"),
        Err(NotStored::Unreadable) => {
            writeln!(out, "nothing stored: the flash holds a record that this firmware cannot read")
        }
        Err(NotStored::Flash) => writeln!(out, "the flash did not take it"),
    }
}

/// Why the flash holds what it held.
enum NotStored {
    /// A record of higher order, or of newer firmware: it may be better than what a session finds.
    Unreadable,
    /// The flash cannot be used.
    Flash,
}

impl From<StorageError> for NotStored {
    fn from(error: StorageError) -> Self {
        if error == StorageError::TooLong { Self::Unreadable } else { Self::Flash }
    }
}

#[inline(never)]
fn play(session: &mut Standalone, tape: &mut impl Tape, header: &Header) {
    let mut bytes = [0; SAMPLE];
    for index in 0..header.samples as usize {
        tape.read(HEADER + index * SAMPLE, &mut bytes);
        let sample = RawSample {
            time: u64::from(whole(&bytes, 4)) << 32 | u64::from(whole(&bytes, 0)),
            raw: [8, 20, 32].map(|at| Some(three(&bytes, at))),
            temperature: number(&bytes, 44),
        };
        header.task.push(session, &sample);
        session.work();
    }
    session.finish();
    while session.work() {}
    // Without rests that show how it lies, the magnetometer stays in its own axes.
    let _own_axes = session.align_axes();
}

/// Whether a sensor is accepted, and the bits of what was found.
fn report(session: &Standalone, sensor: Sensor, out: &mut impl Write) -> fmt::Result {
    let Some(estimate) = session.estimate(sensor) else {
        return writeln!(out, "{}: too little was observed", sensor.symbol());
    };
    let verdict = if estimate.verdict.is_ok() { "accepted" } else { "refused" };
    write!(out, "{}: {verdict}", sensor.symbol())?;
    let (triad, std) = (&estimate.triad, &estimate.std);
    for value in triad.gain.iter().chain(triad.bias.iter()).chain(std.gain.iter()).chain(std.bias.iter()) {
        write!(out, " {:08x}", value.to_bits())?;
    }
    writeln!(out)
}

/// The stored record with the sensors that are surer now; its number, or `None` where none is.
#[inline(never)]
fn store<F: NorFlash>(
    session: &Standalone,
    header: &Header,
    flash: F,
    unit: &SensorIdentity,
) -> Result<Option<u32>, NotStored> {
    let mut slots = Slots::open(flash)?;
    let mut buffer = [0xFF; record::MAX_LEN];
    let stored = match slots.read(&mut buffer)? {
        _ if slots.is_newer() => return Err(NotStored::Unreadable),
        [] => None,
        bytes => Some(record::decode(bytes).map_err(|_| NotStored::Unreadable)?),
    };
    // Another unit's record is no measure for this one, and is not mixed with it.
    let mut record = stored
        .filter(|stored| stored.made_for(&unit.serial).is_ok())
        .unwrap_or_else(|| CalibrationRecord::empty(unit.clone(), header.date));
    let [acc, ..] = &header.task.sensors;
    let axes = session.axes(&acc.units(Sensor::Accelerometer), record.acc.as_ref());
    let mut surer = false;
    for (sensor, of) in Sensor::ALL.into_iter().zip(&header.task.sensors) {
        if let Ok(triad) =
            session.better_at_temperatures(sensor, &of.units(sensor), record.triad(sensor), &axes)
            && triad.check(sensor).is_ok()
        {
            record.adopt(sensor, &triad, unit, header.date);
            surer = true;
        }
    }
    if !surer {
        return Ok(None);
    }
    let bytes = record::encode(&record, &mut buffer).map_err(|_| NotStored::Flash)?;
    let mut writing = slots.begin(bytes)?;
    loop {
        if let Some(number) = slots.step(&mut writing)? {
            return Ok(Some(number));
        }
    }
}

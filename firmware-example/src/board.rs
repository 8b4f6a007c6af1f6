//! What a board brings: four small traits, none of which waits.

use embedded_storage::nor_flash::NorFlash;
use imucal_core::{link::LastReset, record::RawUnit};

/// A line to the host, byte by byte.
pub trait ByteLink {
    /// The next byte that has come, if one has.
    fn receive(&mut self) -> Option<u8>;

    /// Takes a byte to send, unless there is no room now.
    fn send(&mut self, byte: u8) -> bool;
}

/// Time.
pub trait Clock {
    /// Since the start, ms; comes round after 49 days. Asked for in every turn: a counter that comes round is followed.
    fn uptime(&mut self) -> u32;
}

/// One sample of all the sensors, in the raw units of the record. `None` where there is no such sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Accelerometer, gyroscope, magnetometer: the order of [`imucal_core::record::Sensor::ALL`].
    pub raw: [Option<[f32; 3]>; 3],
    /// °C; NaN where it is not known.
    pub temperature: f32,
    /// When it was taken, µs on a clock of its own; `None`: when it comes, by the board's clock in whole ms.
    pub time: Option<u64>,
}

/// The sensors.
pub trait SampleSource {
    /// The next sample, if one has come.
    fn sample(&mut self) -> Option<Sample>;

    /// Raw units, in the order of [`Sample::raw`]: no record for another is taken. `None` where there is no such sensor,
    /// whose samples come by the link in the record's own unit.
    fn units(&self) -> [Option<RawUnit>; 3];
}

/// A board that brings samples only by its link.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoSensor;

impl SampleSource for NoSensor {
    fn sample(&mut self) -> Option<Sample> {
        None
    }

    fn units(&self) -> [Option<RawUnit>; 3] {
        [None; 3]
    }
}

/// All that the co-processor needs of its board.
#[derive(Debug)]
pub struct Board<L: ByteLink, F: NorFlash, C: Clock, S: SampleSource> {
    /// The line to the host.
    pub link: L,
    /// The region of flash for the record, all of it.
    pub flash: F,
    /// Time.
    pub clock: C,
    /// The sensors.
    pub sensors: S,
    /// Stack used at most so far, bytes, where the board looks.
    pub stack: fn() -> Option<u32>,
    /// How the run before this one ended.
    pub last_reset: LastReset,
}

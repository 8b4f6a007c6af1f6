//! The movement of a simulator's stream.

use super::stream_clock;
use crate::{
    recording::{Recording, Stream, check::integrity::Integrity},
    simulator::{Place, StreamClock, Streamed},
};

/// The clock of a stream.
///
/// # Errors
///
/// Why the stream gives no movement, for a reader.
pub fn clock(recording: &Recording, integrity: &Integrity, stream: &Stream) -> Result<StreamClock, String> {
    stream_clock::coarse(recording, integrity, stream)
}

/// The movement of a stream for the rows of a recording.
///
/// # Errors
///
/// Why there is none, for a reader.
pub fn movement(
    recording: &Recording,
    stream: &Stream,
    clock: StreamClock,
    temperature: Vec<f64>,
    place: Place,
) -> Result<Streamed, String> {
    let streamed = Streamed::new(stream, clock, &recording.time, temperature, place);
    streamed.ok_or_else(|| format!("{}: the stream has fewer than two samples", stream.name))
}

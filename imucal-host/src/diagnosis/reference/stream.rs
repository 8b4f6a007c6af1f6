//! The movement of a simulator's stream.

use super::{
    clock_steadiness::Steadiness,
    impact::{self, Impacts},
    stream_clock,
    strikes::Unmatched,
};
use crate::{
    recording::{Recording, Stream, check::integrity::Integrity},
    simulator::{Place, StreamClock, Streamed},
};

/// The movement of a stream, and what its samples do not resolve.
#[derive(Debug)]
pub struct Given {
    /// The movement.
    pub movement: Streamed,
    /// Stretches with impacts that the stream or the recording lacks.
    pub unmatched: Vec<Unmatched>,
    /// What a reader ought to know of rows near impacts; `None` without any.
    pub unresolved: Option<String>,
}

/// The clock of a stream, and how evenly it runs.
///
/// # Errors
///
/// Why the stream gives no movement, for a reader.
pub fn clock(recording: &Recording, integrity: &Integrity, stream: &Stream) -> Result<Steadiness, String> {
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
    clock: &StreamClock,
    temperature: Vec<f64>,
    place: Place,
) -> Result<Given, String> {
    let streamed = Streamed::new(stream, clock.clone(), &recording.time, temperature, place);
    let streamed =
        streamed.ok_or_else(|| format!("{}: the stream has fewer than two samples", stream.name))?;
    let Impacts { resolved, unmatched } = impact::impacts(recording, stream, clock);
    Ok(Given { movement: streamed.known_where(&resolved), unmatched, unresolved: unresolved(&resolved) })
}

/// Rows near impacts are not compared.
fn unresolved(resolved: &[bool]) -> Option<String> {
    let left_out = resolved.iter().filter(|resolved| !**resolved).count();
    (left_out > 0).then(|| {
        let share = 100.0 * left_out as f64 / resolved.len() as f64;
        let rows = if share < 0.1 { format!("{left_out} rows") } else { format!("{share:.1} % of the rows") };
        format!(
            "{rows} are left out, near impacts that the samples of the stream do not resolve: a stream at a higher rate would show \
             them"
        )
    })
}

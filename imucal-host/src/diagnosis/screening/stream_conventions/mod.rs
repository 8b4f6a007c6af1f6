//! What a simulator's stream holds instead of what it should hold: looked for before any fit.
//!
//! | file | what |
//! | --- | --- |
//! | [`held`] | values that are repeated until the next one comes |
//! | [`mod@unit`] | values in another unit |
//! | [`gravity`] | coordinate acceleration instead of specific force |
//! | [`sparse`] | samples too far apart for what lies between them |
//! | [`own_noise`] | noise and steps of the stream's own |
//! | [`clock`] | a clock that jumps or wanders |
//! | [`axes`] | axes that are turned or mirrored against the sensor's |
//!
//! A stream from which no movement follows is refused; all else is a remark that says what was found, what was expected
//! and what to do.

pub mod axes;
pub mod clock;
pub mod gravity;
pub mod held;
pub mod own_noise;
pub mod sparse;
pub mod unit;

use crate::recording::{Recording, SensorKind, Stream};

/// What was found in a stream.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StreamFaults {
    /// What a reader ought to know.
    pub remarks: Vec<String>,
    /// Noise of its own is on it, row by row.
    pub noisy: bool,
    /// Sensors that cannot be compared with the stream, by [`SensorKind::ALL`].
    pub left_out: [bool; 3],
}

/// Checks the samples of a stream for a recording.
///
/// # Errors
///
/// Why the stream gives no movement, for a reader.
pub fn check(recording: &Recording, stream: &Stream) -> Result<StreamFaults, String> {
    if let Some(wrong) = unit::wrong(recording, stream) {
        return Err(wrong);
    }
    let mut found = StreamFaults::default();
    for kind in SensorKind::ALL {
        if recording.sensor(kind).is_none() {
            continue;
        }
        if stream.values.sensor(kind).is_none() {
            found.remarks.push(format!("the {kind} is left out: the simulator gives no stream of it"));
        } else if let Some(remark) = sparse::remark(recording, stream, kind) {
            found.left_out[kind as usize] = true;
            found.remarks.push(remark);
        }
    }
    let (noise, steps) = (own_noise::noise(recording, stream), own_noise::steps(recording, stream));
    found.noisy = noise.is_some() || steps.is_some();
    found.remarks.extend(noise.into_iter().chain(steps));
    for (kind, drowned) in SensorKind::ALL.into_iter().zip(own_noise::drowned(recording, stream)) {
        if drowned && !found.left_out[kind as usize] {
            found.left_out[kind as usize] = true;
            found.remarks.push(format!(
                "the {kind} is left out: the stream's own noise or steps are larger than the noise of the recording"
            ));
        }
    }
    Ok(found)
}

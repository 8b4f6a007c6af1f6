//! The movement of a simulator's stream, and what is wrong with a stream that gives none.

use nalgebra::Vector3;

use super::{
    impact::{self, Impacts, Unmatched},
    stream_clock,
};
use crate::{
    recording::{Recording, SensorKind, Stream, check::integrity::Integrity},
    simulator::{Motion, Place, Recorded, StreamClock, Streamed, replay::reading_noise},
};

/// Noise of a stream above this share of the recorded one hides a part of the gap.
const NOISY: f64 = 0.2;
/// A stream whose specific force is smaller on average than this share of gravity holds coordinate acceleration.
const WEIGHTLESS: f64 = 0.3;

/// The movement of a stream, and what a reader ought to know of it.
#[derive(Debug)]
pub struct Given {
    /// The movement.
    pub movement: Streamed,
    /// Stretches with impacts that the stream or the recording lacks.
    pub unmatched: Vec<Unmatched>,
    /// Remarks.
    pub remarks: Vec<String>,
}

/// The clock of a stream and the stream without what cannot be used of it.
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
) -> Result<Given, String> {
    let streamed = Streamed::new(stream, clock, &recording.time, temperature, place);
    let Impacts { resolved, unmatched } = impact::impacts(recording, stream, clock);
    let movement = streamed
        .ok_or_else(|| format!("{}: the stream has fewer than two samples", stream.name))?
        .known_where(&resolved);
    if let Some(found) = weightless(&movement, recording, place.gravity) {
        return Err(format!(
            "{}: the simulated accelerometer reads {found:.2} m/s² on average where one at rest reads {:.2} m/s²: it holds \
             coordinate acceleration instead of specific force; subtract gravity before the turn into the sensor's axes, \
             f = C (a - g)",
            stream.name, place.gravity
        ));
    }
    let mut remarks = Vec::new();
    remarks.extend(noise(recording, stream));
    remarks.extend(unresolved(&resolved));
    for kind in SensorKind::ALL {
        if recording.sensor(kind).is_some() && !movement.gives(kind) {
            remarks.push(format!("the {kind} is left out: the simulator gives no stream of it"));
        }
    }
    Ok(Given { movement, unmatched, remarks })
}

/// Mean specific force of a stream that does not hold gravity, m/s².
fn weightless(movement: &Streamed, recording: &Recording, gravity: f64) -> Option<f64> {
    if !movement.gives(SensorKind::Acc) {
        return None;
    }
    let stride = recording.rows().div_ceil(2000).max(1);
    let (mut sum, mut count) = (Vector3::zeros(), 0.0);
    for row in (0..recording.rows()).step_by(stride).filter(|row| movement.known()[*row]) {
        let truth = movement.truth(recording.time[row], &|_| ());
        sum += truth.c_t_p * truth.f_t;
        count += 1.0;
    }
    let mean = sum.norm() / f64::max(count, 1.0);
    (count > 0.0 && mean < WEIGHTLESS * gravity).then_some(mean)
}

/// Noise of a sample along a smooth movement, the largest of the axes'.
fn noise_of(values: &[Vector3<f64>]) -> f64 {
    (0..3).map(|axis| reading_noise(values.iter().map(|value| value[axis]))).fold(0.0, f64::max)
}

/// Rows near impacts are not compared.
fn unresolved(resolved: &[bool]) -> Option<String> {
    let left_out = resolved.iter().filter(|resolved| !**resolved).count();
    (left_out > 0).then(|| {
        format!(
            "{:.1} % of the rows are left out, near impacts that the samples of the stream do not resolve: a stream at a higher \
             rate would show them",
            100.0 * left_out as f64 / resolved.len() as f64
        )
    })
}

/// A stream with noise of its own hides the gap.
fn noise(recording: &Recording, stream: &Stream) -> Option<String> {
    let share = |kind: &SensorKind| {
        let (real, ideal) = (recording.sensor(*kind)?, stream.values.sensor(*kind)?);
        let share = noise_of(ideal) / noise_of(&real.values).max(f64::MIN_POSITIVE);
        (share > NOISY).then(|| format!("{:.0} % of the {kind}'s", 100.0 * share))
    };
    let shares: Vec<String> = SensorKind::ALL.iter().filter_map(share).collect();
    (!shares.is_empty()).then(|| {
        format!(
            "the simulated stream has noise of its own, {}: it hides as much of the gap; give the ideal stream, before the \
             simulator's noise model",
            shares.join(", ")
        )
    })
}

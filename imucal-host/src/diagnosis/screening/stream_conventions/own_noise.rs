//! Noise and steps of a stream's own, which an ideal sensor has not: the gap below them stays hidden.

use nalgebra::Vector3;

use crate::{
    observe::quantum::quantum,
    recording::{Recording, SensorKind, Stream},
    simulator::{replay::readings_noise, streamed::own_noise},
};

/// Noise of a stream above this share of the recorded one hides a part of the gap.
const NOISY: f64 = 0.2;

/// What a reader ought to know of each.
pub fn remarks(recording: &Recording, stream: &Stream) -> Vec<String> {
    [noise(recording, stream), steps(recording, stream)].into_iter().flatten().collect()
}

fn unit(kind: SensorKind) -> &'static str {
    ["m/s²", "rad/s", "µT"][kind as usize]
}

/// Those sensors for which `found` is more than a share of the recorded noise, in words.
fn shares(
    recording: &Recording,
    stream: &Stream,
    found: &dyn Fn(&[Vector3<f64>]) -> f64,
    words: &dyn Fn(SensorKind, f64, f64) -> String,
) -> String {
    let share = |kind: SensorKind| {
        let (real, ideal) = (recording.sensor(kind)?, stream.values.sensor(kind)?);
        let size = found(ideal);
        let share = size / readings_noise(&real.values).max(f64::MIN_POSITIVE);
        (share > NOISY).then(|| words(kind, size, share))
    };
    SensorKind::ALL.into_iter().filter_map(share).collect::<Vec<_>>().join(", ")
}

fn noise(recording: &Recording, stream: &Stream) -> Option<String> {
    let words = |kind: SensorKind, size: f64, share: f64| {
        format!("{kind} {size:.2e} {} a sample, {:.0} % of the recorded", unit(kind), 100.0 * share)
    };
    let found = shares(recording, stream, &own_noise, &words);
    (!found.is_empty()).then(|| {
        format!(
            "the simulated stream has noise of its own where none was expected: {found}; it adds to the recorded noise, and \
             what is smaller than it stays hidden; give the ideal stream, before the simulator's noise model"
        )
    })
}

/// Root mean square error of values rounded to steps, of the coarsest axis.
fn rounding(values: &[Vector3<f64>]) -> f64 {
    quantum(values, &vec![true; values.len()]).max() / 12.0f64.sqrt()
}

fn steps(recording: &Recording, stream: &Stream) -> Option<String> {
    let words = |kind: SensorKind, size: f64, share: f64| {
        let step = size * 12.0f64.sqrt();
        format!("{kind} {step:.2e} {}, an error of {:.0} % of the recorded noise", unit(kind), 100.0 * share)
    };
    let found = shares(recording, stream, &rounding, &words);
    (!found.is_empty()).then(|| {
        format!(
            "the simulated stream is rounded to steps: {found}; the error depends on the movement and may be taken for an \
             effect; write the stream with more digits"
        )
    })
}

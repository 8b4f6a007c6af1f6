//! Noise and steps of a stream's own, which an ideal sensor has not: the gap below them stays hidden.

use nalgebra::Vector3;

use crate::{
    effect::si,
    observe::quantum::quantum,
    recording::{Recording, SensorKind, Simulated, Stream},
    simulator::{replay::readings_noise, streamed::own_noise},
};

/// Noise of a stream above this share of the recorded one hides a part of the gap.
const NOISY: f64 = 0.2;

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

/// Sensors whose stream has so much noise or such coarse steps that nothing is left to compare, by [`SensorKind::ALL`].
pub fn drowned(recording: &Recording, stream: &Stream) -> [bool; 3] {
    SensorKind::ALL.map(|kind| {
        let (Some(real), Some(ideal)) = (recording.sensor(kind), stream.values.sensor(kind)) else {
            return false;
        };
        own_noise(ideal).max(rounding(ideal)) > readings_noise(&real.values)
    })
}

/// The stream with each noisy sample replaced by the parabola through the nine about it. Between two samples noise and its
/// slope go together, which would be taken for a delay.
pub fn smoothed(recording: &Recording, stream: &Stream) -> Stream {
    let mut stream = stream.clone();
    let Simulated { acc, gyr, mag, .. } = &mut stream.values;
    for (kind, values) in SensorKind::ALL.into_iter().zip([acc, gyr, mag]) {
        let (Some(values), Some(real)) = (values, recording.sensor(kind)) else { continue };
        if own_noise(values).max(rounding(values)) > LEAST * readings_noise(&real.values) {
            *values = parabolas(values);
        }
    }
    stream
}

/// A stream with less noise than this share of the recorded one is used as it is.
const LEAST: f64 = 0.02;
/// Weights of nine samples at the middle of their parabola (Savitzky and Golay 1964), in parts of their sum.
const WEIGHTS: [f64; 9] = [-21.0, 14.0, 39.0, 54.0, 59.0, 54.0, 39.0, 14.0, -21.0];

fn parabolas(values: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let reach = WEIGHTS.len() / 2;
    let at = |k: usize| {
        let about = k.checked_sub(reach).and_then(|from| values.get(from..from + WEIGHTS.len()));
        let sum: Option<Vector3<f64>> =
            about.map(|about| about.iter().zip(WEIGHTS).map(|(v, w)| v * w).sum());
        let total: f64 = WEIGHTS.iter().sum();
        let mean = sum.map(|sum| sum / total).filter(|mean| mean.iter().all(|value| value.is_finite()));
        mean.unwrap_or(values[k])
    };
    (0..values.len()).map(at).collect()
}

/// Noise that is on a stream, for a reader.
pub fn noise(recording: &Recording, stream: &Stream) -> Option<String> {
    let words = |kind: SensorKind, size: f64, share: f64| {
        format!("{kind} {size:.2e} {} a sample, {:.0} % of the recorded", si(kind), 100.0 * share)
    };
    let found = shares(recording, stream, &own_noise, &words);
    (!found.is_empty()).then(|| {
        format!(
            "the simulated stream has noise of its own where none was expected: {found}; it adds to the recorded noise, and \
             what is smaller than it stays hidden; it is smoothed over nine samples; give the ideal stream, before the simulator's noise model"
        )
    })
}

/// Root mean square error of values rounded to steps, of the coarsest axis.
fn rounding(values: &[Vector3<f64>]) -> f64 {
    quantum(values, &vec![true; values.len()]).max() / 12.0f64.sqrt()
}

/// Steps that a stream is rounded to, for a reader.
pub fn steps(recording: &Recording, stream: &Stream) -> Option<String> {
    let words = |kind: SensorKind, size: f64, share: f64| {
        let step = size * 12.0f64.sqrt();
        format!("{kind} {step:.2e} {}, an error of {:.0} % of the recorded noise", si(kind), 100.0 * share)
    };
    let found = shares(recording, stream, &rounding, &words);
    (!found.is_empty()).then(|| {
        format!(
            "the simulated stream is rounded to steps: {found}; the error depends on the movement and may be taken for an \
             effect; write the stream with more digits"
        )
    })
}

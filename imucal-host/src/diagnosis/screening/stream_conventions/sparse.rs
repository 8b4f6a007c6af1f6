//! A stream with fewer samples than the recording: what lies between two of them is not known.
//!
//! Each sample is predicted from its neighbours by the cubic through four of them,
//!
//! ```text
//! e_k = v_k − (9 (v_{k−1} + v_{k+1}) − v_{k−3} − v_{k+3}) / 16
//! ```
//!
//! which is the error at twice the interval; at the interval itself it is a quarter of that or less where the movement is
//! smooth.

use nalgebra::Vector3;

use crate::{
    effect::si,
    recording::{Recording, SensorKind, Stream, median},
    simulator::replay::readings_noise,
};

/// A stream is sparse from so many intervals of the recording on.
const SPARSE: f64 = 1.5;
/// Error at the interval as a share of that at twice the interval.
const SHARE: f64 = 0.25;
/// A sensor is left out where the error is above so many times the noise of its samples.
const TOO_FAR: f64 = 1.0;

/// Why a sensor cannot be compared with its stream, for a reader; `None` where it can be.
pub fn remark(recording: &Recording, stream: &Stream, kind: SensorKind) -> Option<String> {
    let interval = |time: &[f64]| median(time.windows(2).map(|pair| pair[1] - pair[0]).collect());
    let (own, others) = (interval(&stream.time)?, interval(&recording.time)?);
    if own < SPARSE * others {
        return None;
    }
    let error = SHARE * between(stream.values.sensor(kind)?)?;
    let noise = readings_noise(&recording.sensor(kind)?.values);
    (error > TOO_FAR * noise).then(|| {
        let unit = si(kind);
        format!(
            "the {kind} is left out: the stream has {:.0} samples a second and the recording {:.0}, and between two of them \
             the simulated {kind} is known to {error:.2e} {unit} only, with a noise of {noise:.2e} {unit} of a recorded sample; export the stream at {:.0} Hz or more",
            own.recip(),
            others.recip(),
            others.recip()
        )
    })
}

/// Root mean square of what neighbours do not predict, of the worst axis.
fn between(values: &[Vector3<f64>]) -> Option<f64> {
    let errors: Vec<Vector3<f64>> = values
        .windows(7)
        .map(|w| w[3] - ((w[2] + w[4]) * 9.0 - w[0] - w[6]) / 16.0)
        .filter(|error| error.iter().all(|value| value.is_finite()))
        .collect();
    let square = |axis: usize| errors.iter().map(|error| error[axis].powi(2)).sum::<f64>();
    let most = (0..3).map(square).fold(0.0, f64::max);
    (!errors.is_empty()).then(|| (most / errors.len() as f64).sqrt())
}

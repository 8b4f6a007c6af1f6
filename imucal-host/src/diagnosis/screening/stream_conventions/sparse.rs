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
    recording::{Recording, SensorKind, Stream, median, order_statistics::mean_without_largest},
    simulator::replay::readings_noise,
};

/// A stream is sparse from so many intervals of the recording on.
const SPARSE: f64 = 1.5;
/// Error at the interval as a share of that at twice the interval.
const SHARE: f64 = 0.25;
/// The largest one in so many errors is one of impacts.
const IMPACTS: usize = 5;
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

/// Root mean square of what neighbours do not predict, of the worst axis, without the largest fifth: rows near impacts are
/// left out anyhow ([`crate::diagnosis::reference::impact`]).
fn between(values: &[Vector3<f64>]) -> Option<f64> {
    let errors: Vec<Vector3<f64>> = values
        .windows(7)
        .map(|w| w[3] - ((w[2] + w[4]) * 9.0 - w[0] - w[6]) / 16.0)
        .filter(|error| error.iter().all(|value| value.is_finite()))
        .collect();
    let square =
        |axis: usize| mean_without_largest(errors.iter().map(|error| error[axis].powi(2)).collect(), IMPACTS);
    let most = (0..3).map(square).fold(0.0, f64::max);
    (!errors.is_empty()).then(|| most.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sway of 0.5 Hz, of so many samples a second, with a pulse of one sample in every so many.
    fn sway(rate: f64, pulses: Option<usize>) -> Vec<Vector3<f64>> {
        let value = |k: usize| {
            let pulse = pulses.filter(|every| k.is_multiple_of(*every)).map_or(0.0, |_| 8.0);
            Vector3::repeat((std::f64::consts::PI * k as f64 / rate).sin() + pulse)
        };
        (0..4000).map(value).collect()
    }

    #[test]
    fn impacts_say_nothing_of_how_far_a_stream_is_known_between_its_samples() {
        let [dense, slow] = [100.0, 3.0].map(|rate| between(&sway(rate, None)).unwrap());
        assert!(dense < 1e-5 && slow > 1e-2, "{dense} {slow}");
        let struck = between(&sway(100.0, Some(50))).unwrap();
        assert!(struck < 10.0 * dense, "{struck} {dense}");
    }
}

//! Noise of a recording that is still: overlapping Allan deviations, and the coefficients that they show.
//!
//! | goes in | comes out |
//! | --- | --- |
//! | samples of any number, as they arrive | of each axis N, B, K, Q and the correlation time, each with its 95 % interval or the reason why there is none |
//!
//! ```text
//! samples ─► clock ─► cascade ─► variances ─┬─► fit, by the covariance of the variances ─► coefficients
//!              gaps     stillness             └─► correlation: a Gauss–Markov bias
//! ```
//!
//! Sources: W. J. Riley, Handbook of Frequency Stability Analysis, NIST SP 1065 (2008); C. A. Greenhall & W. J. Riley (PTTI
//! 2003); IEEE Std 952, annex C. `imucal-host/docs/noise.md` shows what a command prints.

use std::{ops::ControlFlow, path::Path};

pub mod cascade;
pub mod clock;
pub mod coefficients;
pub mod correlation;
pub mod covariance;
pub mod drawn;
pub mod fit;
pub mod process;
pub mod remark;
pub mod rounding;
pub mod sensor;
pub mod stillness;
mod upper_bound;

use self::{
    remark::Remark,
    sensor::{Refusal, SensorNoise, SensorStream},
};
use crate::{
    file::Limits,
    recording::{Manifest, Mapping, ReadError, Recording, SensorKind, Source, Unit, Warning},
};

/// A sensor with its noise, or why there is none.
pub type Judged = (SensorKind, Result<SensorNoise, Refusal>);

/// The noise of a recording's sensors.
#[derive(Debug)]
pub struct Noise {
    /// File name of the recording.
    pub recording: String,
    /// Its manifest.
    pub manifest: Manifest,
    /// From the first row to the last, s.
    pub duration: f64,
    /// Each sensor that is there, with its noise or why there is none.
    pub sensors: Vec<Judged>,
    /// What is odd about the samples.
    pub remarks: Vec<Remark>,
    /// What the reader noticed.
    pub warnings: Vec<Warning>,
}

impl Noise {
    /// Everything that is odd, in words: what the reader noticed, and what the samples showed.
    #[must_use]
    pub fn messages(&self) -> Vec<String> {
        let remarks = self.remarks.iter().map(ToString::to_string);
        self.warnings.iter().map(ToString::to_string).chain(remarks).collect()
    }
}

/// Reads a recording of any length, and estimates the noise of its sensors.
///
/// # Errors
///
/// Those of [`Recording::read`].
pub fn noise(path: &Path, mapping: &Mapping, limits: &Limits) -> Result<Noise, ReadError> {
    let mut streams: Vec<SensorStream> = SensorKind::ALL.into_iter().map(SensorStream::new).collect();
    let mut span: Option<(f64, f64)> = None;
    let mut described = None;
    let source = Source { path, mapping, manifest: None, limits };
    let warnings = Recording::read_parts(source, &mut |part| {
        if described.is_none() {
            let there = SensorKind::ALL.map(|kind| part.sensor(kind).is_some());
            described = Some((part.name.clone(), part.manifest.clone(), there));
        }
        let last = part.time.last().copied().unwrap_or_default();
        span = Some((span.map_or(part.time.first().copied().unwrap_or_default(), |(first, _)| first), last));
        for (kind, stream) in SensorKind::ALL.into_iter().zip(&mut streams) {
            let Some(triple) = part.sensor(kind) else { continue };
            if triple.unit == Unit::Arbitrary {
                stream.of_arbitrary_unit();
            }
            for (time, sample) in part.time.iter().zip(&triple.values) {
                // A row in which the sensor was not read is none of its samples.
                if sample.iter().all(|value| value.is_finite()) {
                    stream.push(*time, sample);
                }
            }
        }
        ControlFlow::Continue(())
    })?;
    let (recording, manifest, there) = described.unwrap_or_default();
    streams.iter_mut().for_each(SensorStream::end);
    let (sensors, remarks) = judged(&streams, there);
    let duration = span.map_or(0.0, |(first, last)| last - first);
    Ok(Noise { recording, manifest, duration, sensors, remarks, warnings })
}

/// What each sensor has. Where an inertial sensor moved, the unit did, and with it all of them.
fn judged(streams: &[SensorStream], there: [bool; 3]) -> (Vec<Judged>, Vec<Remark>) {
    let inertial = [SensorKind::Acc, SensorKind::Gyr];
    let spoilt = |kind: SensorKind| streams[kind as usize].moved().is_some_and(|moved| moved.spoils);
    let by = inertial.into_iter().find(|kind| there[*kind as usize] && spoilt(*kind));
    let (mut sensors, mut remarks) = (Vec::new(), Vec::new());
    for kind in SensorKind::ALL.into_iter().filter(|kind| there[*kind as usize]) {
        let found = match (streams[kind as usize].noise(), by) {
            (Ok(_), Some(by)) => Err(Refusal::MovedWith { by }),
            (Ok((noise, odd)), None) => {
                remarks.extend(odd);
                Ok(noise)
            }
            (Err(refusal), _) => Err(refusal),
        };
        sensors.push((kind, found));
    }
    (sensors, remarks)
}

//! The noise of a unit as it is kept: JSON, `imucal-noise/1`.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::{
    allan::{
        Noise,
        coefficients::{Axis, Coefficient, Deviation},
        sensor::{Refusal, SensorNoise},
    },
    file::{Limits, ReadFault, limits::Size},
    recording::{SensorKind, Unit},
};

/// What the key `format` says.
pub const FORMAT: &str = "imucal-noise/1";

/// The noise of a recording's sensors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseFile {
    /// [`FORMAT`].
    pub format: String,
    /// File name of the recording.
    pub recording: String,
    /// Make and model of the unit, empty where unknown.
    pub name: String,
    /// Serial number of the unit, empty where unknown.
    pub serial: String,
    /// From the first row to the last, s.
    pub duration: f64,
    /// Accelerometer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acc: Option<NoiseOfSensor>,
    /// Gyroscope.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gyr: Option<NoiseOfSensor>,
    /// Magnetometer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mag: Option<NoiseOfSensor>,
    /// Every warning that is printed.
    pub warnings: Vec<String>,
}

/// The noise of one sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseOfSensor {
    /// `estimated` or `refused`.
    pub status: String,
    /// Name of the refusal.
    pub reason: Option<String>,
    /// Its figures.
    pub detail: Option<String>,
    /// Unit of values.
    pub unit: String,
    /// Samples.
    pub samples: u64,
    /// Samples a second, Hz.
    pub rate: Option<f64>,
    /// x, y and z; an axis whose samples are all one value is null.
    pub axes: Vec<Option<NoiseOfAxis>>,
}

/// The noise of one axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseOfAxis {
    /// Mean, unit.
    pub mean: f64,
    /// N, unit/√Hz.
    pub white: Figure,
    /// B, unit.
    pub bias_instability: Figure,
    /// K, unit·√Hz.
    pub random_walk: Figure,
    /// Q, unit·s.
    pub quantisation: Figure,
    /// T of a Gauss–Markov bias, s.
    pub correlation_time: Figure,
    /// σ of a Gauss–Markov bias, unit.
    pub bias_std: Figure,
    /// The least Allan deviation, unit.
    pub least_deviation: f64,
    /// Its averaging time, s.
    pub least_at: f64,
    /// How well the kinds of noise explain the variances.
    pub fit: FitOfAxis,
    /// Overlapping Allan deviations, the shortest averages first.
    pub allan: Vec<Point>,
}

/// A coefficient, or why there is none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Its value; null where the recording does not determine it.
    pub value: Option<f64>,
    /// Ends of its 95 % interval.
    pub interval: Option<[f64; 2]>,
    /// Equivalent degrees of freedom; null for an interval that is not one of χ².
    pub edf: Option<f64>,
    /// Its unit.
    pub unit: String,
    /// Why there is no value.
    pub reason: Option<String>,
    /// What it is at most, with a probability of 97.5 %, where there is no value.
    pub at_most: Option<f64>,
}

/// How well the kinds of noise explain an axis' variances.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FitOfAxis {
    /// χ².
    pub chi_square: Option<f64>,
    /// Its degrees of freedom.
    pub freedom: usize,
    /// Probability of as much by chance.
    pub p_value: f64,
    /// Averaging time from which on they were fitted, s.
    pub from: Option<f64>,
    /// Factor by which standard errors were raised, ≥ 1.
    pub std_inflation: f64,
}

/// An overlapping Allan deviation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Averaging time, s.
    pub time: f64,
    /// Samples of an average.
    pub samples: u64,
    /// Terms of the sum.
    pub terms: u64,
    /// σ, unit.
    pub deviation: f64,
    /// Ends of its 95 % interval, unit.
    pub interval: [f64; 2],
    /// Equivalent degrees of freedom.
    pub edf: f64,
}

/// Why a file of noise could not be read.
#[derive(Debug, thiserror::Error)]
pub enum NoiseFileError {
    /// The file cannot be read.
    #[error("{path}: cannot be read: {cause}; check the path")]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// The file is longer than any.
    #[error("{path}: found more than {limit}, expected what `imucal noise --json` writes; give that file")]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// What it may come to.
        limit: Size,
    },
    /// The file is of another format.
    #[error("{path}: found {found}, expected `{FORMAT}`; give the file that `imucal noise --json` wrote")]
    Format {
        /// The file.
        path: PathBuf,
        /// What was found.
        found: String,
    },
}

/// The key that says what a file is.
#[derive(Deserialize)]
struct Head {
    format: String,
}

impl NoiseFile {
    /// Of what was estimated; `warnings` are those that are printed.
    pub fn new(noise: &Noise, warnings: Vec<String>) -> Self {
        let of = |kind: SensorKind| {
            let (_, found) = noise.sensors.iter().find(|(known, _)| *known == kind)?;
            // Of arbitrary units no µT are known.
            let arbitrary = noise.manifest.units.of(kind) == Unit::Arbitrary;
            let unit = if arbitrary { Unit::Arbitrary } else { Unit::si(kind) };
            Some(NoiseOfSensor::new(found, &unit.to_string()))
        };
        let sensor = &noise.manifest.sensor;
        Self {
            format: FORMAT.into(),
            recording: noise.recording.clone(),
            name: sensor.name.clone().unwrap_or_default(),
            serial: sensor.serial.clone().unwrap_or_default(),
            duration: noise.duration,
            acc: of(SensorKind::Acc),
            gyr: of(SensorKind::Gyr),
            mag: of(SensorKind::Mag),
            warnings,
        }
    }

    /// Reads a file.
    ///
    /// # Errors
    /// [`NoiseFileError`] names the file and what is wrong with it.
    pub fn read(path: &Path, limits: &Limits) -> Result<Self, NoiseFileError> {
        let bytes = limits.read_small(path).map_err(|fault| match fault {
            ReadFault::System(cause) => NoiseFileError::Io { path: path.into(), cause },
            ReadFault::TooLarge { limit } => {
                NoiseFileError::TooLarge { path: path.into(), limit: Size(limit) }
            }
        })?;
        let foreign = |found: String| NoiseFileError::Format { path: path.into(), found };
        let head: Head = serde_json::from_slice(&bytes).map_err(|cause| foreign(cause.to_string()))?;
        if head.format != FORMAT {
            return Err(foreign(format!("`{}`", head.format)));
        }
        serde_json::from_slice(&bytes).map_err(|cause| foreign(cause.to_string()))
    }

    /// The text of the file.
    pub fn text(&self) -> String {
        // Plain numbers and text: nothing that cannot be written.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// One sensor's noise.
    pub fn sensor(&self, kind: SensorKind) -> Option<&NoiseOfSensor> {
        match kind {
            SensorKind::Acc => self.acc.as_ref(),
            SensorKind::Gyr => self.gyr.as_ref(),
            SensorKind::Mag => self.mag.as_ref(),
        }
    }
}

impl NoiseOfSensor {
    fn new(found: &Result<SensorNoise, Refusal>, unit: &str) -> Self {
        match found {
            Ok(noise) => Self {
                status: "estimated".into(),
                reason: None,
                detail: None,
                unit: unit.into(),
                samples: noise.samples,
                rate: Some(1.0 / noise.interval),
                axes: noise
                    .axes
                    .iter()
                    .map(|axis| axis.as_ref().map(|axis| NoiseOfAxis::new(axis, unit)))
                    .collect(),
            },
            Err(refusal) => Self {
                status: "refused".into(),
                reason: Some(refusal.name().into()),
                detail: Some(refusal.to_string()),
                unit: unit.into(),
                samples: 0,
                rate: None,
                axes: Vec::new(),
            },
        }
    }

    /// The axes that have coefficients.
    pub fn known_axes(&self) -> impl Iterator<Item = &NoiseOfAxis> {
        self.axes.iter().flatten()
    }
}

impl NoiseOfAxis {
    fn new(axis: &Axis, unit: &str) -> Self {
        let (least_deviation, least_at) = axis.least;
        Self {
            mean: axis.mean,
            white: Figure::new(&axis.white, format!("{unit}/sqrt(Hz)")),
            bias_instability: Figure::new(&axis.bias_instability, unit.into()),
            random_walk: Figure::new(&axis.random_walk, format!("{unit}*sqrt(Hz)")),
            quantisation: Figure::new(&axis.quantisation, format!("{unit}*s")),
            correlation_time: Figure::new(&axis.correlation_time, "s".into()),
            bias_std: Figure::new(&axis.bias_std, unit.into()),
            least_deviation,
            least_at,
            fit: FitOfAxis {
                chi_square: Some(axis.misfit.chi_square).filter(|value| value.is_finite()),
                freedom: axis.misfit.freedom,
                p_value: axis.misfit.chance,
                from: Some(axis.misfit.from).filter(|value| value.is_finite()),
                std_inflation: axis.misfit.inflation,
            },
            allan: axis.deviations.iter().map(Point::from).collect(),
        }
    }
}

impl Figure {
    fn new(coefficient: &Coefficient, unit: String) -> Self {
        match coefficient {
            Coefficient::Known(known) => Self {
                value: Some(known.value),
                interval: Some([known.interval.0, known.interval.1]),
                edf: Some(known.freedom).filter(|freedom| freedom.is_finite()),
                unit,
                reason: None,
                at_most: None,
            },
            Coefficient::NotSeen { why, most } => Self {
                value: None,
                interval: None,
                edf: None,
                unit,
                reason: Some(why.to_string()),
                at_most: *most,
            },
        }
    }
}

impl From<&Deviation> for Point {
    fn from(deviation: &Deviation) -> Self {
        Self {
            time: deviation.time,
            samples: deviation.samples,
            terms: deviation.terms,
            deviation: deviation.value,
            interval: [deviation.interval.0, deviation.interval.1],
            edf: deviation.freedom,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_another_format_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("noise.json");
        let message = |text: &str| {
            std::fs::write(&path, text).unwrap();
            NoiseFile::read(&path, &Limits::default()).unwrap_err().to_string()
        };
        assert!(message("{\"format\": \"imucal-calibration/1\"}").contains("found `imucal-calibration/1`"));
        assert!(message("t,acc_x\n").contains("expected `imucal-noise/1`"));
        assert!(message("{\"format\": \"imucal-noise/1\"}").contains("missing field"));
    }
}

//! The calibration as it is kept: TOML for people, the record for the device. One content, two forms.

use std::{
    path::{Path, PathBuf},
    time::SystemTime,
};

use imucal_core::record::{self, DecodeError, Defect, EncodeError, HigherOrder, Order};
use serde::{Deserialize, Serialize};

pub mod covariance_file;
pub mod form;
pub mod higher_order;
mod models;
pub mod noise_file;
pub mod record_form;
mod triad;
pub mod watch_file;

pub use higher_order::{StoredCurvature, StoredNonlinearity, StoredTemperatureQuality};
pub use triad::{StoredProvenance, StoredTemperature, StoredTriad};

use crate::{
    calibrate::{Calibration, FitSummary, SensorOutcome},
    file::{Limits, OutputError, OutputSet, ReadFault, limits::Size},
    recording::SensorKind,
};

/// What the first line of the TOML says.
pub const FORMAT: &str = "imucal-calibration/1";

/// A stored calibration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoredCalibration {
    /// [`FORMAT`].
    pub format: String,
    /// File name of the recording it was made from.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub recording: String,
    /// Day it was made, days since 1970-01-01 UTC; in TOML as YYYY-MM-DD.
    #[serde(with = "record_form::date_text")]
    pub date: record::Date,
    /// The sensor it was made for.
    #[serde(default)]
    pub sensor: StoredSensor,
    /// Accelerometer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acc: Option<StoredTriad>,
    /// Gyroscope.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gyr: Option<StoredTriad>,
    /// Magnetometer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mag: Option<StoredTriad>,
}

/// Whose calibration it is.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoredSensor {
    /// Make and model, empty where unknown.
    #[serde(default)]
    pub name: String,
    /// Serial number, empty where unknown.
    #[serde(default)]
    pub serial: String,
}

/// Why a calibration could not be read.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file cannot be read.
    #[error("{path}: cannot be read: {cause}; check the path")]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// The file is longer than any calibration.
    #[error(
        "{path}: found more than {limit}, expected a calibration; give the file that `imucal calibrate` wrote with \
         --out or --record"
    )]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// What a calibration may come to.
        limit: Size,
    },
    /// The TOML is not a calibration.
    #[error(
        "{path}: found a calibration that cannot be understood ({reason}), expected what `imucal calibrate --out` \
         writes; correct it, or calibrate again"
    )]
    Toml {
        /// The file.
        path: PathBuf,
        /// Line and reason.
        reason: String,
    },
    /// The TOML is of another format.
    #[error(
        "{path}: found the format `{found}`, expected `{FORMAT}`; give the file that `imucal calibrate` wrote with \
         --out or --record"
    )]
    Format {
        /// The file.
        path: PathBuf,
        /// Format found.
        found: String,
    },
    /// A stored figure cannot be used.
    #[error("{path}: {defect}; correct the units of the recording, and calibrate again")]
    Unusable {
        /// The file.
        path: PathBuf,
        /// Which figure of which sensor, and its limits.
        defect: Defect,
    },
    /// The file is neither of the two forms.
    #[error(
        "{path}: found neither a TOML nor a record, expected a calibration; give the file that `imucal calibrate` \
         wrote with --out or --record"
    )]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// The record is damaged or newer.
    #[error("{path}: {cause}; copy it again from its source, or calibrate again")]
    Record {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: DecodeError,
    },
    /// The file holds more than one record, as a copy of a device's flash does.
    #[error(
        "{path}: found the records of two calibrations, made on {first} and, from byte {at} on, on {date}, expected one; \
         write the one that is meant to a file of its own"
    )]
    Several {
        /// The file.
        path: PathBuf,
        /// When the first calibration was made.
        first: record::Date,
        /// Where the next record begins, bytes.
        at: usize,
        /// When its calibration was made.
        date: record::Date,
    },
}

/// Why a calibration could not be written.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// The file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A field does not fit the record.
    #[error(
        "{path}: {field} `{text}` is longer than the record's {limit} bytes; shorten it in the recording's TOML"
    )]
    TooLong {
        /// The file.
        path: PathBuf,
        /// Which field.
        field: &'static str,
        /// Its text.
        text: String,
        /// Bytes allowed.
        limit: usize,
    },
    /// The record refuses a figure.
    #[error("{path}: {cause}")]
    Encode {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: EncodeError,
    },
}

impl StoredCalibration {
    /// The accepted sensors of a calibration.
    pub fn of(calibration: &Calibration, date: record::Date) -> Self {
        Self::of_those(calibration, date, SensorOutcome::accepted)
    }

    /// The accepted and the suspect sensors of a calibration.
    pub fn with_suspects(calibration: &Calibration, date: record::Date) -> Self {
        Self::of_those(calibration, date, SensorOutcome::passed)
    }

    fn of_those(
        calibration: &Calibration,
        date: record::Date,
        fit: impl Fn(&SensorOutcome) -> Option<&FitSummary>,
    ) -> Self {
        let triad = |kind| {
            let outcome = calibration.sensor(kind)?;
            Some(StoredTriad::of(outcome.model, fit(outcome)?))
        };
        Self {
            format: FORMAT.into(),
            recording: calibration.recording.clone(),
            date,
            sensor: StoredSensor {
                name: calibration.sensor_name.clone(),
                serial: calibration.serial.clone(),
            },
            acc: triad(SensorKind::Acc),
            gyr: triad(SensorKind::Gyr),
            mag: triad(SensorKind::Mag),
        }
    }

    /// One sensor's calibration.
    pub fn triad(&self, kind: SensorKind) -> Option<&StoredTriad> {
        match kind {
            SensorKind::Acc => self.acc.as_ref(),
            SensorKind::Gyr => self.gyr.as_ref(),
            SensorKind::Mag => self.mag.as_ref(),
        }
    }

    /// Reads TOML or a record, whichever the file holds.
    ///
    /// # Errors
    /// [`LoadError`] names the file and what is wrong with it.
    pub fn load(path: &Path) -> Result<Self, LoadError> {
        Self::load_within(path, &Limits::default())
    }

    /// As [`StoredCalibration::load`], with limits other than the default.
    ///
    /// # Errors
    /// As [`StoredCalibration::load`].
    pub fn load_within(path: &Path, limits: &Limits) -> Result<Self, LoadError> {
        let bytes = limits.read_small(path).map_err(|fault| match fault {
            ReadFault::System(cause) => LoadError::Io { path: path.into(), cause },
            ReadFault::TooLarge { limit } => LoadError::TooLarge { path: path.into(), limit: Size(limit) },
        })?;
        if is_toml(path, &bytes) {
            Self::from_toml(path, &bytes)
        } else {
            let record = record::decode_as::<HigherOrder>(&bytes).map_err(|cause| match cause {
                DecodeError::BadMagic => LoadError::Foreign { path: path.into() },
                DecodeError::Unusable(defect) => LoadError::Unusable { path: path.into(), defect },
                cause => LoadError::Record { path: path.into(), cause },
            })?;
            match record_form::another(&bytes) {
                Some((at, date)) => {
                    Err(LoadError::Several { path: path.into(), first: record.date, at, date })
                }
                None => Ok(Self::from_record(&record)),
            }
        }
    }

    fn from_toml(path: &Path, bytes: &[u8]) -> Result<Self, LoadError> {
        let wrong = |reason: String| LoadError::Toml { path: path.into(), reason };
        let text = std::str::from_utf8(bytes).map_err(|e| wrong(e.to_string()))?;
        let explain = |e: toml::de::Error| wrong(explained(text, &e));
        // The format first: what another one lacks does not matter.
        let form::Head { format } = toml::from_str(text).map_err(explain)?;
        if format != FORMAT {
            return Err(LoadError::Format { path: path.into(), found: format });
        }
        let stored: Self = toml::from_str(text).map_err(explain)?;
        // Judged as the device judges it.
        let record = stored.to_record(path).map_err(|refused| match refused {
            SaveError::TooLong { field, text, limit, .. } => {
                wrong(format!("{field} `{text}` is longer than {limit} bytes"))
            }
            other => wrong(other.to_string()),
        })?;
        record.check().map_err(|defect| LoadError::Unusable { path: path.into(), defect })?;
        Ok(stored)
    }

    /// Adds the TOML to a set of files.
    ///
    /// # Errors
    /// [`SaveError`] names the file and why it cannot be written.
    pub fn write_toml(&self, path: &Path, files: &mut OutputSet) -> Result<(), SaveError> {
        Ok(files.add(path, self.toml(path)?.as_bytes())?)
    }

    /// Adds the record to a set of files.
    ///
    /// # Errors
    /// [`SaveError`] names the file and why it cannot be written.
    pub fn write_record(&self, path: &Path, files: &mut OutputSet) -> Result<(), SaveError> {
        Ok(files.add(path, &self.record(path)?)?)
    }

    /// The TOML that is to be the file `path`.
    ///
    /// # Errors
    /// [`SaveError`], where a figure cannot be used.
    pub fn toml(&self, path: &Path) -> Result<String, SaveError> {
        // The TOML keeps a serial that is too long for a record; what is judged are the figures.
        if let Ok(record) = self.to_record(path) {
            let refused =
                |defect| SaveError::Encode { path: path.into(), cause: EncodeError::Unusable(defect) };
            record.check().map_err(refused)?;
        }
        // Serialising plain numbers and text into a string cannot fail.
        Ok(toml::to_string(self).unwrap_or_default())
    }

    /// The record's bytes that are to be the file `path`.
    ///
    /// # Errors
    /// [`SaveError`], where a figure cannot be used or a text is too long.
    pub fn record(&self, path: &Path) -> Result<Vec<u8>, SaveError> {
        let record = self.to_record(path)?;
        let mut buffer = [0; HigherOrder::MAX_LEN];
        let bytes = record::encode(&record, &mut buffer)
            .map_err(|cause| SaveError::Encode { path: path.into(), cause })?;
        Ok(bytes.to_vec())
    }
}

/// Today, UTC; `SOURCE_DATE_EPOCH` overrides it, for outputs that must not depend on the day.
pub fn today() -> record::Date {
    let seconds =
        std::env::var("SOURCE_DATE_EPOCH").ok().and_then(|text| text.parse().ok()).unwrap_or_else(|| {
            SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs())
        });
    record::Date::from_unix(seconds)
}

/// Line and reason, without a drawing of the line.
fn explained(text: &str, error: &toml::de::Error) -> String {
    let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
    format!("line {}: {}", before.matches('\n').count() + 1, error.message().trim().replace('\n', ", "))
}

/// A file is TOML by its name, or because it is text.
fn is_toml(path: &Path, bytes: &[u8]) -> bool {
    path.extension().is_some_and(|ext| ext.eq_ignore_ascii_case("toml")) || bytes.starts_with(b"format")
}

impl StoredTriad {
    fn of(model: &str, fit: &FitSummary) -> Self {
        let triad = fit.raw_triad();
        let (gain_std, bias_std) = fit.raw_std();
        let rows = |m: &nalgebra::Matrix3<f64>| std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]));
        Self {
            model: model.into(),
            unit_in: fit.unit_in,
            unit_out: fit.unit_out,
            gain: rows(&triad.gain),
            bias: triad.bias.into(),
            gain_std: rows(&gain_std),
            bias_std: bias_std.into(),
            rms: fit.rms,
            held_out_rms: fit.held_out_rms,
            observations: u32::try_from(fit.observations).unwrap_or(u32::MAX),
            parameters: u8::try_from(fit.parameters).unwrap_or(u8::MAX),
            condition: fit.condition,
            coverage: fit.coverage,
            field_norm: fit.field_norm,
            provenance: None,
            temperature: StoredTemperature::of(fit),
            nonlinearity: fit.raw_nonlinear().as_ref().map(StoredNonlinearity::from),
        }
    }
}

impl StoredTemperature {
    /// What a fit found of raw values' dependence on temperature; `None` where nothing is kept.
    pub(crate) fn of(fit: &FitSummary) -> Option<Self> {
        let (terms, std) = fit.raw_terms()?;
        let (low, high) = fit.temperature.as_ref()?.span;
        let bent = std.bias_quadratic.iter().chain(&std.scale_quadratic).any(|error| *error > 0.0);
        Some(Self {
            reference: terms.linear.reference,
            bias_slope: terms.linear.bias_slope,
            scale_slope: terms.linear.scale_slope,
            quality: Some(StoredTemperatureQuality {
                span: [low, high],
                bias_slope_std: std.linear.bias_slope,
                scale_slope_std: std.linear.scale_slope,
            }),
            curvature: bent.then(|| StoredCurvature {
                bias: terms.bias_quadratic.into(),
                scale: terms.scale_quadratic.into(),
                bias_std: std.bias_quadratic.into(),
                scale_std: std.scale_quadratic.into(),
            }),
        })
    }
}

//! How the errors of a calibration's entries vary together: a part of what `imucal calibrate --json` writes, read back.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use nalgebra::{DMatrix, DVector};
use serde::Deserialize;

use super::{FORMAT, StoredCalibration};
use crate::{
    calibrate::outcome::entry_name,
    file::{Limits, ReadFault, limits::Size},
    recording::SensorKind,
};

/// Entries of a gain, by rows, and of a bias.
const ENTRIES: u8 = 12;
/// A record's `f32` hold a calibration to this share of its largest entry.
const SAME: f64 = 1e-6;

/// The covariances of the sensors that were fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct CovarianceFile {
    sensors: Vec<(SensorKind, EntryCovariance)>,
}

/// One sensor's.
#[derive(Clone, Debug, PartialEq)]
pub struct EntryCovariance {
    /// Estimated entries: gain by rows 0 to 8, bias 9 to 11.
    pub entries: Vec<u8>,
    /// Covariance of their errors, in the units of the calibration.
    pub covariance: DMatrix<f64>,
    gain: [[f64; 3]; 3],
    bias: [f64; 3],
}

/// Why a file of covariances cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CovarianceFileError {
    /// The file cannot be read.
    #[error("{path}: cannot be read: {cause}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// The file is longer than any.
    #[error(
        "{path}: found more than {limit}, expected what `imucal calibrate --json` writes; give that file"
    )]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// What it may come to.
        limit: Size,
    },
    /// The file is of another format.
    #[error("{path}: found {found}, expected `{FORMAT}`; give the file that `imucal calibrate --json` wrote")]
    Format {
        /// The file.
        path: PathBuf,
        /// What was found.
        found: String,
    },
    /// A sensor's covariance is not one.
    #[error(
        "{path}: found {found} in the covariance of {sensor}, expected a square matrix of numbers, with a row for each entry that \
         covariance_of names; give the file as `imucal calibrate --json` wrote it"
    )]
    Unusable {
        /// The file.
        path: PathBuf,
        /// Which sensor.
        sensor: SensorKind,
        /// What was found.
        found: String,
    },
    /// The file is of another calibration.
    #[error(
        "{path}: found another {what} of {sensor} than the calibration's, expected the same; give the file that the same \
         `imucal calibrate` wrote by --json"
    )]
    Other {
        /// The file.
        path: PathBuf,
        /// Which sensor.
        sensor: SensorKind,
        /// What differs.
        what: &'static str,
    },
}

#[derive(Deserialize)]
struct Document {
    format: String,
    sensors: BTreeMap<String, Sensor>,
}

/// A sensor that was refused has nothing of it.
#[derive(Deserialize)]
struct Sensor {
    gain: Option<[[f64; 3]; 3]>,
    bias: Option<[f64; 3]>,
    /// What is not finite is null.
    covariance: Option<Vec<Vec<Option<f64>>>>,
    covariance_of: Option<Vec<String>>,
}

impl Sensor {
    /// `None` where the sensor was not fitted. The error says what is found in place of a covariance.
    fn read(self) -> Result<Option<EntryCovariance>, String> {
        if self.covariance.is_none() && self.covariance_of.is_none() {
            return Ok(None);
        }
        let rows = self.covariance.ok_or("no numbers")?;
        let names = self.covariance_of.ok_or("no covariance_of")?;
        let gain = self.gain.ok_or("no gain")?;
        let bias = self.bias.ok_or("no bias")?;
        let mut entries: Vec<u8> = Vec::with_capacity(names.len());
        for name in names {
            let place = (0..ENTRIES).find(|entry| entry_name(*entry) == name);
            let entry = place.ok_or_else(|| format!("an unknown entry `{name}`"))?;
            if entries.contains(&entry) {
                return Err(format!("the entry `{name}` twice"));
            }
            entries.push(entry);
        }
        let count = entries.len();
        if let Some(row) = rows.iter().find(|row| row.len() != count) {
            return Err(format!("a row of {} numbers for {count} entries", row.len()));
        }
        if rows.len() != count {
            return Err(format!("{} rows for {count} entries", rows.len()));
        }
        let numbers: Option<Vec<f64>> = rows.into_iter().flatten().collect();
        let numbers = numbers.ok_or("null in place of a number")?;
        let covariance = DMatrix::from_row_slice(count, count, &numbers);
        Ok(Some(EntryCovariance { entries, covariance, gain, bias }))
    }
}

impl CovarianceFile {
    /// Reads a file, which must be of this calibration.
    ///
    /// # Errors
    /// [`CovarianceFileError`] names the file and what is wrong with it.
    pub fn read(
        path: &Path,
        limits: &Limits,
        calibration: &StoredCalibration,
    ) -> Result<Self, CovarianceFileError> {
        let bytes = limits.read_small(path).map_err(|fault| match fault {
            ReadFault::System(cause) => CovarianceFileError::Io { path: path.into(), cause },
            ReadFault::TooLarge { limit } => {
                CovarianceFileError::TooLarge { path: path.into(), limit: Size(limit) }
            }
        })?;
        let foreign = |found: String| CovarianceFileError::Format { path: path.into(), found };
        let document: Document =
            serde_json::from_slice(&bytes).map_err(|cause| foreign(cause.to_string()))?;
        if document.format != FORMAT {
            return Err(foreign(format!("`{}`", document.format)));
        }
        let mut found = document.sensors;
        let mut sensors = Vec::new();
        for kind in SensorKind::ALL {
            // A sensor that the calibration lacks was refused, and nothing uses its covariance.
            let wanted = calibration.triad(kind).and_then(|_| found.remove(kind.prefix()));
            let unusable = |found| CovarianceFileError::Unusable { path: path.into(), sensor: kind, found };
            let covariance = wanted.map(Sensor::read).transpose().map_err(unusable)?.flatten();
            sensors.extend(covariance.map(|covariance| (kind, covariance)));
        }
        let file = Self { sensors };
        for (sensor, own) in &file.sensors {
            if let Some(what) = own.differs(calibration, *sensor) {
                return Err(CovarianceFileError::Other { path: path.into(), sensor: *sensor, what });
            }
        }
        Ok(file)
    }

    /// One sensor's; `None` where it was not fitted.
    pub fn sensor(&self, kind: SensorKind) -> Option<&EntryCovariance> {
        self.sensors.iter().find(|(known, _)| *known == kind).map(|(_, found)| found)
    }
}

impl EntryCovariance {
    /// What a calibration has otherwise, if it has the sensor.
    fn differs(&self, calibration: &StoredCalibration, kind: SensorKind) -> Option<&'static str> {
        let triad = calibration.triad(kind)?;
        let near = |own: &[f64], other: &[f64]| {
            let largest = other.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            own.iter().zip(other).all(|(a, b)| (a - b).abs() <= SAME * largest)
        };
        if !near(self.gain.as_flattened(), triad.gain.as_flattened()) {
            return Some("gain");
        }
        (!near(&self.bias, &triad.bias)).then_some("bias")
    }

    /// A matrix that makes errors of this covariance of independent standard normal numbers, by
    /// eigenvectors of the correlations; it also exists where the covariance is singular.
    pub fn root(&self) -> DMatrix<f64> {
        let std: DVector<f64> = self.covariance.diagonal().map(|variance| variance.max(0.0).sqrt());
        let scale = |i: usize| if std[i] > 0.0 { std[i].recip() } else { 0.0 };
        let correlation = self.covariance.map_with_location(|i, j, c| c * scale(i) * scale(j));
        let eigen = correlation.symmetric_eigen();
        let mut root = eigen.eigenvectors;
        for (mut column, value) in root.column_iter_mut().zip(&eigen.eigenvalues) {
            column *= value.max(0.0).sqrt();
        }
        root.map_with_location(|i, _, value| value * std[i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_root_s_square_is_the_covariance_also_where_that_is_singular() {
        let x = DMatrix::from_fn(5, 3, |i, j| ((3 * i + 5 * j) as f64).sin() * 10f64.powi(i as i32 - 2));
        let covariance = &x * x.transpose();
        let of = EntryCovariance {
            entries: vec![0, 1, 4, 9, 11],
            covariance: covariance.clone(),
            gain: [[0.0; 3]; 3],
            bias: [0.0; 3],
        };
        let root = of.root();
        let left = &root * root.transpose() - &covariance;
        for (i, j) in (0..5).flat_map(|i| (0..5).map(move |j| (i, j))) {
            let size = (covariance[(i, i)] * covariance[(j, j)]).sqrt();
            assert!(left[(i, j)].abs() < 1e-12 * size, "{i} {j}");
        }
    }
}

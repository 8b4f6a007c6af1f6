//! Why a recording could not be written.

use std::path::PathBuf;

use super::{manifest::fault::ManifestFault, sensor_kind::SensorKind, unit::Unit};
use crate::file::OutputError;

/// A failure to write a recording; its text names the file, what was found, what was expected and
/// what to do. Nothing half-written is left.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)] // The fields are those of each message.
pub enum WriteError {
    /// A file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The name says no format there is a writer for.
    #[error(
        "{path}: found the ending `{found}`, expected .csv, .csv.gz, .parquet or .mcap; give the file such a name"
    )]
    UnknownFormat { path: PathBuf, found: String },
    /// Logs are not built in.
    #[error(
        "{path}: found the ending .mcap, expected .csv, .csv.gz or .parquet since this build is without logs; build with `--features logs` or write CSV"
    )]
    LogsNotBuilt { path: PathBuf },
    /// A sensor in a unit that messages of ROS have no size for.
    #[error(
        "{path}: found {sensor} in {unit}, expected a unit of SI, which messages of ROS are in; correct it by `imucal apply` with a calibration of {sensor}, or write CSV or Parquet"
    )]
    NotOfRos { path: PathBuf, sensor: SensorKind, unit: Unit },
    /// A time that no message has.
    #[error(
        "{path}, row {row}, column `t`: found {found} s, expected 0 to 2^31 s, each row a nanosecond or more after the one before, as stamps of ROS are; write CSV or Parquet"
    )]
    Stamp { path: PathBuf, row: usize, found: f64 },
    /// Parquet is not built in.
    #[error(
        "{path}: found the ending .parquet, expected .csv or .csv.gz since this build is without Parquet; build with `--features parquet` or write CSV"
    )]
    ParquetNotBuilt { path: PathBuf },
    /// The manifest contradicts itself, so that nobody could read the recording.
    #[error("{path}: the manifest to be written would be refused: {fault}")]
    Manifest { path: PathBuf, fault: ManifestFault },
    /// A column has not as many rows as the time.
    #[error(
        "{path}, column `{column}`: found {found} rows, expected {expected} as of `t`; correct the recording before writing it"
    )]
    RowsDiffer { path: PathBuf, column: String, found: usize, expected: usize },
    /// Times that would be refused when read.
    #[error(
        "{path}, row {row}, column `t`: found {found} s after {before} s, expected strictly increasing finite times; sort the rows or remove duplicates before writing"
    )]
    TimeOrder { path: PathBuf, row: usize, found: f64, before: f64 },
    /// Times of an absolute clock that a Parquet file's doubles cannot tell apart.
    #[error(
        "{path}, row {row}, column `t`: found a time that is one with that of the row before as a double, expected times whole in their unit; write t = \"ns\" below [units] and whole nanoseconds, or write CSV"
    )]
    TimeTooFine { path: PathBuf, row: usize },
    /// A part of a recording is not of the one before.
    #[error(
        "{path}, row {row}: found a part with other columns or another manifest, expected those of the first part; write it as a recording of its own"
    )]
    PartDiffers { path: PathBuf, row: usize },
    /// Times with decimals that come after so many without that the column was begun as integers.
    #[error(
        "{path}, row {row}, column `t`: found a time with decimals after whole ones, expected a column of integers; write t = \"ns\" below [units], or write CSV"
    )]
    TimeNotWhole { path: PathBuf, row: usize },
    /// An infinite value, which no reader takes.
    #[error(
        "{path}, row {row}, column `{column}`: found an infinite value, expected a finite one or NaN for not measured; correct the recording before writing it"
    )]
    Infinite { path: PathBuf, row: usize, column: String },
}

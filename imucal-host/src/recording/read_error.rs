//! Why a recording could not be read.

use std::path::{Path, PathBuf};

use super::{
    log_topics::TopicFault,
    manifest::fault::ManifestFault,
    mapping::MappingFault,
    place::{Place, at_line},
    read::header_fault::HeaderFault,
    sensor_kind::SensorKind,
    unit::{TimeUnit, Unit},
    warning::{Warning, listed},
};
use crate::file::limits::{ReadFault, Size};

/// A failure to read a recording; its text names the file, the place, what was found, what was
/// expected and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)] // The fields are those of each message: path, place, column, found, expected.
pub enum ReadError {
    /// The file is not there or not readable.
    #[error("{path}: cannot be read ({found}); expected a readable file; check the path and its permissions")]
    Unreadable { path: PathBuf, found: String },
    /// The name says no format there is a reader for.
    #[error(
        "{path}: found the ending `{found}`, expected .csv, .csv.gz, .parquet, .mat, .mcap, .db3 or .bag; {}", remedy(.found)
    )]
    UnknownFormat { path: PathBuf, found: String },
    /// Parquet is not built in.
    #[error(
        "{path}: found a Parquet file, expected .csv or .csv.gz since this build is without Parquet; build with `--features parquet` or convert the file to CSV"
    )]
    ParquetNotBuilt { path: PathBuf },
    /// Logs are not built in.
    #[error(
        "{path}: found a robot's log, expected .csv, .csv.gz or .parquet since this build is without logs; build with `--features logs`"
    )]
    LogsNotBuilt { path: PathBuf },
    /// A folder, and the files in it that are read.
    #[error("{path}: found a folder, expected a file; {}", in_folder(.files))]
    Folder { path: PathBuf, files: Vec<String> },
    /// A log that cannot be read.
    #[cfg(feature = "logs")]
    #[error(transparent)]
    Log(Box<imucal_logs::LogError>),
    /// Topics that are not there, or not those that are asked for.
    #[error("{path}: {fault}")]
    Topics { path: PathBuf, fault: Box<TopicFault> },
    /// A MAT-file of a level that is not read.
    #[error("{path}: found {found}, expected a MAT-file of level 5; {remedy}")]
    OtherMatFile { path: PathBuf, found: String, remedy: &'static str },
    /// A MAT-file without an array of numbers.
    #[error(
        "{path}: found {}, expected vectors or matrices of numbers with as many rows as samples; save such, for example by `save -v7 log.mat t acc gyr`, or of a table T `S = table2struct(T, \"ToScalar\", true)`",
        if .others.is_empty() { "no variable".to_owned() } else { listed(.others) }
    )]
    NoNumbers { path: PathBuf, others: Vec<String> },
    /// Columns that are wrong or missing, where some variables were left out.
    #[error("{error}. Also, {warning}")]
    AmongLeftOut { error: Box<ReadError>, warning: Box<Warning> },
    /// The compressed or columnar container is damaged.
    #[error("{path}: found a damaged file ({found}), expected {expected}; copy or record it again")]
    Damaged { path: PathBuf, found: String, expected: &'static str },
    /// Nothing in the file.
    #[error("{path}: found an empty file, expected a header row and samples; record or copy it again")]
    Empty { path: PathBuf },
    /// A header and no sample.
    #[error(
        "{path}: found a header and no sample, expected at least one row below it; record or copy it again"
    )]
    NoRows { path: PathBuf },
    /// Text in another encoding.
    #[error(
        "{path}, line {line}: found bytes that are not UTF-8, expected UTF-8 text; save the file as UTF-8"
    )]
    NotUtf8 { path: PathBuf, line: u64 },

    /// The columns are not those of a recording.
    #[error("{path}{}: {}", at_line(.line), joined(.faults))]
    Header { path: PathBuf, line: Option<u64>, faults: Vec<HeaderFault> },
    /// A mapping of columns that the file has not.
    #[error("{path}{}: {fault}", at_line(.line))]
    Mapping { path: PathBuf, line: Option<u64>, fault: MappingFault },
    /// More columns than a recording has.
    #[error(
        "{path}{}: found more than {limit} columns, expected at most as many; check that the file is a recording, and raise the limit with --max-columns if it is",
        at_line(.line)
    )]
    TooManyColumns { path: PathBuf, line: Option<u64>, limit: usize },
    /// A line longer than one of a recording.
    #[error(
        "{path}, line {line}: found a line longer than {limit}, expected at most that; check that the file is a recording, and raise the limit with --max-columns if it is"
    )]
    LineTooLong { path: PathBuf, line: u64, limit: Size },
    /// A text longer than that of a recording.
    #[error(
        "{path}: found more than {limit} of it, expected at most that; check that the file is what it should be, and raise the limit with --max-size if it is"
    )]
    TooLong { path: PathBuf, limit: Size },
    /// Samples that take more memory than those of a recording.
    #[error(
        "{path}: found samples that take more than {limit} of memory, expected at most that; split the recording, or raise the limit with --max-size"
    )]
    TooManySamples { path: PathBuf, limit: Size },
    /// Too many or too few fields.
    #[error(
        "{path}, {place}: found {found} field{}, expected {expected} as in the header; correct or remove the line",
        if *found == 1 { "" } else { "s" }
    )]
    FieldCount { path: PathBuf, place: Place, found: usize, expected: usize },
    /// Text where a number should be.
    #[error(
        "{path}, {place}, column `{column}`: found `{found}`, expected a number with a decimal point; correct it, or leave it empty if it was not measured"
    )]
    NotANumber { path: PathBuf, place: Place, column: String, found: String },
    /// Text in place of a time.
    #[error(
        "{path}, {place}, column `{column}`: found `{found}`, expected a number, a date of ISO 8601 such as 2026-05-01T12:00:00.125Z, or an hour such as 12:00:00.125; write all times of the column in one of these ways"
    )]
    NotATime { path: PathBuf, place: Place, column: String, found: String },
    /// An infinite number.
    #[error(
        "{path}, {place}, column `{column}`: found the infinite value `{found}`, expected a finite number; leave it empty if it was not measured"
    )]
    Infinite { path: PathBuf, place: Place, column: String, found: String },
    /// A label that is no integer.
    #[error(
        "{path}, {place}, column `segment`: found {found}, expected an integer label or an empty field; correct it"
    )]
    SegmentNotInteger { path: PathBuf, place: Place, found: f64 },
    /// A column of a type that has no numbers.
    #[error(
        "{path}, column `{column}`: found the type {found}, expected floating-point or integer numbers; write the column as f64"
    )]
    ColumnType { path: PathBuf, column: String, found: String },

    /// A row without a time.
    #[error(
        "{path}, {place}, column `t`: found no time, expected a time in each row; fill it in or remove the row"
    )]
    TimeMissing { path: PathBuf, place: Place },
    /// Time stands still or runs back.
    #[error(
        "{path}, {place}, column `t`: found {found} after {before}, expected strictly increasing times; {remedy}"
    )]
    TimeOrder { path: PathBuf, place: Place, found: String, before: String, remedy: String },
    /// Two files of one recording disagree about a sample's time.
    #[error(
        "{path}, {place}: found the time {found} s against {other_time} s in {other}, expected them within half an interval ({tolerance:.6} s); give two files of one run, or interpolate one onto the other's times"
    )]
    TimesDiffer { path: PathBuf, place: Place, found: f64, other: PathBuf, other_time: f64, tolerance: f64 },
    /// Two files of one recording differ in length.
    #[error(
        "{path}: found {found} rows against {expected} in {other}, expected as many; give two files of one run"
    )]
    RowsDiffer { path: PathBuf, found: usize, other: PathBuf, expected: usize },

    /// Samples in memory that differ in length.
    #[error(
        "{path}, column `{column}`: found {found} rows, expected {expected} as there are times; give all columns of one length"
    )]
    Lengths { path: PathBuf, column: String, found: usize, expected: usize },

    /// No manifest.
    #[error(
        "{path}: not found, expected the manifest of the recording {recording} there; write it, for example:\n{}",
        super::manifest::fault::MINIMAL
    )]
    ManifestMissing { path: PathBuf, recording: String },
    /// A manifest that is not TOML or holds something of the wrong kind.
    #[error(
        "{path}, line {line}: found a manifest that cannot be understood ({found}), expected TOML as the recording format describes; correct the line"
    )]
    ManifestSyntax { path: PathBuf, line: usize, found: String },
    /// A manifest of another format or version.
    #[error(
        "{path}, line {line}: found the format {found}, expected format = \"{}\"; write it so, or convert the recording",
        super::manifest::fault::FORMAT
    )]
    ManifestFormat { path: PathBuf, line: usize, found: String },
    /// A manifest that contradicts itself.
    #[error("{path}, line {line}: {fault}")]
    Manifest { path: PathBuf, line: usize, fault: ManifestFault },

    /// The samples cannot be in the unit the manifest says, and another unit explains them.
    #[error(
        "{path}, from {from} on, sensor {sensor}: the median length is {median_norm:.4} {si} when read as `{unit}`, expected {expected}; the samples look like `{suggestion}`: write {sensor} = \"{suggestion}\" below [units] in the manifest, or --unit {sensor}={suggestion}"
    )]
    UnitImplausible {
        path: PathBuf,
        from: Place,
        sensor: SensorKind,
        unit: Unit,
        median_norm: f64,
        si: &'static str,
        expected: &'static str,
        suggestion: Unit,
    },
    /// Columns of a Parquet file are compressed by what this program does not read.
    #[error(
        "{path}: found columns compressed by brotli or lzo, expected gzip, lz4, snappy, zstd or nothing; write it by one of these"
    )]
    Compression { path: PathBuf },
    /// The times cannot be in the unit the manifest says, or in none.
    #[error(
        "{path}, from {from} on, column `t`: the median interval is {found:e} s when read as `{unit}`, {lasting:.3} s in all, expected 2.5e-5 to 0.2 s and some minutes (up to 2 s without a gyroscope); {remedy}"
    )]
    IntervalImplausible {
        path: PathBuf,
        from: Place,
        unit: TimeUnit,
        found: f64,
        lasting: f64,
        remedy: String,
    },
    /// A key of the manifest that was not understood may be the cause.
    #[error("{error}. First look at the manifest: {warning}")]
    Misled { error: Box<ReadError>, warning: Box<Warning> },
    /// One axis is in another unit than its neighbours.
    #[error(
        "{path}, from {from} on, column `{column}`: found samples that look like `{found}` while the other axes are in `{expected}` (then the length is steady at {median_norm:.3} m/s², and else it is not); convert the column to `{expected}`"
    )]
    MixedUnits {
        path: PathBuf,
        from: Place,
        column: &'static str,
        found: Unit,
        expected: Unit,
        median_norm: f64,
    },
}

impl ReadError {
    /// What became of reading the file at `path`.
    pub(crate) fn of(path: &Path, fault: ReadFault) -> Self {
        let path = path.to_path_buf();
        match fault {
            ReadFault::System(cause) => Self::Unreadable { path, found: cause.to_string() },
            ReadFault::TooLarge { limit } => Self::TooLong { path, limit: Size(limit) },
        }
    }

    /// What is wrong, without what may be the cause of it.
    #[must_use]
    pub fn fault(&self) -> &Self {
        match self {
            Self::AmongLeftOut { error, .. } | Self::Misled { error, .. } => error.fault(),
            error => error,
        }
    }

    /// Whether a limit ended the reading: more of the file is not to be read then.
    pub(crate) fn is_limit(&self) -> bool {
        matches!(
            self,
            Self::TooManyColumns { .. }
                | Self::LineTooLong { .. }
                | Self::TooLong { .. }
                | Self::TooManySamples { .. }
        )
    }
}

/// What becomes a recording out of a file with another ending.
fn remedy(ending: &str) -> &'static str {
    match ending {
        ".txt" | ".tsv" | ".tab" | ".dat" | ".log" | ".asc" => {
            "if it is text whose fields are separated by commas, semicolons, tabs, bars or single blanks, let its name end in .csv"
        }
        ".xls" | ".xlsx" | ".ods" => "save its sheet as CSV",
        ".npy" | ".npz" | ".h5" | ".hdf5" | ".pkl" => {
            "write its samples as CSV or Parquet, for example by pandas"
        }
        ".zip" | ".7z" | ".bz2" | ".xz" | ".zst" | ".zstd" => "decompress it first",
        _ => "give the samples file; `imucal import` takes a folder of EuRoC and files of imu_tk too",
    }
}

/// Files of a folder that are named, at most.
const NAMED: usize = 4;

fn in_folder(files: &[String]) -> String {
    let named = files.iter().take(NAMED).map(|file| format!("`{file}`")).collect::<Vec<_>>().join(", ");
    match files.len() {
        0 => "there is none in it that is read; a folder of EuRoC is brought in with `imucal import`"
            .to_owned(),
        1 => format!("give the one in it that is read: {named}"),
        count if count > NAMED => format!("give one of the {count} in it that are read: {named}, …"),
        _ => format!("give one of those in it that are read: {named}"),
    }
}

fn joined(faults: &[HeaderFault]) -> String {
    faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("; also, ")
}

//! The summary of a device's drift watch as a file: the bytes that [`imucal_core::watch::encode`] writes.

use std::path::{Path, PathBuf};

use imucal_core::watch::{self, SummaryError, WatchSummary};

use crate::{
    file::{Limits, ReadFault, limits::Size},
    recording::Recording,
};

/// What a summary begins with.
const MAGIC: &[u8] = b"IMUW";

/// Why a summary could not be read.
#[derive(Debug, thiserror::Error)]
pub enum WatchFileError {
    /// The file cannot be read.
    #[error("{path}: cannot be read: {cause}; check the path")]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// The file is longer than any summary.
    #[error(
        "{path}: found more than {limit}, expected the summary of a drift watch; give the bytes that a device wrote"
    )]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// What a small file may come to.
        limit: Size,
    },
    /// It is of another unit than a recording.
    #[error(
        "{path}: found the drift watch of the unit `{found}`, expected that of the recording, `{expected}`; give the summary of \
         that unit"
    )]
    OtherUnit {
        /// The file.
        path: PathBuf,
        /// Serial number of the summary.
        found: String,
        /// Serial number of the recording.
        expected: String,
    },
    /// The bytes are no summary.
    #[error("{path}: {cause}; read the summary from the device again")]
    Summary {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: SummaryError,
    },
}

/// Whether bytes claim to be a summary.
pub fn is_summary(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// Reads a summary.
///
/// # Errors
/// [`WatchFileError`] names the file and what is wrong with it.
pub fn read_within(path: &Path, limits: &Limits) -> Result<WatchSummary, WatchFileError> {
    let bytes = limits.read_small(path).map_err(|fault| match fault {
        ReadFault::System(cause) => WatchFileError::Io { path: path.into(), cause },
        ReadFault::TooLarge { limit } => WatchFileError::TooLarge { path: path.into(), limit: Size(limit) },
    })?;
    watch::decode(&bytes).map_err(|cause| WatchFileError::Summary { path: path.into(), cause })
}

/// As [`read_within`]; the summary must be of the recording's unit where both are known.
///
/// # Errors
/// As [`read_within`], and [`WatchFileError::OtherUnit`].
pub fn read_of(path: &Path, recording: &Recording, limits: &Limits) -> Result<WatchSummary, WatchFileError> {
    let summary = read_within(path, limits)?;
    let (found, expected) =
        (summary.sensor.serial.as_str(), recording.manifest.sensor.serial.as_deref().unwrap_or_default());
    if !found.is_empty() && !expected.is_empty() && found != expected {
        let (found, expected) = (found.to_owned(), expected.to_owned());
        return Err(WatchFileError::OtherUnit { path: path.into(), found, expected });
    }
    Ok(summary)
}

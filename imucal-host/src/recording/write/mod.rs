//! A recording to files, in the units of its manifest.

mod csv_writer;
mod file_units;
#[cfg(feature = "logs")]
mod mcap_writer;
#[cfg(feature = "parquet")]
pub(crate) mod parquet_writer;
mod samples;
pub(crate) mod writer;

use std::{io, path::Path};

use crate::{file::OutputError, recording::write_error::WriteError};

/// The system refuses.
fn failed(path: &Path, cause: io::Error) -> WriteError {
    OutputError::System { path: path.to_path_buf(), cause }.into()
}

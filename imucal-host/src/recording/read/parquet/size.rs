//! What a Parquet file may come to, by what it says of itself.

use std::{ops::Range, path::Path};

use ::parquet::file::metadata::ParquetMetaData;

use crate::{
    file::{Limits, limits::Size},
    recording::read_error::ReadError,
};

/// What the file says of itself and of some of its groups, before anything is made of them.
pub(super) fn refuse_too_long(
    path: &Path,
    found: &ParquetMetaData,
    which: &Range<usize>,
    limits: &Limits,
) -> Result<(), ReadError> {
    if found.file_metadata().schema_descr().num_columns() > limits.columns {
        let (path, limit) = (path.to_path_buf(), limits.columns);
        return Err(ReadError::TooManyColumns { path, line: None, limit });
    }
    let sizes = found.row_groups()[which.clone()].iter().flat_map(|group| group.columns());
    let size = sizes.fold(0u64, |sum, column| sum.saturating_add(column.uncompressed_size().max(0) as u64));
    if size > limits.size {
        return Err(ReadError::TooLong { path: path.to_path_buf(), limit: Size(limits.size) });
    }
    Ok(())
}

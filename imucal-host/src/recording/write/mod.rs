//! A recording to files, in the units of its manifest.

mod csv_writer;
mod file_units;
#[cfg(feature = "parquet")]
pub(crate) mod parquet_writer;
mod samples;
pub(crate) mod writer;

//! A recording to files, in the units of its manifest.

mod csv_writer;
mod file_units;
pub(crate) mod writer;

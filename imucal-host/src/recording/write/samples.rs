//! The samples file of each format, part after part.

use std::path::Path;

use flate2::{Compression, write::GzEncoder};

#[cfg(feature = "logs")]
use super::mcap_writer::McapWriter;
#[cfg(feature = "parquet")]
use super::parquet_writer::ParquetWriter;
use super::{csv_writer::CsvWriter, failed, file_units::singles_of};
use crate::{
    file::Output,
    recording::{
        Recording,
        format::{Format, is_mcap},
        read::columns::{TIME, Table},
        warning::Warning,
        write_error::WriteError,
    },
};

/// A samples file under way.
pub(crate) struct Samples<'a> {
    path: &'a Path,
    sink: Sink<'a>,
    /// Slots of the columns, and names of the unknown ones.
    columns: (Vec<usize>, Vec<String>),
    rows: usize,
}

enum Sink<'a> {
    Csv(Box<CsvWriter<&'a mut Output>>),
    CsvGz(Box<CsvWriter<GzEncoder<&'a mut Output>>>),
    #[cfg(feature = "parquet")]
    Parquet(Box<ParquetWriter<&'a mut Output>>),
    #[cfg(feature = "logs")]
    Mcap(Box<McapWriter<&'a mut Output>>),
}

impl<'a> Samples<'a> {
    /// Starts a file with the columns of the first part; `table` is that part in file units.
    pub(crate) fn begin(
        format: Format,
        first: &Recording,
        table: &Table,
        path: &'a Path,
        file: &'a mut Output,
    ) -> Result<Self, WriteError> {
        let singles = singles_of(first);
        let begun = |cause| failed(path, cause);
        let sink = match format {
            Format::Csv => Sink::Csv(Box::new(CsvWriter::begin(file, table, singles).map_err(begun)?)),
            Format::CsvGz => {
                let encoder = GzEncoder::new(file, Compression::default());
                Sink::CsvGz(Box::new(CsvWriter::begin(encoder, table, singles).map_err(begun)?))
            }
            #[cfg(feature = "parquet")]
            Format::Parquet => {
                Sink::Parquet(Box::new(ParquetWriter::begin(file, table, singles).map_err(begun)?))
            }
            #[cfg(not(feature = "parquet"))]
            Format::Parquet => return Err(WriteError::ParquetNotBuilt { path: path.to_path_buf() }),
            #[cfg(feature = "logs")]
            Format::Log if is_mcap(path) => Sink::Mcap(Box::new(McapWriter::begin(file, first, path)?)),
            #[cfg(not(feature = "logs"))]
            Format::Log if is_mcap(path) => {
                return Err(WriteError::LogsNotBuilt { path: path.to_path_buf() });
            }
            Format::Mat | Format::Log => {
                let found = path.extension().unwrap_or_default().to_string_lossy();
                return Err(WriteError::UnknownFormat {
                    path: path.to_path_buf(),
                    found: format!(".{found}"),
                });
            }
        };
        Ok(Self { path, sink, columns: columns_of(table), rows: 0 })
    }

    /// Appends a part; `table` is that part in file units.
    #[cfg_attr(
        not(feature = "logs"),
        expect(unused_variables, reason = "a log alone is written from the part")
    )]
    pub(crate) fn append(&mut self, part: &Recording, table: &Table) -> Result<(), WriteError> {
        let rows = table.columns[TIME].len();
        if rows == 0 {
            return Ok(());
        }
        if columns_of(table) != self.columns {
            return Err(WriteError::PartDiffers { path: self.path.to_path_buf(), row: self.rows + 1 });
        }
        let written = match &mut self.sink {
            Sink::Csv(writer) => writer.append(table, rows),
            Sink::CsvGz(writer) => writer.append(table, rows),
            #[cfg(feature = "parquet")]
            Sink::Parquet(writer) => writer.append(table, self.path, self.rows)?,
            #[cfg(feature = "logs")]
            Sink::Mcap(writer) => writer.append(part, self.path, self.rows)?,
        };
        self.rows += rows;
        written.map_err(|cause| failed(self.path, cause))
    }

    /// Ends the file; what its format does not hold.
    pub(crate) fn finish(self) -> Result<Option<Warning>, WriteError> {
        let ended = match self.sink {
            Sink::Csv(_) => Ok(None),
            Sink::CsvGz(writer) => writer.finish().finish().map(|_| None),
            #[cfg(feature = "parquet")]
            Sink::Parquet(writer) => writer.finish().map(|()| None),
            #[cfg(feature = "logs")]
            Sink::Mcap(writer) => writer.finish(),
        };
        ended.map_err(|cause| failed(self.path, cause))
    }
}

fn columns_of(table: &Table) -> (Vec<usize>, Vec<String>) {
    let there = table.columns.iter().enumerate().filter(|(_, column)| !column.is_empty());
    (there.map(|(slot, _)| slot).collect(), table.extra.iter().map(|column| column.name.clone()).collect())
}

//! The samples file of each format, part after part.

use std::{io, path::Path};

use flate2::{Compression, write::GzEncoder};

#[cfg(feature = "parquet")]
use super::parquet_writer::ParquetWriter;
use super::{csv_writer::CsvWriter, file_units::singles_of};
use crate::{
    file::{Output, OutputError},
    recording::{
        Recording,
        format::Format,
        read::columns::{TIME, Table},
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

    /// Appends a part in file units.
    pub(crate) fn append(&mut self, table: &Table) -> Result<(), WriteError> {
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
        };
        self.rows += rows;
        written.map_err(|cause| failed(self.path, cause))
    }

    /// Ends the file.
    pub(crate) fn finish(self) -> Result<(), WriteError> {
        let ended = match self.sink {
            Sink::Csv(_) => Ok(()),
            Sink::CsvGz(writer) => writer.finish().finish().map(|_| ()),
            #[cfg(feature = "parquet")]
            Sink::Parquet(writer) => writer.finish(),
        };
        ended.map_err(|cause| failed(self.path, cause))
    }
}

fn columns_of(table: &Table) -> (Vec<usize>, Vec<String>) {
    let there = table.columns.iter().enumerate().filter(|(_, column)| !column.is_empty());
    (there.map(|(slot, _)| slot).collect(), table.extra.iter().map(|column| column.name.clone()).collect())
}

fn failed(path: &Path, cause: io::Error) -> WriteError {
    OutputError::System { path: path.to_path_buf(), cause }.into()
}

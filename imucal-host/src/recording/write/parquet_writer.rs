//! Writing samples as Parquet.

use std::{io, ops::Range, path::Path, sync::Arc};

use ::parquet::{
    basic::{Compression, ConvertedType, Repetition, Type as Physical},
    data_type::{ByteArray, ByteArrayType, DoubleType, FloatType, Int64Type},
    errors::ParquetError,
    file::{
        properties::WriterProperties,
        writer::{SerializedColumnWriter, SerializedFileWriter},
    },
    schema::types::Type,
};

use crate::recording::{
    read::columns::{KNOWN, NAMES, TIME, Table},
    write_error::WriteError,
};

/// Times of the column `t` of a Parquet file.
enum Times {
    /// Of an absolute clock, exact.
    Whole(Vec<i64>),
    /// In the file's unit, as near as doubles get.
    Doubles(Vec<f64>),
}

impl Times {
    /// Integers where there is an epoch and the file's unit counts all times so.
    fn of(table: &Table) -> Self {
        Self::Whole(Vec::new()).those(table).unwrap_or_else(|_| Self::doubles(table))
    }

    fn doubles(table: &Table) -> Self {
        Self::Doubles(table.columns[TIME].iter().map(|time| table.clock.nearest(*time)).collect())
    }

    /// The times of a table as these are; the first row that cannot be.
    fn those(&self, table: &Table) -> Result<Self, usize> {
        let whole = |(row, time): (usize, &f64)| table.clock.whole(*time).ok_or(row);
        match self {
            Self::Whole(_) => {
                table.columns[TIME].iter().enumerate().map(whole).collect::<Result<_, _>>().map(Self::Whole)
            }
            Self::Doubles(_) => Ok(Self::doubles(table)),
        }
    }

    /// The first row, from 0, of those that follow whose time is not after the one before.
    fn repeated(&self, next: &Self) -> Option<usize> {
        match (self, next) {
            (Self::Whole(last), Self::Whole(times)) => not_after(last, times),
            (Self::Doubles(last), Self::Doubles(times)) => not_after(last, times),
            _ => None,
        }
    }

    /// The last of them alone.
    fn last(&self) -> Self {
        match self {
            Self::Whole(times) => Self::Whole(times.last().copied().into_iter().collect()),
            Self::Doubles(times) => Self::Doubles(times.last().copied().into_iter().collect()),
        }
    }

    fn physical(&self) -> Physical {
        match self {
            Self::Whole(_) => Physical::INT64,
            Self::Doubles(_) => Physical::DOUBLE,
        }
    }

    fn write(
        &self,
        rows: Range<usize>,
        column: &mut SerializedColumnWriter<'_>,
    ) -> Result<usize, ParquetError> {
        match self {
            Self::Whole(times) => column.typed::<Int64Type>().write_batch(&times[rows], None, None),
            Self::Doubles(times) => column.typed::<DoubleType>().write_batch(&times[rows], None, None),
        }
    }
}

fn not_after<T: PartialOrd>(last: &[T], times: &[T]) -> Option<usize> {
    let first = last.last().zip(times.first()).filter(|(last, first)| first <= last);
    first.map(|_| 0).or_else(|| times.windows(2).position(|pair| pair[1] <= pair[0]).map(|row| row + 1))
}

/// Most rows of a row group, so that a reader needs no more memory than for these.
const GROUP: usize = 1 << 16;

/// Samples as Parquet; what was not measured is NaN.
pub(crate) struct ParquetWriter<W: io::Write + Send> {
    writer: SerializedFileWriter<W>,
    present: Vec<usize>,
    singles: [bool; KNOWN],
    /// The last time that was written, as the column has it; none at first.
    last: Times,
}

impl<W: io::Write + Send> ParquetWriter<W> {
    /// Starts with the columns of a table, which has the first rows; `singles` are columns whose numbers are those of an
    /// `f32`, and are stored as such.
    pub(crate) fn begin(out: W, table: &Table, singles: [bool; KNOWN]) -> io::Result<Self> {
        Self::open(out, table, singles).map_err(io::Error::other)
    }

    fn open(out: W, table: &Table, singles: [bool; KNOWN]) -> Result<Self, ParquetError> {
        let present: Vec<usize> = (0..KNOWN).filter(|slot| !table.columns[*slot].is_empty()).collect();
        let times = Times::of(table);
        let mut properties = WriterProperties::builder().set_compression(Compression::SNAPPY);
        let mut fields = Vec::new();
        for slot in &present {
            let physical = match *slot {
                TIME => times.physical(),
                slot if singles[slot] => Physical::FLOAT,
                _ => Physical::DOUBLE,
            };
            fields.push(field(NAMES[*slot], physical, ConvertedType::NONE)?);
            // A dictionary of numbers of which each is another costs more than the numbers.
            if *slot == TIME || singles[*slot] {
                properties = properties.set_column_dictionary_enabled(NAMES[*slot].into(), false);
            }
        }
        for column in &table.extra {
            fields.push(field(&column.name, Physical::BYTE_ARRAY, ConvertedType::UTF8)?);
        }
        let schema = Arc::new(Type::group_type_builder("recording").with_fields(fields).build()?);
        let writer = SerializedFileWriter::new(out, schema, Arc::new(properties.build()))?;
        let last = match times {
            Times::Whole(_) => Times::Whole(Vec::new()),
            Times::Doubles(_) => Times::Doubles(Vec::new()),
        };
        Ok(Self { writer, present, singles, last })
    }

    /// Appends the rows of a table that has the columns of the first; `before` were written already.
    pub(crate) fn append(
        &mut self,
        table: &Table,
        path: &Path,
        before: usize,
    ) -> Result<io::Result<()>, WriteError> {
        let times = self
            .last
            .those(table)
            .map_err(|row| WriteError::TimeNotWhole { path: path.to_path_buf(), row: before + row + 1 })?;
        if let Some(row) = self.last.repeated(&times) {
            return Err(WriteError::TimeTooFine { path: path.to_path_buf(), row: before + row + 1 });
        }
        let rows = table.columns[TIME].len();
        for start in (0..rows).step_by(GROUP) {
            let group = start..rows.min(start + GROUP);
            if let Err(cause) = self.write_group(table, &times, group) {
                return Ok(Err(io::Error::other(cause)));
            }
        }
        self.last = times.last();
        Ok(Ok(()))
    }

    fn write_group(&mut self, table: &Table, times: &Times, rows: Range<usize>) -> Result<(), ParquetError> {
        let mut group = self.writer.next_row_group()?;
        for slot in &self.present {
            let Some(mut column) = group.next_column()? else {
                break;
            };
            match *slot {
                TIME => times.write(rows.clone(), &mut column)?,
                slot if self.singles[slot] => {
                    let values = &table.columns[slot][rows.clone()];
                    let values: Vec<f32> = values.iter().map(|value| *value as f32).collect();
                    column.typed::<FloatType>().write_batch(&values, None, None)?
                }
                slot => {
                    let values = &table.columns[slot][rows.clone()];
                    column.typed::<DoubleType>().write_batch(values, None, None)?
                }
            };
            column.close()?;
        }
        for extra in &table.extra {
            let Some(mut column) = group.next_column()? else {
                break;
            };
            let texts: Vec<ByteArray> =
                extra.values[rows.clone()].iter().map(|text| text.as_str().into()).collect();
            column.typed::<ByteArrayType>().write_batch(&texts, None, None)?;
            column.close()?;
        }
        group.close().map(|_| ())
    }

    /// Ends the file.
    pub(crate) fn finish(self) -> io::Result<()> {
        self.writer.close().map(|_| ()).map_err(io::Error::other)
    }
}

fn field(name: &str, physical: Physical, converted: ConvertedType) -> Result<Arc<Type>, ParquetError> {
    Type::primitive_type_builder(name, physical)
        .with_repetition(Repetition::REQUIRED)
        .with_converted_type(converted)
        .build()
        .map(Arc::new)
}

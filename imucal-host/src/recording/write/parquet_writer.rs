//! Writing samples as Parquet.

use std::{io, sync::Arc};

use ::parquet::{
    basic::{Compression, ConvertedType, Repetition, Type as Physical},
    data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type},
    errors::ParquetError,
    file::{
        properties::WriterProperties,
        writer::{SerializedColumnWriter, SerializedFileWriter},
    },
    schema::types::Type,
};

use crate::recording::read::columns::{KNOWN, NAMES, TIME, Table};

/// The column `t` of a Parquet file.
pub(crate) enum Times {
    /// Of an absolute clock, exact.
    Whole(Vec<i64>),
    /// In the file's unit, as near as doubles get.
    Doubles(Vec<f64>),
}

impl Times {
    /// Integers where there is an epoch and the file's unit counts all times so.
    pub(crate) fn of(table: &Table) -> Self {
        let (times, clock) = (&table.columns[TIME], &table.clock);
        let whole: Option<Vec<i64>> = times.iter().map(|time| clock.whole(*time)).collect();
        match whole {
            Some(whole) => Self::Whole(whole),
            None => Self::Doubles(times.iter().map(|time| clock.nearest(*time)).collect()),
        }
    }

    /// The first row whose time is not after that of the row before.
    pub(crate) fn repeated(&self) -> Option<usize> {
        let before = match self {
            Self::Whole(times) => times.windows(2).position(|pair| pair[1] <= pair[0]),
            Self::Doubles(times) => times.windows(2).position(|pair| pair[1] <= pair[0]),
        };
        before.map(|row| row + 1)
    }

    fn physical(&self) -> Physical {
        match self {
            Self::Whole(_) => Physical::INT64,
            Self::Doubles(_) => Physical::DOUBLE,
        }
    }

    fn write(&self, column: &mut SerializedColumnWriter<'_>) -> Result<usize, ParquetError> {
        match self {
            Self::Whole(times) => column.typed::<Int64Type>().write_batch(times, None, None),
            Self::Doubles(times) => column.typed::<DoubleType>().write_batch(times, None, None),
        }
    }
}

/// The columns of a table as Parquet; what was not measured is NaN.
pub(crate) fn write(
    table: &Table,
    times: &Times,
    rows: usize,
    out: &mut (impl io::Write + Send),
) -> io::Result<()> {
    write_group(table, times, rows, out).map_err(io::Error::other)
}

fn write_group(
    table: &Table,
    times: &Times,
    rows: usize,
    out: &mut (impl io::Write + Send),
) -> Result<(), ParquetError> {
    let present: Vec<usize> = (0..KNOWN).filter(|slot| !table.columns[*slot].is_empty()).collect();
    let mut fields = Vec::new();
    for slot in &present {
        let physical = if *slot == TIME { times.physical() } else { Physical::DOUBLE };
        fields.push(field(NAMES[*slot], physical, ConvertedType::NONE)?);
    }
    for column in &table.extra {
        fields.push(field(&column.name, Physical::BYTE_ARRAY, ConvertedType::UTF8)?);
    }
    let schema = Arc::new(Type::group_type_builder("recording").with_fields(fields).build()?);
    let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
    let mut writer = SerializedFileWriter::new(out, schema, Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    for slot in &present {
        let Some(mut column) = group.next_column()? else {
            break;
        };
        match *slot {
            TIME => times.write(&mut column)?,
            slot => column.typed::<DoubleType>().write_batch(&table.columns[slot][..rows], None, None)?,
        };
        column.close()?;
    }
    for extra in &table.extra {
        let Some(mut column) = group.next_column()? else {
            break;
        };
        let texts: Vec<ByteArray> = extra.values.iter().map(|text| text.as_str().into()).collect();
        column.typed::<ByteArrayType>().write_batch(&texts, None, None)?;
        column.close()?;
    }
    group.close()?;
    writer.close().map(|_| ())
}

fn field(name: &str, physical: Physical, converted: ConvertedType) -> Result<Arc<Type>, ParquetError> {
    Type::primitive_type_builder(name, physical)
        .with_repetition(Repetition::REQUIRED)
        .with_converted_type(converted)
        .build()
        .map(Arc::new)
}

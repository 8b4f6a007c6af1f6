//! The table as Parquet: one row group, every column optional.

use std::{fs::File, io, path::Path, sync::Arc};

use ::parquet::{
    basic::{Compression, ConvertedType, Repetition, Type as Physical},
    data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type},
    errors::ParquetError,
    file::{
        properties::WriterProperties,
        reader::{FileReader, SerializedFileReader},
        writer::{SerializedFileWriter, SerializedRowGroupWriter},
    },
    schema::types::Type,
};

use super::{Column, Table};

/// Who has written it.
const CREATOR: &str = "imucal batch";

pub(super) fn is_summary(path: &Path) -> bool {
    let reader = File::open(path).ok().and_then(|file| SerializedFileReader::new(file).ok());
    reader.is_some_and(|reader| reader.metadata().file_metadata().created_by() == Some(CREATOR))
}

pub(super) fn bytes(table: &Table) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    write(table, &mut bytes).map_err(io::Error::other)?;
    Ok(bytes)
}

fn write(table: &Table, out: &mut Vec<u8>) -> Result<(), ParquetError> {
    let fields: Result<Vec<Arc<Type>>, ParquetError> = table.iter().map(field).collect();
    let schema = Arc::new(Type::group_type_builder("summary").with_fields(fields?).build()?);
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by(CREATOR.into())
        .build();
    let mut writer = SerializedFileWriter::new(out, schema, Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    for (_, column) in table {
        match column {
            Column::Text(values) => {
                let texts: Vec<Option<ByteArray>> =
                    values.iter().map(|text| text.as_deref().map(ByteArray::from)).collect();
                next::<ByteArrayType>(&mut group, &texts)?;
            }
            Column::Number(values) => next::<DoubleType>(&mut group, values)?,
            Column::Whole(values) => next::<Int64Type>(&mut group, values)?,
        }
    }
    group.close()?;
    writer.close().map(|_| ())
}

fn field((name, column): &(String, Column)) -> Result<Arc<Type>, ParquetError> {
    let (physical, converted) = match column {
        Column::Text(_) => (Physical::BYTE_ARRAY, ConvertedType::UTF8),
        Column::Number(_) => (Physical::DOUBLE, ConvertedType::NONE),
        Column::Whole(_) => (Physical::INT64, ConvertedType::NONE),
    };
    let builder = Type::primitive_type_builder(name, physical);
    builder.with_repetition(Repetition::OPTIONAL).with_converted_type(converted).build().map(Arc::new)
}

fn next<D: DataType>(
    group: &mut SerializedRowGroupWriter<'_, &mut Vec<u8>>,
    values: &[Option<D::T>],
) -> Result<(), ParquetError> {
    let levels: Vec<i16> = values.iter().map(|value| i16::from(value.is_some())).collect();
    let present: Vec<D::T> = values.iter().flatten().cloned().collect();
    let Some(mut column) = group.next_column()? else { return Ok(()) };
    column.typed::<D>().write_batch(&present, Some(&levels), None)?;
    column.close()
}

//! Samples as Parquet: the columns of the CSV, numbers as doubles, those of an `f32` as floats, unknown columns as text.

use std::{
    fs::File,
    ops::{ControlFlow, Range},
    path::Path,
};

use ::parquet::{
    basic::{ConvertedType, LogicalType, TimeUnit as Stamp, Type as Physical},
    column::reader::{ColumnReader, ColumnReaderImpl},
    data_type::{ByteArray, DataType},
    errors::ParquetError,
    file::reader::{FileReader, RowGroupReader, SerializedFileReader},
    schema::types::ColumnDescriptor,
};

mod size;

use self::size::refuse_too_long;
use super::{
    clock::Clock,
    columns::{KNOWN, Layout, NAMES, TIME, Table, Target, infinite_is_missing},
    memory::Memory,
};
use crate::{
    file::Limits,
    recording::{mapping::Mapping, place::Places, read_error::ReadError, unit::TimeUnit, warning::Warning},
};

/// How the library begins to say that it cannot decompress a column.
const NOT_BUILT: &str = "Disabled feature at compile time";

/// Reads the samples of a Parquet file in file units; columns may be doubles, floats or integers.
pub(crate) fn read(
    path: &Path,
    unit: TimeUnit,
    mapping: &Mapping,
    limits: &Limits,
) -> Result<Table, ReadError> {
    let reader = open(path)?;
    groups(path, &reader, 0..reader.num_row_groups(), Clock::new(unit), mapping, limits)
}

/// As [`read`], but by row groups. The file may be of any length; the limits are those of one group.
pub(crate) fn read_parts(
    path: &Path,
    unit: TimeUnit,
    mapping: &Mapping,
    limits: &Limits,
    take: &mut dyn FnMut(Table) -> Result<ControlFlow<()>, ReadError>,
) -> Result<(), ReadError> {
    let reader = open(path)?;
    let mut clock = Clock::new(unit);
    let mut before = 0;
    // A file without a group is one without a row, which a whole reading says.
    if reader.num_row_groups() == 0 {
        return take(groups(path, &reader, 0..0, clock, mapping, limits)?).map(|_| ());
    }
    for group in 0..reader.num_row_groups() {
        let mut table = groups(path, &reader, group..group + 1, clock, mapping, limits)?;
        clock = table.clock.clone();
        let rows = table.columns[TIME].len() as u64;
        table.places = Places::Rows { before };
        before += rows;
        if take(table)?.is_break() {
            break;
        }
    }
    Ok(())
}

/// The names of a file's columns and the numbers of its first rows; those of columns that hold none are NaN.
pub(crate) fn beginning(path: &Path, rows: usize, limits: &Limits) -> Option<Vec<(String, Vec<f64>)>> {
    let reader = open(path).ok()?;
    refuse_too_long(path, reader.metadata(), &(0..1.min(reader.num_row_groups())), limits).ok()?;
    let group = reader.get_row_group(0).ok()?;
    let schema = reader.metadata().file_metadata().schema_descr_ptr();
    let memory = Memory::new(path, limits.size);
    let of = schema.columns().iter().enumerate().map(|(at, descriptor)| {
        let column = ColumnOfGroup { path, at, group: group.as_ref(), descriptor, memory: &memory };
        let mut numbers = Vec::new();
        if column.append_numbers(&mut numbers).is_err() {
            numbers = vec![f64::NAN; usize::try_from(group.metadata().num_rows()).unwrap_or(0).min(rows)];
        }
        numbers.truncate(rows);
        (descriptor.path().string(), numbers)
    });
    Some(of.collect())
}

/// The unit of a column of times whose type says it, as data frames write stamps.
pub(crate) fn unit_of_stamps(path: &Path, mapping: &Mapping) -> Option<TimeUnit> {
    let reader = open(path).ok()?;
    let schema = reader.metadata().file_metadata().schema_descr_ptr();
    let names: Vec<String> = schema.columns().iter().map(|column| column.path().string()).collect();
    let renamed = mapping.renamed(&names.iter().map(String::as_str).collect::<Vec<_>>()).ok()?;
    let at = renamed.iter().position(|name| name == NAMES[TIME])?;
    match schema.column(at).logical_type_ref()? {
        LogicalType::Timestamp(stamp) => Some(match stamp.unit {
            Stamp::MILLIS => TimeUnit::Millisecond,
            Stamp::MICROS => TimeUnit::Microsecond,
            Stamp::NANOS => TimeUnit::Nanosecond,
        }),
        _ => None,
    }
}

fn open(path: &Path) -> Result<SerializedFileReader<File>, ReadError> {
    let file = File::open(path)
        .map_err(|cause| ReadError::Unreadable { path: path.to_path_buf(), found: cause.to_string() })?;
    SerializedFileReader::new(file).map_err(|cause| damaged(path, &cause))
}

/// The rows of some groups.
fn groups(
    path: &Path,
    reader: &SerializedFileReader<File>,
    which: Range<usize>,
    clock: Clock,
    mapping: &Mapping,
    limits: &Limits,
) -> Result<Table, ReadError> {
    let damaged = |cause: ParquetError| damaged(path, &cause);
    refuse_too_long(path, reader.metadata(), &which, limits)?;
    let schema = reader.metadata().file_metadata().schema_descr_ptr();
    let names: Vec<String> = schema.columns().iter().map(|column| column.path().string()).collect();
    let fault = |fault| ReadError::Mapping { path: path.to_path_buf(), line: None, fault };
    let renamed = mapping.renamed(&names.iter().map(String::as_str).collect::<Vec<_>>()).map_err(fault)?;
    let kept = |at: usize| NAMES.contains(&renamed[at].as_str()) || has_text(&schema.column(at));
    let (kept, left_out): (Vec<usize>, Vec<usize>) = (0..renamed.len()).partition(|at| kept(*at));
    let layout = Layout::new(&kept.iter().map(|at| renamed[*at].as_str()).collect::<Vec<_>>(), path, None)?;
    let found = &reader.metadata().row_groups()[which.clone()];
    let rows: u64 = found.iter().map(|group| group.num_rows().max(0) as u64).sum();
    let memory = Memory::new(path, limits.size);
    memory.take(rows.saturating_mul(layout.row_size() as u64));
    memory.check()?;
    let mut table = layout.table(rows as usize, Places::WHOLE, clock);
    if which.start == 0 && !left_out.is_empty() {
        let columns =
            left_out.iter().map(|at| format!("`{}` ({})", names[*at], type_of(&schema.column(*at))));
        table.warnings.push(Warning::NotOneValue { path: path.to_path_buf(), columns: columns.collect() });
    }
    for group in which {
        let group = reader.get_row_group(group).map_err(damaged)?;
        for (&at, target) in kept.iter().zip(&layout.targets) {
            let descriptor = &schema.column(at);
            let column = ColumnOfGroup { path, at, group: group.as_ref(), descriptor, memory: &memory };
            match *target {
                Target::Known(TIME) => column.append_times(&mut table.columns[TIME], &mut table.clock)?,
                Target::Known(slot) => column.append_numbers(&mut table.columns[slot])?,
                Target::Extra(extra) => column.append_texts(&mut table.extra[extra].values)?,
            }
        }
    }
    for column in (0..KNOWN).filter(|slot| infinite_is_missing(*slot)) {
        table.columns[column]
            .iter_mut()
            .filter(|value| value.is_infinite())
            .for_each(|value| *value = f64::NAN);
    }
    table.refuse_infinite(path)?;
    Ok(table)
}

/// Whether the values of a column that the contract does not know can be kept as text: one in a row, of a type that has a text.
fn has_text(column: &ColumnDescriptor) -> bool {
    let physical = column.physical_type();
    column.max_rep_level() == 0 && !matches!(physical, Physical::INT96 | Physical::FIXED_LEN_BYTE_ARRAY)
}

/// What a column holds.
fn type_of(column: &ColumnDescriptor) -> String {
    let list = if column.max_rep_level() > 0 { "list of " } else { "" };
    let converted = match column.converted_type() {
        ConvertedType::NONE => String::new(),
        converted => format!(", {converted}"),
    };
    format!("{list}{}{converted}", column.physical_type())
}

fn damaged(path: &Path, cause: &ParquetError) -> ReadError {
    if cause.to_string().contains(NOT_BUILT) {
        return ReadError::Compression { path: path.to_path_buf() };
    }
    ReadError::Damaged {
        path: path.to_path_buf(),
        found: cause.to_string(),
        expected: "an intact Parquet file",
    }
}

/// One column of one row group.
struct ColumnOfGroup<'a> {
    path: &'a Path,
    at: usize,
    group: &'a dyn RowGroupReader,
    descriptor: &'a ColumnDescriptor,
    memory: &'a Memory<'a>,
}

impl ColumnOfGroup<'_> {
    fn append_numbers(&self, out: &mut Vec<f64>) -> Result<(), ReadError> {
        // A decimal's integers are not its values.
        if self.descriptor.converted_type() == ConvertedType::DECIMAL {
            return Err(self.type_error());
        }
        match self.reader()? {
            ColumnReader::DoubleColumnReader(column) => self.append(column, out, |v| v, f64::NAN),
            ColumnReader::FloatColumnReader(column) => self.append(column, out, f64::from, f64::NAN),
            ColumnReader::Int32ColumnReader(column) => self.append(column, out, f64::from, f64::NAN),
            ColumnReader::Int64ColumnReader(column) => self.append(column, out, |v| v as f64, f64::NAN),
            _ => Err(self.type_error()),
        }
    }

    /// As [`Self::append_numbers`], but integers are exact: those since 1970 in nanoseconds are beyond a double.
    fn append_times(&self, out: &mut Vec<f64>, clock: &mut Clock) -> Result<(), ReadError> {
        if self.descriptor.converted_type() == ConvertedType::DECIMAL {
            return Err(self.type_error());
        }
        match self.reader()? {
            ColumnReader::DoubleColumnReader(column) => {
                self.append(column, out, |v| clock.take_number(v), f64::NAN)
            }
            ColumnReader::FloatColumnReader(column) => {
                self.append(column, out, |v| clock.take_number(f64::from(v)), f64::NAN)
            }
            ColumnReader::Int32ColumnReader(column) => {
                self.append(column, out, |v| clock.take_integer(i64::from(v)), f64::NAN)
            }
            ColumnReader::Int64ColumnReader(column) => {
                self.append(column, out, |v| clock.take_integer(v), f64::NAN)
            }
            _ => Err(self.type_error()),
        }
    }

    fn append_texts(&self, out: &mut Vec<String>) -> Result<(), ReadError> {
        let none = String::new();
        match self.reader()? {
            ColumnReader::BoolColumnReader(column) => self.append(column, out, |v| v.to_string(), none),
            ColumnReader::Int32ColumnReader(column) => self.append(column, out, |v| v.to_string(), none),
            ColumnReader::Int64ColumnReader(column) => self.append(column, out, |v| v.to_string(), none),
            ColumnReader::FloatColumnReader(column) => self.append(column, out, |v| v.to_string(), none),
            ColumnReader::DoubleColumnReader(column) => self.append(column, out, |v| v.to_string(), none),
            ColumnReader::ByteArrayColumnReader(column) => {
                // A dictionary may repeat a long text in few bytes.
                let text = |v: ByteArray| match self.memory.take(v.len() as u64) {
                    true => String::from_utf8_lossy(v.data()).into_owned(),
                    false => String::new(),
                };
                self.append(column, out, text, none)?;
                self.memory.check()
            }
            _ => Err(self.type_error()),
        }
    }

    fn reader(&self) -> Result<ColumnReader, ReadError> {
        if self.descriptor.max_rep_level() > 0 {
            return Err(self.type_error());
        }
        self.group.get_column_reader(self.at).map_err(|cause| damaged(self.path, &cause))
    }

    fn type_error(&self) -> ReadError {
        ReadError::ColumnType {
            path: self.path.to_path_buf(),
            column: self.descriptor.path().string(),
            found: type_of(self.descriptor),
        }
    }

    /// Appends the group's rows; null becomes `none`.
    fn append<T: DataType, V: Clone>(
        &self,
        mut column: ColumnReaderImpl<T>,
        out: &mut Vec<V>,
        mut convert: impl FnMut(T::T) -> V,
        none: V,
    ) -> Result<(), ReadError> {
        let rows = usize::try_from(self.group.metadata().num_rows()).unwrap_or(0);
        let whole = self.descriptor.max_def_level();
        let (mut values, mut levels) = (Vec::new(), Vec::new());
        let mut done = 0;
        while done < rows {
            let levels = (whole > 0).then_some(&mut levels);
            let (records, ..) = column
                .read_records(rows - done, levels, None, &mut values)
                .map_err(|cause| damaged(self.path, &cause))?;
            if records == 0 {
                let cause = ParquetError::General(format!("{done} of {rows} rows in a row group"));
                return Err(damaged(self.path, &cause));
            }
            done += records;
        }
        if whole == 0 {
            out.extend(values.into_iter().map(convert));
            return Ok(());
        }
        let mut values = values.into_iter();
        out.extend(levels.iter().map(|level| {
            let value = if *level == whole { values.next() } else { None };
            value.map_or_else(|| none.clone(), &mut convert)
        }));
        Ok(())
    }
}

#[cfg(test)]
mod tests;

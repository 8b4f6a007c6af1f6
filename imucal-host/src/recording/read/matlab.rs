//! Samples as MATLAB saves them: the vectors and matrices of a MAT-file of level 5 (`-v6`, `-v7`), also within structures.
//!
//! A matrix is a column for each of its columns, or of its rows where these are fewer. Those of a quantity's size have the
//! names of a recording (`acc` of three: `acc_x`, `acc_y`, `acc_z`); others are numbered by axis or count.
//!
//! Not read: tables, timetables and times as `datetime`, whose layout MathWorks does not publish; level 7.3, which is HDF5;
//! level 4.

use std::{
    collections::HashMap,
    fs::File,
    io::{self, Read},
    path::Path,
};

use flate2::read::ZlibDecoder;

mod element;
mod variable;

use self::{
    element::{ByteOrder, COMPRESSED, Element, Elements, Fault, MATRIX, Numbers},
    variable::{Content, Variable},
};
use super::{
    clock::Clock,
    columns::{Layout, NAMES, TIME, Table, Target, infinite_is_missing},
    memory::Memory,
};
use crate::{
    file::Limits,
    recording::{
        mapping::{Mapping, names_of},
        place::Places,
        read_error::ReadError,
        unit::TimeUnit,
        warning::Warning,
    },
};

/// Bytes before the first element.
const HEADER: usize = 128;
/// A matrix with more columns holds something else than samples of one sensor.
const WIDEST: usize = 32;

/// The columns of a file that MATLAB saved, and what of it is none.
#[derive(Clone, Debug, Default)]
struct Saved {
    columns: Vec<Column>,
    /// Each with what it is.
    others: Vec<String>,
}

/// A column of numbers by its name.
#[derive(Clone, Debug)]
struct Column {
    name: String,
    numbers: Numbers,
}

/// Reads the samples of a MAT-file in file units. What has not as many rows as the times is left out with a warning.
pub(crate) fn read(
    path: &Path,
    unit: TimeUnit,
    mapping: &Mapping,
    limits: &Limits,
) -> Result<Table, ReadError> {
    let Saved { columns, mut others } = saved(path, limits)?;
    if columns.is_empty() {
        return Err(ReadError::NoNumbers { path: path.to_path_buf(), others });
    }
    let names: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
    let fault = |fault| ReadError::Mapping { path: path.to_path_buf(), line: None, fault };
    let renamed = mapping.renamed(&names).map_err(fault)?;
    let rows = match renamed.iter().position(|name| name == NAMES[TIME]) {
        Some(time) => columns[time].numbers.len(),
        None => usual_length(&columns),
    };
    let mut kept = Vec::new();
    for (column, name) in columns.iter().zip(&renamed) {
        let found = column.numbers.len();
        if found == rows {
            kept.push((name.as_str(), &column.numbers));
        } else if NAMES.contains(&name.as_str()) {
            let column = column.name.clone();
            return Err(ReadError::Lengths { path: path.to_path_buf(), column, found, expected: rows });
        } else {
            others.push(format!("`{}` ({found} row{})", column.name, if found == 1 { "" } else { "s" }));
        }
    }
    let left_out = (!others.is_empty()).then(|| Warning::LeftOut { path: path.to_path_buf(), rows, others });
    let layout = Layout::new(&kept.iter().map(|(name, _)| *name).collect::<Vec<_>>(), path, None);
    let layout = layout.map_err(|error| match left_out.clone() {
        Some(warning) => ReadError::AmongLeftOut { error: Box::new(error), warning: Box::new(warning) },
        None => error,
    })?;
    let memory = Memory::new(path, limits.size);
    memory.take((rows as u64).saturating_mul(layout.row_size() as u64));
    memory.check()?;
    let mut table = filled(&layout, &kept, Clock::new(unit));
    table.refuse_infinite(path)?;
    table.warnings.extend(left_out);
    Ok(table)
}

fn filled(layout: &Layout, kept: &[(&str, &Numbers)], clock: Clock) -> Table {
    let rows = kept.first().map_or(0, |(_, numbers)| numbers.len());
    let mut table = layout.table(rows, Places::WHOLE, clock);
    for ((_, numbers), target) in kept.iter().zip(&layout.targets) {
        match *target {
            Target::Known(TIME) => table.columns[TIME] = times(numbers, &mut table.clock),
            Target::Known(slot) => {
                let missing = |value: f64| infinite_is_missing(slot) && value.is_infinite();
                let values = numbers.doubles().into_iter();
                table.columns[slot] =
                    values.map(|value| if missing(value) { f64::NAN } else { value }).collect();
            }
            Target::Extra(extra) => table.extra[extra].values = numbers.texts(),
        }
    }
    table
}

/// Integers are exact: those since 1970 in nanoseconds are beyond a double.
fn times(numbers: &Numbers, clock: &mut Clock) -> Vec<f64> {
    match numbers {
        Numbers::Integers(numbers) => numbers.iter().map(|time| clock.take_integer(*time)).collect(),
        Numbers::Doubles(numbers) => numbers.iter().map(|time| clock.take_number(*time)).collect(),
    }
}

/// The names of a file's columns and their first numbers, of those that have as many rows as most.
pub(crate) fn beginning(path: &Path, rows: usize, limits: &Limits) -> Option<Vec<(String, Vec<f64>)>> {
    let columns = saved(path, limits).ok()?.columns;
    let usual = usual_length(&columns);
    let of = columns.into_iter().filter(|column| column.numbers.len() == usual);
    Some(of.map(|column| (column.name, column.numbers.every(0, 1, rows).doubles())).collect())
}

/// The length that most columns have, the longest of these. A single number is no column of samples where there are others.
fn usual_length(columns: &[Column]) -> usize {
    let mut counts: HashMap<usize, usize> = HashMap::new();
    let lengths = || columns.iter().map(|column| column.numbers.len());
    let several = lengths().any(|length| length > 1);
    lengths()
        .filter(|length| !several || *length > 1)
        .for_each(|length| *counts.entry(length).or_default() += 1);
    counts.into_iter().max_by_key(|(length, count)| (*count, *length)).map_or(0, |(length, _)| length)
}

fn saved(path: &Path, limits: &Limits) -> Result<Saved, ReadError> {
    let bytes = limits.read_large(path).map_err(|fault| ReadError::of(path, fault))?;
    let damaged = |Fault(found): Fault| ReadError::Damaged {
        path: path.to_path_buf(),
        found: found.to_owned(),
        expected: "an intact MAT-file",
    };
    let order = order_of(path, &bytes)?;
    let mut elements = Elements::new(order, &bytes[HEADER..]);
    let memory = Memory::new(path, limits.size);
    let mut variables = Vec::new();
    while let Some(element) = elements.next().map_err(damaged)? {
        let variable = match element.kind {
            MATRIX => Variable::of(element, order, &memory),
            COMPRESSED => inflated(element, limits.size, &memory)
                .and_then(|inflated| Variable::of(Elements::new(order, &inflated).expect()?, order, &memory)),
            _ => continue,
        };
        // Too much is refused before it is said to be damaged.
        memory.check()?;
        variables.push(variable.map_err(damaged)?);
    }
    let mut saved = Saved::default();
    // An array without a name is MATLAB's own.
    for variable in variables.into_iter().filter(|variable| !variable.name.is_empty()) {
        saved.take(variable, "");
    }
    if saved.columns.len() > limits.columns {
        let (path, limit) = (path.to_path_buf(), limits.columns);
        return Err(ReadError::TooManyColumns { path, line: None, limit });
    }
    saved.shorten_names();
    Ok(saved)
}

fn inflated(element: Element<'_>, limit: u64, memory: &Memory<'_>) -> Result<Vec<u8>, Fault> {
    let mut bytes = Vec::new();
    let whole = ZlibDecoder::new(element.data).take(limit.saturating_add(1)).read_to_end(&mut bytes);
    match (whole, memory.take(bytes.len() as u64)) {
        (Ok(_), true) => Ok(bytes),
        _ => Err(Fault("a compressed array that does not end as it should")),
    }
}

/// Refuses what only has the name of a MAT-file, or is of another level.
pub(crate) fn refuse_others(path: &Path) -> Result<(), ReadError> {
    let fault = |cause: io::Error| ReadError::of(path, cause.into());
    let mut beginning = Vec::new();
    let file = File::open(path).map_err(fault)?;
    file.take(HEADER as u64).read_to_end(&mut beginning).map_err(fault)?;
    order_of(path, &beginning).map(|_| ())
}

/// The order of a file's bytes, if it is of level 5.
fn order_of(path: &Path, bytes: &[u8]) -> Result<ByteOrder, ReadError> {
    let other = |found: &str, remedy| ReadError::OtherMatFile {
        path: path.to_path_buf(),
        found: found.to_owned(),
        remedy,
    };
    let save = "save it in MATLAB or Octave by `save -v7 FILE.mat`";
    match bytes.get(HEADER - 4..HEADER) {
        Some([_, 1, b'I', b'M']) => Ok(ByteOrder::Little),
        Some([1, _, b'M', b'I']) => Ok(ByteOrder::Big),
        Some([_, 2, b'I', b'M'] | [2, _, b'M', b'I']) => Err(other("level 7.3, which is HDF5", save)),
        _ if bytes.is_empty() => Err(ReadError::Empty { path: path.to_path_buf() }),
        _ if bytes.starts_with(b"# Created by Octave") => Err(other("Octave's text", save)),
        _ if bytes.starts_with(&[0x89]) => Err(other("HDF5", save)),
        _ if is_text(bytes) => Err(other(
            "text",
            "let its name end in .csv, or bring imu_tk's two files in by `imucal import ACC GYR --manifest NAME.toml`",
        )),
        _ => Err(other("another file or one of level 4", save)),
    }
}

/// Whether the beginning is what numbers and their names are written in.
fn is_text(bytes: &[u8]) -> bool {
    bytes.iter().take(HEADER).all(|byte| byte.is_ascii_graphic() || byte.is_ascii_whitespace())
}

impl Saved {
    /// Takes a variable, and those in it, with their names behind those of the structures that they are in.
    fn take(&mut self, variable: Variable, before: &str) {
        let name = format!("{before}{}", variable.name);
        match variable.content {
            Content::Structure(fields) => {
                let before = format!("{name}.");
                fields.into_iter().for_each(|field| self.take(field, &before));
            }
            Content::Other(what) => self.others.push(format!("`{name}` ({what})")),
            Content::Array(array) if array.columns > WIDEST => {
                self.others.push(format!("`{name}` ({} by {})", array.rows, array.columns));
            }
            Content::Array(array) => {
                let names = names_of_columns(&name, array.columns);
                let columns = names.into_iter().enumerate();
                self.columns.extend(columns.map(|(at, name)| Column { name, numbers: array.column(at) }));
            }
        }
    }

    /// A structure's name says nothing where its fields have names of their own.
    fn shorten_names(&mut self) {
        let mut counts: HashMap<String, usize> = HashMap::new();
        self.columns
            .iter()
            .for_each(|column| *counts.entry(short(&column.name).to_owned()).or_default() += 1);
        for column in &mut self.columns {
            if counts.get(short(&column.name)) == Some(&1) {
                column.name = short(&column.name).to_owned();
            }
        }
    }
}

/// A name without the structures that it is in.
fn short(name: &str) -> &str {
    name.rsplit_once('.').map_or(name, |(_, short)| short)
}

/// The names of an array's columns: those of a recording where it has a quantity of so many, or else with the axis behind them.
fn names_of_columns(name: &str, count: usize) -> Vec<String> {
    if let Some(known) = names_of(short(name)).filter(|known| known.len() == count && count > 1) {
        let before = &name[..name.len() - short(name).len()];
        return known.iter().map(|known| format!("{before}{known}")).collect();
    }
    match count {
        1 => vec![name.to_owned()],
        3 => ["x", "y", "z"].map(|axis| format!("{name}_{axis}")).to_vec(),
        4 => ["w", "x", "y", "z"].map(|axis| format!("{name}_{axis}")).to_vec(),
        count => (1..=count).map(|at| format!("{name}_{at}")).collect(),
    }
}

#[cfg(test)]
mod tests;

//! Reading samples as CSV, plain or gzipped.

use std::{ops::ControlFlow, path::Path};

use rayon::prelude::*;

use super::{
    clock::Clock,
    columns::{Layout, TIME, Table, Target, infinite_is_missing},
    csv_rows::Rows,
    number::{self, NotANumber},
};
use crate::{
    file::{Limits, limits::Size},
    recording::{
        mapping::Mapping,
        place::{Place, Places},
        read_error::ReadError,
        unit::TimeUnit,
        warning::Warning,
    },
};

/// Reads the samples of a CSV file in file units, `t` in `unit`.
pub(crate) fn read(
    path: &Path,
    unit: TimeUnit,
    mapping: &Mapping,
    limits: &Limits,
) -> Result<Table, ReadError> {
    let mut rows = Rows::open(path, limits)?;
    reader(path, unit, mapping, &mut rows, limits.size)
        .and_then(|reader| CsvReader { by_pieces: true, ..reader }.part(&mut rows, usize::MAX))
        .map_err(|error| explained(error, &mut rows))
}

/// As [`read`], but by parts of so many rows. The text may be of any length; the limit is that of one part.
pub(crate) fn read_parts(
    path: &Path,
    unit: TimeUnit,
    mapping: &Mapping,
    limits: &Limits,
    length: usize,
    take: &mut dyn FnMut(Table) -> Result<ControlFlow<()>, ReadError>,
) -> Result<(), ReadError> {
    let unlimited = Limits { size: u64::MAX, ..*limits };
    let mut rows = Rows::open(path, &unlimited)?;
    let mut reader =
        reader(path, unit, mapping, &mut rows, limits.size).map_err(|error| explained(error, &mut rows))?;
    loop {
        let table = reader.part(&mut rows, length).map_err(|error| explained(error, &mut rows))?;
        let last = reader.ended;
        if take(table)?.is_break() || last {
            return Ok(());
        }
    }
}

/// Of a damaged stream nothing that is wrong in its text says more.
fn explained(error: ReadError, rows: &mut Rows<'_>) -> ReadError {
    let damage = if error.is_limit() { None } else { rows.text.damage() };
    damage.unwrap_or(error)
}

/// A reader that has read the header.
fn reader<'a>(
    path: &'a Path,
    unit: TimeUnit,
    mapping: &Mapping,
    rows: &mut Rows<'_>,
    limit: u64,
) -> Result<CsvReader<'a>, ReadError> {
    rows.skip_comments()?;
    if !mapping.is_empty() {
        rows.find_separator()?;
    }
    let blank = |rows: &Rows<'_>| rows.fields().all(|field| field.trim_ascii().is_empty()) && rows.len() == 1;
    if !rows.advance()? || (blank(rows) && !rows.advance()?) {
        return Err(ReadError::Empty { path: path.to_path_buf() });
    }
    let names: Result<Vec<&str>, _> = rows.fields().map(std::str::from_utf8).collect();
    let names = names.map_err(|_| ReadError::NotUtf8 { path: path.to_path_buf(), line: rows.line })?;
    let line = Some(rows.line);
    let fault = |fault| ReadError::Mapping { path: path.to_path_buf(), line, fault };
    let renamed = mapping.renamed(&names).map_err(fault)?;
    let layout = Layout::new(&renamed.iter().map(String::as_str).collect::<Vec<_>>(), path, line)?;
    let names: Vec<String> = names.iter().map(|name| name.trim().to_owned()).collect();
    Ok(CsvReader {
        path,
        clock: Clock::new(unit),
        layout,
        names,
        limit,
        taken: 0,
        rows: 0,
        ended: false,
        by_pieces: false,
    })
}

struct CsvReader<'a> {
    path: &'a Path,
    clock: Clock,
    layout: Layout,
    names: Vec<String>,
    /// Bytes that the samples of a part may take in memory, and those they take.
    limit: u64,
    taken: u64,
    /// Rows of the parts before.
    rows: usize,
    /// The text has no more rows.
    ended: bool,
    /// Lines are read by several cores: of a whole recording, since parts leave the other cores to who takes them, and up to a line that is
    /// not numbers alone, since the next ones may be like it.
    by_pieces: bool,
}

/// What is wrong with a field, before the place is known.
struct BadField {
    column: usize,
    problem: NotANumber,
}

impl CsvReader<'_> {
    /// The next rows, so many at the most.
    fn part(&mut self, rows: &mut Rows<'_>, length: usize) -> Result<Table, ReadError> {
        // A guess that is a little high; it spares the growing columns their copies.
        let row = (self.layout.row_size() + size_of::<u64>()) as u64;
        let guess =
            (rows.text.expected / (self.names.len() * 7).max(1) as u64).min(self.limit / row) as usize;
        let mut table = self.layout.table(guess.min(length), Places::Lines(Vec::new()), self.clock.clone());
        let mut lines = Vec::with_capacity(guess.min(length));
        self.taken = 0;
        let mut values = vec![0.0; self.names.len()];
        while lines.len() < length {
            if self.push_pieces(rows, &mut table, &mut lines)? {
                continue;
            }
            if self.push_numbers(rows, &mut values, &mut table)? {
                lines.push(rows.line);
                self.take(rows)?;
                continue;
            }
            if !rows.advance()? {
                self.ended = true;
                break;
            }
            let last = rows.cut;
            if last && self.drop_cut_line(rows, &mut table) {
                self.ended = true;
                break;
            }
            if rows.len() != self.names.len() {
                return Err(self.field_count(rows));
            }
            self.check_text(rows)?;
            self.push(rows, &mut table).map_err(|bad| self.bad_field(rows, &bad))?;
            lines.push(rows.line);
            self.take(rows)?;
        }
        if self.rows == 0 && rows.comments > 0 {
            let path = self.path.to_path_buf();
            table.warnings.push(Warning::Comments { path, lines: rows.comments });
        }
        self.rows += lines.len();
        if self.ended && rows.text.truncated {
            table.warnings.push(Warning::TruncatedStream { path: self.path.to_path_buf(), rows: self.rows });
        }
        table.places = Places::Lines(lines);
        self.clock.clone_from(&table.clock);
        Ok(table)
    }

    /// Unknown columns are kept as text.
    fn has_texts(&self) -> bool {
        !self.layout.extra.is_empty()
    }

    /// Takes the next lines on several cores, where they are many, are numbers, and their times are what the file counts; false, and nothing
    /// is read, where they are not.
    fn push_pieces(
        &mut self,
        rows: &mut Rows<'_>,
        table: &mut Table,
        lines: &mut Vec<u64>,
    ) -> Result<bool, ReadError> {
        if !self.by_pieces || self.has_texts() || !table.clock.is_plain() {
            return Ok(false);
        }
        let Some(pieces) = rows.pieces(self.names.len())? else { return Ok(false) };
        for piece in pieces {
            lines.extend_from_slice(&piece.lines);
            self.by_pieces = !piece.stopped;
            self.take_rows(piece.lines.len(), 0)?;
        }
        let targets = &self.layout.targets;
        table.columns.par_iter_mut().enumerate().for_each(|(slot, column)| {
            if let Some(of_file) = targets.iter().position(|target| *target == Target::Known(slot)) {
                pieces.iter().for_each(|piece| column.extend_from_slice(&piece.columns[of_file]));
            }
        });
        Ok(true)
    }

    /// Takes the next line where it consists of numbers; false, and nothing is read, where it does not.
    fn push_numbers(
        &self,
        rows: &mut Rows<'_>,
        values: &mut [f64],
        table: &mut Table,
    ) -> Result<bool, ReadError> {
        if self.has_texts() || table.clock.is_dated() {
            return Ok(false);
        }
        let Some(line) = rows.numbers(values)? else { return Ok(false) };
        for (column, (value, target)) in values.iter().zip(&self.layout.targets).enumerate() {
            match *target {
                Target::Known(TIME) => {
                    let time = table.clock.take_parsed(*value, line.field(column));
                    table.columns[TIME].push(time);
                }
                Target::Known(slot) => table.columns[slot].push(*value),
                Target::Extra(_) => {}
            }
        }
        Ok(true)
    }

    /// Counts what a row takes in memory, its line included.
    fn take(&mut self, rows: &Rows<'_>) -> Result<(), ReadError> {
        let text = |(field, target): (&[u8], &Target)| match target {
            Target::Extra(_) => field.len(),
            Target::Known(_) => 0,
        };
        let texts =
            if self.has_texts() { rows.fields().zip(&self.layout.targets).map(text).sum() } else { 0 };
        self.take_rows(1, texts)
    }

    /// So many rows, and bytes of text.
    fn take_rows(&mut self, rows: usize, texts: usize) -> Result<(), ReadError> {
        self.taken += (rows * (self.layout.row_size() + size_of::<u64>()) + texts) as u64;
        if self.taken > self.limit {
            let path = self.path.to_path_buf();
            return Err(ReadError::TooManySamples { path, limit: Size(self.limit) });
        }
        Ok(())
    }

    fn push(&self, rows: &Rows<'_>, table: &mut Table) -> Result<(), BadField> {
        for (column, (field, target)) in rows.fields().zip(&self.layout.targets).enumerate() {
            match *target {
                Target::Known(slot) => {
                    let pointed = rows.pointed(field);
                    let field = pointed.as_deref().unwrap_or(field);
                    let value = match slot {
                        TIME => table.clock.take_text(field),
                        _ => number::parse(field),
                    };
                    let value = match value {
                        Err(NotANumber::Infinite) if infinite_is_missing(slot) => f64::NAN,
                        value => value.map_err(|problem| BadField { column, problem })?,
                    };
                    table.columns[slot].push(value);
                }
                Target::Extra(extra) => {
                    table.extra[extra].values.push(String::from_utf8_lossy(field).into_owned());
                }
            }
        }
        Ok(())
    }

    /// Unknown columns are kept as they are, so they have to be text.
    fn check_text(&self, rows: &Rows<'_>) -> Result<(), ReadError> {
        let foreign = |(field, target): (&[u8], &Target)| {
            matches!(target, Target::Extra(_)) && std::str::from_utf8(field).is_err()
        };
        match self.has_texts() && rows.fields().zip(&self.layout.targets).any(foreign) {
            true => Err(ReadError::NotUtf8 { path: self.path.to_path_buf(), line: rows.line }),
            false => Ok(()),
        }
    }

    /// Notes what became of a cut line; true if it is to be dropped.
    fn drop_cut_line(&self, rows: &Rows<'_>, table: &mut Table) -> bool {
        let last = rows.len().saturating_sub(1);
        let field = rows.field(last);
        let whole = rows.len() == self.names.len() && self.is_whole(last, field);
        let truncated = rows.text.truncated;
        let path = self.path.to_path_buf();
        let place = Place::Line(rows.line);
        if rows.len() > self.names.len() {
            return false;
        }
        table.warnings.push(if whole && !truncated {
            let found = String::from_utf8_lossy(field).into_owned();
            Warning::UnterminatedLine { path, place, column: self.names[last].clone(), found }
        } else {
            Warning::TruncatedLine { path, place, found: last, expected: self.names.len() }
        });
        !whole || truncated
    }

    fn is_whole(&self, column: usize, field: &[u8]) -> bool {
        match self.layout.targets.get(column) {
            Some(Target::Known(_)) => number::parse(field).is_ok_and(|value| !value.is_nan()),
            _ => true,
        }
    }

    fn field_count(&self, rows: &Rows<'_>) -> ReadError {
        ReadError::FieldCount {
            path: self.path.to_path_buf(),
            place: Place::Line(rows.line),
            found: rows.len(),
            expected: self.names.len(),
        }
    }

    fn bad_field(&self, rows: &Rows<'_>, bad: &BadField) -> ReadError {
        let path = self.path.to_path_buf();
        let place = Place::Line(rows.line);
        let column = self.names[bad.column].clone();
        let text = String::from_utf8_lossy(rows.field(bad.column));
        let found: String = text.chars().take(40).collect();
        let is_time = self.layout.targets.get(bad.column) == Some(&Target::Known(TIME));
        match bad.problem {
            NotANumber::Unparsable if is_time => ReadError::NotATime { path, place, column, found },
            NotANumber::Unparsable => ReadError::NotANumber { path, place, column, found },
            NotANumber::Infinite => ReadError::Infinite { path, place, column, found },
        }
    }
}

#[cfg(test)]
mod tests;

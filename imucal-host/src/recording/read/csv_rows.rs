//! The rows of a CSV text, one at a time, none longer than the limits allow.

use std::path::Path;

use csv_core::{ReadRecordResult, Reader, ReaderBuilder};
use memchr::{memchr_iter, memchr3};

use super::{
    csv_pieces::{Format, Piece},
    date, number,
    text::Text,
};
use crate::{
    file::{Limits, limits::Size},
    recording::read_error::ReadError,
};

/// A time and three axes have so many.
const LEAST_SEPARATORS: usize = 3;
/// Room for a row at first; it grows up to the limits.
const ROOM: usize = 1 << 10;

/// Rows, and the last of them that was read.
pub(crate) struct Rows<'a> {
    path: &'a Path,
    pub(crate) text: Text<'a>,
    limits: &'a Limits,
    reader: Reader,
    bytes: Vec<u8>,
    ends: Vec<usize>,
    fields: usize,
    /// Bytes between one field and the next.
    between: usize,
    /// Line of the next byte, from 1.
    next_line: u64,
    /// Line of the row, from 1.
    pub(crate) line: u64,
    /// Lines of comments before the header.
    pub(crate) comments: u64,
    /// The text ended within the row: its line has no end.
    pub(crate) cut: bool,
    separator: u8,
    pieces: Vec<Piece>,
}

impl<'a> Rows<'a> {
    pub(crate) fn open(path: &'a Path, limits: &'a Limits) -> Result<Self, ReadError> {
        Ok(Self {
            path,
            text: Text::open(path, limits)?,
            limits,
            reader: Reader::new(),
            bytes: vec![0; ROOM.min(limits.line())],
            ends: vec![0; ROOM.min(limits.columns)],
            fields: 0,
            between: 0,
            next_line: 1,
            line: 1,
            comments: 0,
            cut: false,
            separator: b',',
            pieces: Vec::new(),
        })
    }

    /// Passes over lines of comments before the header. A header may begin as they do, as `#timestamp [ns],…`; of one as
    /// `# t ax ay az` the mark is none of the first name.
    pub(crate) fn skip_comments(&mut self) -> Result<(), ReadError> {
        loop {
            self.skip_blank_lines()?;
            let input = self.text.next()?;
            let mut lines = input.split_inclusive(|byte| *byte == b'\n');
            let Some((first, next)) = lines.next().zip(lines.next()) else { return Ok(()) };
            if !matches!(first[0], b'#' | b'%') {
                return Ok(());
            }
            if is_header(first, next) {
                let mark = if first.get(1) == Some(&b' ') { 2 } else { 0 };
                self.text.consume(mark);
                return Ok(());
            }
            let length = first.len();
            self.text.consume(length);
            (self.next_line, self.comments) = (self.next_line + 1, self.comments + 1);
        }
    }

    /// Takes semicolons, tabs, bars or blanks for what separates fields, where the first line has no comma; before the first row.
    pub(crate) fn find_separator(&mut self) -> Result<(), ReadError> {
        self.skip_blank_lines()?;
        let input = self.text.next()?;
        let line = input.split(|byte| *byte == b'\n').next().unwrap_or_default();
        let found = [b',', b';', b'\t', b'|', b' '].into_iter().find(|separator| line.contains(separator));
        self.separator = found.unwrap_or(b',');
        self.reader = ReaderBuilder::new().delimiter(self.separator).build();
        Ok(())
    }

    /// A field whose decimal point is a comma, with a point; `None` where there is nothing to change.
    pub(crate) fn pointed(&self, field: &[u8]) -> Option<Vec<u8>> {
        let comma = self.separator != b',' && field.contains(&b',') && !field.contains(&b'.');
        comma.then(|| field.iter().map(|byte| if *byte == b',' { b'.' } else { *byte }).collect())
    }

    /// Reads the next row that is not blank; false at the end of the text.
    pub(crate) fn advance(&mut self) -> Result<bool, ReadError> {
        self.skip_blank_lines()?;
        self.line = self.next_line;
        if self.split_line()? {
            return Ok(true);
        }
        self.between = 0;
        let (mut length, mut fields) = (0, 0);
        loop {
            let input = self.text.next()?;
            let at_end = input.is_empty();
            let (result, read, written, ended) =
                self.reader.read_record(input, &mut self.bytes[length..], &mut self.ends[fields..]);
            self.next_line += count_lines(&input[..read]);
            self.text.consume(read);
            (length, fields) = (length + written, fields + ended);
            match result {
                ReadRecordResult::InputEmpty => {}
                ReadRecordResult::OutputFull => self.make_room()?,
                ReadRecordResult::OutputEndsFull => self.make_room_for_fields()?,
                ReadRecordResult::End => return Ok(false),
                ReadRecordResult::Record => {
                    self.fields = fields;
                    // A stray quote swallows lines; that is no cut.
                    self.cut = at_end && !self.text.ends_line() && !self.bytes[..length].contains(&b'\n');
                    return Ok(true);
                }
            }
        }
    }

    /// Reads the next line if it consists of numbers between separators, one for each of `values`. `None`, and nothing is read, where
    /// it is anything else. Such a line needs no splitting: most numbers are parsed as they are passed over.
    pub(crate) fn numbers(&mut self, values: &mut [f64]) -> Result<Option<Numbers<'_>>, ReadError> {
        self.skip_blank_lines()?;
        let format = self.format(values.len());
        let input = self.text.next()?;
        let Some(ends) = self.ends.get_mut(..values.len()) else { return Ok(None) };
        let Some(at) = format.line(input, values, ends) else { return Ok(None) };
        (self.line, self.cut) = (self.next_line, false);
        self.next_line += u64::from(input[at - 1] == b'\n');
        self.text.consume(at);
        Ok(Some(Numbers { line: self.text.consumed(at), ends: &self.ends }))
    }

    /// Reads lines that consist of so many numbers each, on several cores, as far as they are at hand: pieces of the text,
    /// with the lines of the file. `None`, and nothing is read, where they are few.
    pub(crate) fn pieces(&mut self, columns: usize) -> Result<Option<&[Piece]>, ReadError> {
        let format = self.format(columns);
        if !format.read(self.text.next()?, &mut self.pieces) {
            return Ok(None);
        }
        for piece in &mut self.pieces {
            piece.lines.iter_mut().for_each(|line| *line += self.next_line);
            self.next_line += piece.ends;
            (self.line, self.cut) = (piece.lines.last().copied().unwrap_or(self.line), false);
            self.text.consume(piece.length);
        }
        Ok(Some(&self.pieces))
    }

    fn format(&self, columns: usize) -> Format {
        Format { separator: self.separator, columns, longest: self.limits.line() }
    }

    /// Splits the next line at its separators, which is what the parser makes of it, some times as fast. False, and nothing is
    /// read, where the line has quotes, is not whole in what was read so far, or has no room.
    fn split_line(&mut self) -> Result<bool, ReadError> {
        let input = self.text.next()?;
        let Some(end) = memchr3(b'\n', b'\r', b'"', input).filter(|end| input[*end] != b'"') else {
            return Ok(false);
        };
        let Some(line) = self.bytes.get_mut(..end) else { return Ok(false) };
        line.copy_from_slice(&input[..end]);
        let mut fields = 0;
        for at in memchr_iter(self.separator, line).chain([end]) {
            let Some(field) = self.ends.get_mut(fields) else { return Ok(false) };
            *field = at;
            fields += 1;
        }
        self.next_line += u64::from(input[end] == b'\n');
        self.text.consume(end + 1);
        (self.fields, self.between, self.cut) = (fields, 1, false);
        Ok(true)
    }

    /// Number of fields of the row.
    pub(crate) fn len(&self) -> usize {
        self.fields
    }

    /// A field of the row, without its quotes; nothing beyond the last.
    pub(crate) fn field(&self, index: usize) -> &[u8] {
        let start = index.checked_sub(1).map_or(0, |before| self.ends[before] + self.between);
        if index < self.fields { &self.bytes[start..self.ends[index]] } else { &[] }
    }

    /// The fields of the row in their order.
    pub(crate) fn fields(&self) -> impl Iterator<Item = &[u8]> {
        let mut start = 0;
        self.ends[..self.fields].iter().map(move |end| {
            let field = &self.bytes[start..*end];
            start = end + self.between;
            field
        })
    }

    /// The parser skips them too, but does not say how many there were.
    fn skip_blank_lines(&mut self) -> Result<(), ReadError> {
        loop {
            let input = self.text.next()?;
            let blank = input.iter().take_while(|byte| matches!(byte, b'\n' | b'\r')).count();
            if blank == 0 {
                return Ok(());
            }
            self.next_line += count_lines(&input[..blank]);
            self.text.consume(blank);
        }
    }

    fn make_room(&mut self) -> Result<(), ReadError> {
        let limit = self.limits.line();
        if self.bytes.len() >= limit {
            let path = self.path.to_path_buf();
            return Err(ReadError::LineTooLong { path, line: self.line, limit: Size(limit as u64) });
        }
        self.bytes.resize((2 * self.bytes.len()).min(limit), 0);
        Ok(())
    }

    fn make_room_for_fields(&mut self) -> Result<(), ReadError> {
        let limit = self.limits.columns;
        if self.ends.len() >= limit {
            return Err(ReadError::TooManyColumns {
                path: self.path.to_path_buf(),
                line: Some(self.line),
                limit,
            });
        }
        self.ends.resize((2 * self.ends.len()).min(limit), 0);
        Ok(())
    }
}

/// A line of numbers.
pub(crate) struct Numbers<'a> {
    line: &'a [u8],
    ends: &'a [usize],
}

impl Numbers<'_> {
    /// The text of one.
    pub(crate) fn field(&self, index: usize) -> &[u8] {
        &self.line[index.checked_sub(1).map_or(0, |before| self.ends[before] + 1)..self.ends[index]]
    }
}

/// Whether a line that begins as a comment is the header of the next: samples follow it, or as many fields.
fn is_header(line: &[u8], next: &[u8]) -> bool {
    let separates = |byte: &u8| matches!(byte, b',' | b';' | b'\t' | b'|');
    let is_value = |field: &[u8]| {
        number::parse(field).is_ok_and(|value| !value.is_nan()) || date::parse(field).is_some()
    };
    // Blanks may separate fields, or be in a date.
    let first = next.split(separates).next().unwrap_or_default();
    let is_sample = is_value(first) || first.split(|byte| *byte == b' ').next().is_some_and(is_value);
    let [separators, others] = [line, next].map(|line| line.iter().filter(|byte| separates(byte)).count());
    is_sample || (separators == others && separators >= LEAST_SEPARATORS)
}

fn count_lines(bytes: &[u8]) -> u64 {
    bytes.iter().filter(|byte| **byte == b'\n').count() as u64
}

#[cfg(test)]
mod tests;

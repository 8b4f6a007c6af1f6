//! The rows of a CSV text, one at a time, none longer than the limits allow.

use std::path::Path;

use csv_core::{ReadRecordResult, Reader, ReaderBuilder};
use memchr::{memchr_iter, memchr3};

use super::{date, number, text::Text};
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

    /// Takes semicolons, tabs or blanks for what separates fields, where the first line has no comma; before the first row.
    pub(crate) fn find_separator(&mut self) -> Result<(), ReadError> {
        self.skip_blank_lines()?;
        let input = self.text.next()?;
        let line = input.split(|byte| *byte == b'\n').next().unwrap_or_default();
        let found = [b',', b';', b'\t', b' '].into_iter().find(|separator| line.contains(separator));
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
        let count = values.len();
        let (separator, input) = (self.separator, self.text.next()?);
        let Some(ends) = self.ends.get_mut(..count) else { return Ok(None) };
        let mut at = 0;
        for (k, (value, end)) in values.iter_mut().zip(ends).enumerate() {
            let is_end = |byte: Option<&u8>| match byte {
                Some(b'\n' | b'\r') => k + 1 == count,
                other => other == Some(&separator) && k + 1 < count,
            };
            let rest = &input[at..];
            let whole = number::leading(rest).filter(|(_, length)| is_end(rest.get(*length)));
            let other = || {
                let length = memchr3(separator, b'\n', b'\r', rest).filter(|end| is_end(rest.get(*end)))?;
                Some((number::parse(&rest[..length]).ok()?, length))
            };
            let Some((found, length)) = whole.or_else(other) else { return Ok(None) };
            (*value, *end) = (found, at + length);
            at += length + 1;
        }
        if at > self.limits.line() {
            return Ok(None);
        }
        (self.line, self.cut) = (self.next_line, false);
        self.next_line += u64::from(input[at - 1] == b'\n');
        self.text.consume(at);
        Ok(Some(Numbers { line: self.text.consumed(at), ends: &self.ends }))
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
    let separates = |byte: &u8| matches!(byte, b',' | b';' | b'\t');
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
mod tests {
    use proptest::prelude::*;

    use super::{
        super::{number, text::tests::packed},
        Rows,
    };
    use crate::{
        file::Limits,
        recording::{
            Recording,
            fixture::{Fixture, assert_says, csv},
        },
    };

    const SMALL: Limits = Limits { size: 1 << 14, columns: 10 };

    /// A row by its line and its fields, read as a recording's are.
    type Row = (u64, Vec<Option<u64>>);

    fn bits(field: &[u8]) -> Option<u64> {
        number::parse(field).ok().map(f64::to_bits)
    }

    fn rows_of(text: &[u8], columns: usize) -> Vec<Row> {
        let fixture = csv(text);
        let mut rows = Rows::open(&fixture.path, &SMALL).unwrap();
        let (mut read, mut values) = (Vec::new(), vec![0.0; columns]);
        loop {
            let of_numbers = rows
                .numbers(&mut values)
                .unwrap()
                .map(|line| (0..columns).map(|k| bits(line.field(k))).collect::<Vec<_>>());
            if let Some(fields) = of_numbers {
                assert_eq!(fields, values.iter().map(|value| Some(value.to_bits())).collect::<Vec<_>>());
                read.push((rows.line, fields));
            } else if rows.advance().unwrap() {
                read.push((rows.line, rows.fields().map(bits).collect()));
            } else {
                return read;
            }
        }
    }

    /// The same by the parser alone, whose lines end with a line feed or a carriage return.
    fn rows_of_parser(text: &[u8]) -> Vec<Row> {
        let mut reader = ::csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(text);
        let row = |record: ::csv::ByteRecord| {
            let start = record.position().map_or(0, |position| position.byte() as usize);
            let skipped = text[start..].iter().take_while(|byte| matches!(byte, b'\n' | b'\r')).count();
            let line = 1 + super::count_lines(&text[..start + skipped]);
            (line, record.iter().map(bits).collect())
        };
        reader.byte_records().map(|record| row(record.unwrap())).collect()
    }

    proptest! {
        #[test]
        fn rows_and_their_lines_are_those_of_the_parser(
            lines in prop::collection::vec("([0-9]{1,2}(\\.[0-9]{1,18})?,){2}-?[0-9]{1,3}(e-?[0-9])?|[0-9.,\" e-]{0,12}", 0..12),
            ends in prop::collection::vec(prop::sample::select(vec!["\n", "\r\n", "\r", "\n\n"]), 12),
        ) {
            let text: String = lines.iter().zip(&ends).flat_map(|(line, end)| [line.as_str(), end]).collect();
            // More fields than the limit are refused.
            prop_assume!(lines.iter().all(|line| line.matches(',').count() < 9));
            prop_assert_eq!(rows_of(text.as_bytes(), 3), rows_of_parser(text.as_bytes()));
        }
    }

    fn error(fixture: &Fixture) -> String {
        Recording::read_within(&fixture.path, &SMALL).unwrap_err().to_string()
    }

    #[test]
    fn comments_before_the_header_are_passed_over_with_a_warning_and_lines_still_counted() {
        let samples = "0,0,0,9.8\n1,0,0,9.8\n";
        let commented =
            csv(format!("# made by a logger\n#\n\n% 100 Hz, raw\nt,acc_x,acc_y,acc_z\n{samples}"));
        assert_eq!(commented.read().rows(), 2);
        assert_says(
            &commented.warnings().join("\n"),
            &["run.csv: comments before the header were passed over", "# or %: 3"],
        );
        let bad = csv(format!("# made by a logger\nt,acc_x,acc_y,acc_z\n{samples}2,0,x,9.8\n"));
        assert_says(&bad.error(), &["line 5"]);
        // What NumPy writes; then a header that begins as a comment, and a comment behind the header.
        let marked = csv(format!("# run 7\n# t,acc_x,acc_y,acc_z\n{samples}"));
        assert_eq!(marked.read().rows(), 2);
        assert_says(&marked.warnings().join("\n"), &["# or %: 1)"]);
        assert_says(&csv(format!("#t,acc_x,acc_y,acc_z\n{samples}")).error(), &["line 1", "#t"]);
        assert_says(&csv(format!("t,acc_x,acc_y,acc_z\n# late\n{samples}")).error(), &["line 2"]);
        // What is said of the header names its own line.
        let odd = csv("# run 7\n\nt,acc_x,acc_y,acc_z,lamp\n0,0,0,9.8,1\n");
        assert_says(&odd.warnings().join("\n"), &["run.csv, line 3, column `lamp`"]);
        assert_says(&csv(format!("# run 7\nt,acc_x,acc_y\n{samples}")).error(), &["line 2: "]);
    }

    #[test]
    fn a_line_that_does_not_end_is_refused_at_its_limit() {
        for text in ["0".repeat(700), format!("t,temp\n\n0,{}\n", "0".repeat(700))] {
            assert_says(
                &error(&csv(&text)),
                &["longer than 640 bytes", "raise the limit with --max-columns"],
            );
        }
        assert_says(&error(&csv(format!("t\n\n{}", "0".repeat(700)))), &["run.csv, line 3"]);
    }

    #[test]
    fn more_columns_than_allowed_are_refused() {
        let message = error(&csv(",".repeat(10)));
        assert_says(&message, &["run.csv, line 1", "more than 10 columns", "--max-columns"]);
        let known = "t,acc_x,acc_y,acc_z,a,b,c,d,e,f\n0,0,0,9.8,,,,,,\n";
        assert_eq!(Recording::read_within(&csv(known).path, &SMALL).unwrap().extra.len(), 6);
    }

    #[test]
    fn a_text_beyond_its_limit_is_refused_also_when_compressed() {
        let text = "\n".repeat(1 << 15);
        let found = ["more than 16 KiB", "raise the limit with --max-size"];
        assert_says(&error(&csv(&text)), &found);
        assert_says(&error(&Fixture::new("run.csv.gz", "", packed(&text))), &found);
    }

    #[test]
    fn samples_are_counted_by_the_memory_that_they_take() {
        // 5 bytes of text a row, and 40 bytes of numbers and line.
        let rows: String = (0..1000).map(|row| format!("{}{:02},,,\n", row / 100, row % 100)).collect();
        let text = format!("t,acc_x,acc_y,acc_z\n{rows}");
        assert!(text.len() < 1 << 14);
        assert_says(&error(&csv(&text)), &["samples", "more than 16 KiB", "--max-size"]);
        let half = &text[..text.len() / 3];
        assert!(Recording::read_within(&csv(half).path, &SMALL).is_ok());
        // An empty text has no character, and takes memory all the same.
        let extra: String = (0..200).map(|row| format!("{row},,,\n")).collect();
        assert_says(&error(&csv(format!("t,a,b,c\n{extra}"))), &["samples", "more than 16 KiB"]);
    }
}

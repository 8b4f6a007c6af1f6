//! Writing samples as CSV.

use std::{io, ops::Range};

use rayon::prelude::*;

use crate::recording::read::{
    columns::{KNOWN, NAMES, TIME, Table},
    number,
};

/// Rows that one core prints at a time, and parts of so many rows whose text is held.
const PART: usize = 4096;
/// See [`PART`].
const PARTS: usize = 16;
/// Bytes of a row, so that its text rarely grows.
const ROW: usize = 100;

/// Samples as CSV: the columns in the contract's order, unknown ones last.
pub(crate) struct CsvWriter<W> {
    out: W,
    columns: Columns,
}

/// The known columns that there are, and those of them whose numbers are those of an `f32`.
struct Columns {
    present: Vec<usize>,
    singles: [bool; KNOWN],
}

impl<W: io::Write> CsvWriter<W> {
    /// Starts with the header of a table; `singles` are columns whose numbers are those of an `f32`.
    pub(crate) fn begin(mut out: W, table: &Table, singles: [bool; KNOWN]) -> io::Result<Self> {
        let present: Vec<usize> = (0..KNOWN).filter(|slot| !table.columns[*slot].is_empty()).collect();
        let mut lines = Lines::default();
        present.iter().for_each(|slot| lines.push_text(NAMES[*slot]));
        table.extra.iter().for_each(|column| lines.push_text(&column.name));
        lines.end_row();
        out.write_all(&lines.text)?;
        Ok(Self { out, columns: Columns { present, singles } })
    }

    /// Appends the rows of a table that has the columns of the first.
    pub(crate) fn append(&mut self, table: &Table, rows: usize) -> io::Result<()> {
        for from in (0..rows).step_by(PART * PARTS) {
            let until = rows.min(from + PART * PARTS);
            let parts: Vec<usize> = (from..until).step_by(PART).collect();
            let part = |start: &usize| self.columns.lines(table, *start..until.min(start + PART));
            let texts: Vec<Vec<u8>> = parts.par_iter().map(part).collect();
            texts.iter().try_for_each(|text| self.out.write_all(text))?;
        }
        Ok(())
    }

    /// Gives back what was written to.
    pub(crate) fn finish(self) -> W {
        self.out
    }
}

impl Columns {
    fn lines(&self, table: &Table, rows: Range<usize>) -> Vec<u8> {
        let mut lines = Lines { text: Vec::with_capacity(ROW * rows.len()), ..Lines::default() };
        for row in rows {
            self.present.iter().for_each(|slot| self.push_number(&mut lines, table, *slot, row));
            table.extra.iter().for_each(|column| lines.push_text(&column.values[row]));
            lines.end_row();
        }
        lines.text
    }

    fn push_number(&self, lines: &mut Lines, table: &Table, slot: usize, row: usize) {
        let value = table.columns[slot][row];
        match slot {
            TIME if table.clock.epoch.is_some() => {
                lines.text.extend_from_slice(table.clock.text(value).as_bytes());
            }
            _ if self.singles[slot] => number::print_single(value as f32, &mut lines.text),
            _ => number::print(value, &mut lines.text),
        }
        lines.text.push(b',');
    }
}

/// Lines of text, each field with a comma after it until its row ends.
#[derive(Default)]
struct Lines {
    text: Vec<u8>,
    quotes: csv_core::Writer,
}

impl Lines {
    /// A field in quotes where it needs them.
    fn push_text(&mut self, field: &str) {
        let start = self.text.len();
        // Each byte doubled, two quotes and a comma.
        self.text.resize(start + 2 * field.len() + 3, 0);
        let (_, _, length) = self.quotes.field(field.as_bytes(), &mut self.text[start..]);
        let (_, comma) = self.quotes.delimiter(&mut self.text[start + length..]);
        self.text.truncate(start + length + comma);
    }

    /// The comma after the last field ends the row.
    fn end_row(&mut self) {
        if let Some(last) = self.text.last_mut() {
            *last = b'\n';
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{
        place::Places,
        read::{clock::Clock, columns::SEGMENT},
        unit::TimeUnit,
    };

    #[test]
    fn rows_stay_in_order_however_many_parts_they_are_printed_in() {
        for rows in [1, PART, PART * PARTS + 5] {
            let mut columns = vec![Vec::new(); KNOWN];
            columns[TIME] = (0..rows).map(|row| row as f64 / 8.0).collect();
            columns[SEGMENT] = (0..rows).map(|row| row as f64).collect();
            let (clock, places) = (Clock::new(TimeUnit::Second), Places::WHOLE);
            let table =
                Table { columns, extra: Vec::new(), header: None, places, clock, warnings: Vec::new() };
            let mut writer = CsvWriter::begin(Vec::new(), &table, [false; KNOWN]).unwrap();
            writer.append(&table, rows).unwrap();
            let text = String::from_utf8(writer.finish()).unwrap();
            let lines: Vec<&str> = text.lines().collect();
            assert_eq!((lines[0], lines.len()), ("t,segment", rows + 1));
            for (row, line) in lines[1..].iter().enumerate() {
                assert_eq!(*line, format!("{},{row}", row as f64 / 8.0));
            }
        }
    }
}

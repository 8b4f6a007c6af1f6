//! Writing samples as CSV.

use std::io;

use crate::recording::read::{
    columns::{KNOWN, NAMES, TIME, Table},
    number,
};

/// Bytes that are written at once.
const CHUNK: usize = 1 << 16;

/// Samples as CSV: the columns in the contract's order, unknown ones last.
pub(crate) struct CsvWriter<W> {
    out: W,
    /// What is not written yet.
    text: Vec<u8>,
    quotes: csv_core::Writer,
    present: Vec<usize>,
    singles: [bool; KNOWN],
}

impl<W: io::Write> CsvWriter<W> {
    /// Starts with the header of a table; `singles` are columns whose numbers are those of an `f32`.
    pub(crate) fn begin(out: W, table: &Table, singles: [bool; KNOWN]) -> Self {
        let present: Vec<usize> = (0..KNOWN).filter(|slot| !table.columns[*slot].is_empty()).collect();
        let mut writer = Self { out, text: Vec::new(), quotes: csv_core::Writer::new(), present, singles };
        for at in 0..writer.present.len() {
            writer.push_text(NAMES[writer.present[at]]);
        }
        table.extra.iter().for_each(|column| writer.push_text(&column.name));
        writer.end_row();
        writer
    }

    /// Appends the rows of a table that has the columns of the first.
    pub(crate) fn append(&mut self, table: &Table, rows: usize) -> io::Result<()> {
        for row in 0..rows {
            for at in 0..self.present.len() {
                self.push_number(table, self.present[at], row);
            }
            table.extra.iter().for_each(|column| self.push_text(&column.values[row]));
            self.end_row();
            if self.text.len() >= CHUNK {
                self.write_text()?;
            }
        }
        Ok(())
    }

    /// Writes what is left, and gives back what was written to.
    pub(crate) fn finish(mut self) -> io::Result<W> {
        self.write_text()?;
        Ok(self.out)
    }

    fn write_text(&mut self) -> io::Result<()> {
        self.out.write_all(&self.text)?;
        self.text.clear();
        Ok(())
    }

    fn push_number(&mut self, table: &Table, slot: usize, row: usize) {
        let value = table.columns[slot][row];
        match slot {
            TIME if table.clock.epoch.is_some() => {
                self.text.extend_from_slice(table.clock.text(value).as_bytes());
            }
            _ if self.singles[slot] => number::print_single(value as f32, &mut self.text),
            _ => number::print(value, &mut self.text),
        }
        self.text.push(b',');
    }

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

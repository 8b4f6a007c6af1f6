//! Writing samples as CSV.

use std::io;

use crate::recording::read::{
    columns::{KNOWN, NAMES, TIME, Table},
    number,
};

/// The columns of a table as CSV, in the contract's order, unknown ones last.
pub(crate) fn write(table: &Table, rows: usize, out: &mut impl io::Write) -> io::Result<()> {
    let present: Vec<usize> = (0..KNOWN).filter(|slot| !table.columns[*slot].is_empty()).collect();
    let mut writer = ::csv::Writer::from_writer(out);
    let known = present.iter().map(|slot| NAMES[*slot]);
    writer.write_record(known.chain(table.extra.iter().map(|column| column.name.as_str())))?;
    let mut field = String::new();
    for row in 0..rows {
        for slot in &present {
            field.clear();
            let value = table.columns[*slot][row];
            match *slot {
                TIME if table.clock.epoch.is_some() => field.push_str(&table.clock.text(value)),
                _ => number::print(value, &mut field),
            }
            writer.write_field(&field)?;
        }
        for column in &table.extra {
            writer.write_field(&column.values[row])?;
        }
        writer.write_record(None::<&[u8]>)?;
    }
    writer.flush()
}

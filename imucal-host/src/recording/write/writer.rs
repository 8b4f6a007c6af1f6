//! Writing a recording: back to file units, into the files of a set.

use std::{borrow::Borrow, io, path::Path};

use super::{failed, file_units::table_of, samples::Samples};
use crate::{
    file::OutputSet,
    recording::{
        Recording,
        format::Format,
        manifest::Manifest,
        read::columns::{
            GIMBAL, NAMES, POSITION, REFERENCE, SEGMENT, SIM_TEMPERATURE, TEMPERATURE, TIME, Table,
            simulated_slot_of,
        },
        sensor_kind::SensorKind,
        warning::Warning,
        write_error::WriteError,
    },
};

/// What was written of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// Its rows.
    pub rows: usize,
    /// What the file's format does not hold and was left out.
    pub left_out: Option<Warning>,
}

/// Rows of a recording that are turned into file units at a time, where they are written as text.
const ROWS: usize = 1 << 16;

/// Writes a recording to `path` and its manifest next to it. A text is the same by parts, which take less memory; what a column of
/// another format holds follows from all rows.
pub(crate) fn write_whole(
    recording: &Recording,
    path: &Path,
    files: &mut OutputSet,
) -> Result<Written, WriteError> {
    let rows = recording.rows();
    if rows <= ROWS || !matches!(Format::of(path), Ok(Format::Csv | Format::CsvGz)) {
        return write([recording], path, files);
    }
    check_lengths(recording, path)?;
    let parts = (0..rows).step_by(ROWS).map(|from| recording.part(from..rows.min(from + ROWS)));
    write(parts, path, files)
}

/// Writes the samples of consecutive parts to `path` and the manifest of the first next to it.
pub(crate) fn write<R: Borrow<Recording>>(
    parts: impl IntoIterator<Item = R>,
    path: &Path,
    files: &mut OutputSet,
) -> Result<Written, WriteError> {
    let format =
        Format::of(path).map_err(|found| WriteError::UnknownFormat { path: path.to_path_buf(), found })?;
    let mut parts = parts.into_iter();
    let Some(first) = parts.next() else { return Ok(Written { rows: 0, left_out: None }) };
    let manifest_path = Manifest::path_for(path)
        .ok_or_else(|| failed(path, io::Error::other("the name has no ending of a recording")))?;
    let manifest = first.borrow().manifest.clone();
    manifest.check().map_err(|fault| WriteError::Manifest { path: path.to_path_buf(), fault })?;
    let text = match format {
        Format::Log => manifest.to_toml_of_log(),
        _ => manifest.to_toml(),
    };
    let text = text.map_err(|error| failed(path, io::Error::other(error)))?;
    let mut sequence = Sequence { path, manifest, rows: 0, last: None };
    let table = sequence.table(first.borrow())?;
    let mut samples = Samples::begin(format, first.borrow(), &table, path, files.create(path)?)?;
    samples.append(first.borrow(), &table)?;
    drop((first, table));
    for part in parts {
        samples.append(part.borrow(), &sequence.table(part.borrow())?)?;
    }
    let left_out = samples.finish()?;
    files.add(&manifest_path, text.as_bytes())?;
    Ok(Written { rows: sequence.rows, left_out })
}

/// What the parts have been so far.
struct Sequence<'a> {
    path: &'a Path,
    manifest: Manifest,
    rows: usize,
    /// The last time in the table of the part before.
    last: Option<f64>,
}

impl Sequence<'_> {
    /// The table of the next part.
    fn table(&mut self, part: &Recording) -> Result<Table, WriteError> {
        if part.manifest != self.manifest {
            return Err(WriteError::PartDiffers { path: self.path.to_path_buf(), row: self.rows + 1 });
        }
        check_lengths(part, self.path)?;
        let table = table_of(part);
        self.check(&table)?;
        self.rows += part.rows();
        self.last = table.columns[TIME].last().copied().or(self.last);
        Ok(table)
    }

    fn check(&self, table: &Table) -> Result<(), WriteError> {
        let times = &table.columns[TIME];
        let path = || self.path.to_path_buf();
        let follows = |before: f64, found: f64| found > before && found.is_finite();
        if let Some((before, found)) =
            self.last.zip(times.first().copied()).filter(|(before, found)| !follows(*before, *found))
        {
            return Err(WriteError::TimeOrder { path: path(), row: self.rows + 1, found, before });
        }
        if let Some(at) = times.windows(2).position(|pair| !follows(pair[0], pair[1])) {
            let (before, found) = (times[at], times[at + 1]);
            return Err(WriteError::TimeOrder { path: path(), row: self.rows + at + 2, found, before });
        }
        for (slot, column) in table.columns.iter().enumerate() {
            if let Some(at) = column.iter().position(|value| value.is_infinite()) {
                let column = NAMES[slot].to_owned();
                return Err(WriteError::Infinite { path: path(), row: self.rows + at + 1, column });
            }
        }
        Ok(())
    }
}

fn check_lengths(recording: &Recording, path: &Path) -> Result<(), WriteError> {
    let expected = recording.rows();
    for (column, found) in lengths(recording) {
        if found != expected {
            return Err(WriteError::RowsDiffer { path: path.to_path_buf(), column, found, expected });
        }
    }
    Ok(())
}

fn lengths(recording: &Recording) -> Vec<(String, usize)> {
    let mut lengths = Vec::new();
    for kind in SensorKind::ALL {
        lengths
            .extend(recording.sensor(kind).map(|triple| (kind.columns()[0].to_owned(), triple.values.len())));
    }
    let named = |slot: usize| NAMES[slot].to_owned();
    lengths.extend(recording.temperature.as_ref().map(|column| (named(TEMPERATURE), column.len())));
    lengths.extend(recording.gimbal.as_ref().map(|column| (named(GIMBAL), column.len())));
    lengths.extend(recording.reference.as_ref().map(|column| (named(REFERENCE), column.len())));
    lengths.extend(recording.position.as_ref().map(|column| (named(POSITION), column.len())));
    if let Some(simulated) = &recording.simulated {
        for kind in SensorKind::ALL {
            lengths
                .extend(simulated.sensor(kind).map(|values| (named(simulated_slot_of(kind)), values.len())));
        }
        let temperature = simulated.temperature.as_ref();
        lengths.extend(temperature.map(|column| (named(SIM_TEMPERATURE), column.len())));
    }
    lengths.extend(recording.segment.as_ref().map(|column| (named(SEGMENT), column.len())));
    lengths.extend(recording.extra.iter().map(|column| (column.name.clone(), column.values.len())));
    lengths
}

#[cfg(test)]
mod tests;

//! Recordings of any length, read by parts in constant memory.

use std::{
    fs, mem,
    ops::ControlFlow,
    path::{Path, PathBuf},
};

use super::{
    Format, Manifest, Mapping, ReadError, Recording, SensorKind, Triple, Warning, log_topics::TopicFault,
    read, unit::TimeUnit,
};
use crate::file::Limits;

/// Rows of a part of a text file: a second at 65 kHz, 10 MiB of ten columns.
const ROWS: usize = 1 << 16;
/// Samples by which a sensor's unit is judged.
const JUDGED: usize = 100;

/// A recording's file and how it is read.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    /// The samples.
    pub path: &'a Path,
    /// What its columns are, where they have other names.
    pub mapping: &'a Mapping,
    /// What takes the place of the manifest next to it.
    pub manifest: Option<&'a Manifest>,
    /// Limits of one part.
    pub limits: &'a Limits,
}

impl Recording {
    /// Reads a recording by parts, each a recording of consecutive rows. What is odd but harmless is returned, each kind
    /// of warning once, and in [`Recording::warnings`] of no part. No part follows one that `take` breaks off at.
    ///
    /// A part of a text file has 65 536 rows; one of a Parquet file is a row group, and a MAT-file or a log is one part. Limits hold for one part, so that
    /// the file may be of any length. A program that has called [`keep_freed_memory`](crate::allocator::keep_freed_memory) gives the memory
    /// of a part to the next one.
    ///
    /// # Errors
    ///
    /// As [`Recording::read`]; intervals are judged by the first part alone, and the unit of a sensor by the first parts that it is in.
    pub fn read_parts(
        source: Source<'_>,
        take: &mut dyn FnMut(Self) -> ControlFlow<()>,
    ) -> Result<Vec<Warning>, ReadError> {
        let Source { path, mapping, manifest, limits } = source;
        let Opened { format, manifest, warnings, field_is_stated } =
            opened(path, mapping, manifest.cloned(), limits)?;
        #[cfg(not(feature = "logs"))]
        let _ = field_is_stated;
        let misled = misled(&warnings);
        let unit = manifest.units.t;
        let mut parts = Parts {
            path,
            manifest,
            of_manifest: warnings,
            warnings: Vec::new(),
            last: None,
            not_begun: SensorKind::ALL.to_vec(),
            take,
        };
        let mut next = |table| parts.next(table);
        let read = match format {
            Format::Csv | Format::CsvGz => {
                read::csv::read_parts(path, unit, mapping, limits, ROWS, &mut next)
            }
            #[cfg(feature = "parquet")]
            Format::Parquet => read::parquet::read_parts(path, unit, mapping, limits, &mut next),
            #[cfg(not(feature = "parquet"))]
            Format::Parquet => return Err(ReadError::ParquetNotBuilt { path: path.to_path_buf() }),
            Format::Mat => {
                read::matlab::read(path, unit, mapping, limits).and_then(|table| next(table).map(|_| ()))
            }
            #[cfg(feature = "logs")]
            Format::Log => read::logs::read(path, &mapping.topics, field_is_stated, limits)
                .and_then(|table| next(table).map(|_| ())),
            #[cfg(not(feature = "logs"))]
            Format::Log => return Err(ReadError::LogsNotBuilt { path: path.to_path_buf() }),
        };
        read.map_err(misled)?;
        Ok(parts.warnings)
    }
}

/// What is known of a samples file before it is read.
pub(super) struct Opened {
    pub(super) format: Format,
    /// With what a mapping states.
    pub(super) manifest: Manifest,
    pub(super) warnings: Vec<Warning>,
    /// A log's magnetometer is in a unit that its manifest or the mapping states, in place of ROS's.
    pub(super) field_is_stated: bool,
}

/// The format of a samples file, its manifest with what a mapping states, and what is odd in that. A mapped file needs no manifest.
pub(super) fn opened(
    path: &Path,
    mapping: &Mapping,
    manifest: Option<Manifest>,
    limits: &Limits,
) -> Result<Opened, ReadError> {
    let format = Format::of(path).map_err(|found| unknown(path, found))?;
    if !path.exists() {
        let found = "there is no such file".to_owned();
        return Err(ReadError::Unreadable { path: path.to_path_buf(), found });
    }
    refuse_options(path, format, mapping)?;
    if format == Format::Mat {
        read::matlab::refuse_others(path)?;
    }
    let (manifest, mut warnings, states_field) = match manifest {
        // What it was read from is not known, nor whether that states microtesla.
        Some(manifest) => {
            let is_unusual = manifest.units.mag != Manifest::default().units.mag;
            (manifest, Vec::new(), is_unusual)
        }
        None if format == Format::Log => manifest_of_log(path, limits)?,
        None => {
            let (manifest, warnings) = manifest_of(path, mapping, limits)?;
            (manifest, warnings, false)
        }
    };
    let field_is_stated = states_field || mapping.states(SensorKind::Mag);
    let mut manifest = mapping.over(manifest);
    if format == Format::Log {
        stamped(path, TimeUnit::Nanosecond, &mut manifest, &mut warnings);
        warnings.extend(of_driver(path, &manifest, field_is_stated));
    }
    #[cfg(feature = "parquet")]
    if format == Format::Parquet
        && let Some(unit) = read::parquet::unit_of_stamps(path, mapping)
    {
        stamped(path, unit, &mut manifest, &mut warnings);
    }
    Ok(Opened { format, manifest, warnings, field_is_stated })
}

/// A file whose ending is of no format.
fn unknown(path: &Path, found: String) -> ReadError {
    let path = path.to_path_buf();
    if path.is_dir() { folder(path) } else { ReadError::UnknownFormat { path, found } }
}

/// A folder, as `ros2 bag record` makes one, with the files in it that are read.
fn folder(path: PathBuf) -> ReadError {
    let entries = fs::read_dir(&path).into_iter().flatten().flatten();
    let readable =
        entries.map(|entry| entry.path()).filter(|file| file.is_file() && Format::of(file).is_ok());
    let mut files: Vec<String> = readable.map(|file| file.display().to_string()).collect();
    files.sort();
    ReadError::Folder { path, files }
}

/// Topics are of a log, and named columns of any other file.
fn refuse_options(path: &Path, format: Format, mapping: &Mapping) -> Result<(), ReadError> {
    let fault = match format {
        Format::Log if mapping.has_columns() => TopicFault::Columns,
        Format::Csv | Format::CsvGz | Format::Parquet | Format::Mat if !mapping.topics.is_empty() => {
            TopicFault::NotALog
        }
        _ => return Ok(()),
    };
    Err(ReadError::Topics { path: path.to_path_buf(), fault: Box::new(fault) })
}

/// A log may go without, since its messages say their units; and whether it states that of the magnetometer.
fn manifest_of_log(path: &Path, limits: &Limits) -> Result<(Manifest, Vec<Warning>, bool), ReadError> {
    let manifest_path = Manifest::path_for(path).unwrap_or_else(|| path.with_extension("toml"));
    match Manifest::read_within(&manifest_path, limits) {
        Err(ReadError::ManifestMissing { .. }) => Ok((Manifest::default(), Vec::new(), false)),
        read => {
            let (manifest, mut warnings) = read?;
            let assumes_field = warnings.iter().any(|warning| {
                matches!(warning, Warning::UnitsAssumed { assumed, .. } if assumed.iter().any(|(key, _)| *key == "mag"))
            });
            warnings.retain(|warning| !matches!(warning, Warning::UnitsAssumed { .. }));
            Ok((manifest, warnings, !assumes_field))
        }
    }
}

/// Stamps are in a unit of the file's own, whatever a manifest says or leaves out.
pub(super) fn stamped(path: &Path, found: TimeUnit, manifest: &mut Manifest, warnings: &mut Vec<Warning>) {
    let unit = mem::replace(&mut manifest.units.t, found);
    if unit != found && unit != Manifest::default().units.t {
        warnings.push(Warning::UnitOfStamps { path: path.to_path_buf(), unit, found });
    }
    warnings.retain_mut(|warning| match warning {
        Warning::UnitsAssumed { assumed, .. } => {
            assumed.retain(|(key, _)| *key != "t");
            !assumed.is_empty()
        }
        _ => true,
    });
}

/// Units that a driver uses in place of ROS's.
fn of_driver(path: &Path, manifest: &Manifest, field_is_stated: bool) -> Vec<Warning> {
    let usual = Manifest::default().units;
    let stated = |kind: &SensorKind| match kind {
        SensorKind::Mag => field_is_stated,
        kind => manifest.units.of(*kind) != usual.of(*kind),
    };
    let warning = |kind: SensorKind| Warning::UnitOfDriver {
        path: path.to_path_buf(),
        sensor: kind,
        unit: manifest.units.of(kind),
        usual: ["m/s^2", "rad/s", "T"][kind as usize],
    };
    SensorKind::ALL.into_iter().filter(stated).map(warning).collect()
}

fn manifest_of(
    path: &Path,
    mapping: &Mapping,
    limits: &Limits,
) -> Result<(Manifest, Vec<Warning>), ReadError> {
    let manifest_path = Manifest::path_for(path).unwrap_or_else(|| path.with_extension("toml"));
    match Manifest::read_within(&manifest_path, limits) {
        Err(ReadError::ManifestMissing { .. }) if !mapping.is_empty() => {
            let assumed = mapping.unstated();
            let warning = (!assumed.is_empty()).then(|| Warning::UnitsAssumed {
                path: path.to_path_buf(),
                line: None,
                assumed,
            });
            Ok((Manifest::default(), warning.into_iter().collect()))
        }
        read => read,
    }
}

/// An unknown key is often why the samples cannot be understood, and then nobody would read the warning.
pub(super) fn misled(warnings: &[Warning]) -> impl FnOnce(ReadError) -> ReadError + use<> {
    let misspelt =
        warnings.iter().find(|warning| matches!(warning, Warning::UnknownKey { nearest: Some(_), .. }));
    let misspelt = misspelt.cloned().map(Box::new);
    move |error| match misspelt {
        Some(warning) => ReadError::Misled { error: Box::new(error), warning },
        None => error,
    }
}

struct Parts<'a> {
    path: &'a Path,
    manifest: Manifest,
    /// What is odd in the manifest, for the first part to judge.
    of_manifest: Vec<Warning>,
    warnings: Vec<Warning>,
    /// The last time of the parts before, s.
    last: Option<f64>,
    /// Sensors of which too few samples have come to judge their unit.
    not_begun: Vec<SensorKind>,
    take: &'a mut dyn FnMut(Recording) -> ControlFlow<()>,
}

/// Samples that were measured.
fn measured(sensor: &Triple) -> usize {
    sensor.values.iter().filter(|value| value.iter().all(|axis| axis.is_finite())).count()
}

impl Parts<'_> {
    fn next(&mut self, mut table: read::columns::Table) -> Result<ControlFlow<()>, ReadError> {
        let empty = table.columns[read::columns::TIME].is_empty();
        if empty && self.last.is_some() {
            self.note(mem::take(&mut table.warnings));
            return Ok(ControlFlow::Continue(()));
        }
        table.warnings.splice(0..0, mem::take(&mut self.of_manifest));
        let (clock, place) = (table.clock.clone(), table.places.of(0));
        let manifest = self.manifest.clone();
        let mut part = match self.last {
            None => read::assembly::assemble(self.path, manifest, table)?,
            Some(_) => read::assembly::continued(self.path, manifest, table, &self.not_begun)?,
        };
        self.not_begun.retain(|kind| part.sensor(*kind).is_none_or(|sensor| measured(sensor) < JUDGED));
        let text = |time: f64| clock.text(time * clock.per_si());
        if let Some((last, first)) = self.last.zip(part.time.first().copied()).filter(|(last, t)| t <= last) {
            return Err(ReadError::TimeOrder {
                path: self.path.to_path_buf(),
                place,
                found: text(first),
                before: text(last),
                remedy: "sort the rows by time, or split the file where the clock was reset".to_owned(),
            });
        }
        self.note(mem::take(&mut part.warnings));
        self.last = part.time.last().copied();
        Ok((self.take)(part))
    }

    /// Keeps what no part before has said.
    fn note(&mut self, warnings: Vec<Warning>) {
        if self.last.is_none() {
            self.warnings.extend(warnings);
            return;
        }
        for warning in warnings {
            let count = |kept: &mut Warning| kept.counted_with(&warning);
            let same = |kept: &Warning| mem::discriminant(kept) == mem::discriminant(&warning);
            let absurd = matches!(warning, Warning::Absurd { .. });
            if !self.warnings.iter_mut().any(count) && (absurd || !self.warnings.iter().any(same)) {
                self.warnings.push(warning);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::fixture::{Fixture, assert_says, csv};

    fn rows(times: impl Iterator<Item = f64>) -> String {
        times.fold("t,gyr_x,gyr_y,gyr_z,note\n".to_owned(), |text, t| {
            text + &format!("{t},0,0,{},a\n", t / 1024.0)
        })
    }

    #[derive(Default)]
    struct Read {
        lengths: Vec<usize>,
        values: Vec<f64>,
        warnings: Vec<Warning>,
    }

    fn parts(fixture: &Fixture) -> Result<Read, ReadError> {
        let mut read = Read::default();
        let (mapping, limits) = (Mapping::default(), Limits::default());
        let source = Source { path: &fixture.path, mapping: &mapping, manifest: None, limits: &limits };
        read.warnings = Recording::read_parts(source, &mut |part| {
            read.lengths.push(part.rows());
            read.values.extend(part.gyr.iter().flat_map(|gyr| gyr.values.iter().map(|rate| rate.z)));
            ControlFlow::Continue(())
        })?;
        Ok(read)
    }

    #[test]
    fn the_parts_are_the_whole_and_each_warning_is_said_once() {
        let fixture = csv(rows((0..2 * ROWS + 3).map(|k| k as f64 / 256.0)));
        let Read { lengths, values, warnings } = parts(&fixture).unwrap();
        assert_eq!(lengths, [ROWS, ROWS, 3]);
        let whole = fixture.read();
        assert!(whole.time.iter().zip(&values).all(|(time, rate)| *rate == time / 1024.0));
        assert_eq!(whole.rows(), values.len());
        assert_eq!(whole.warnings, warnings);
    }

    #[test]
    fn samples_that_nothing_measures_are_counted_over_all_parts() {
        let row = |k: usize| {
            let lost = if k % ROWS == 7 { 1e9 } else { 0.0 };
            format!("{},{lost},0,{}\n", k as f64 / 256.0, if k == ROWS + 9 { 1e8 } else { 0.5 })
        };
        let fixture =
            csv((0..2 * ROWS + 9).fold("t,gyr_x,gyr_y,gyr_z\n".to_owned(), |text, k| text + &row(k)));
        let whole = fixture.read().warnings;
        assert_eq!(parts(&fixture).unwrap().warnings, whole);
        assert_says(&whole[1].to_string(), &["line 9, column `gyr_x`", "2 more"]);
    }

    #[test]
    fn a_clock_that_runs_back_between_two_parts_is_refused_with_its_line() {
        let fixture = csv(rows((0..ROWS + 3).map(|k| (k % ROWS) as f64 / 256.0)));
        let message = parts(&fixture).err().unwrap().to_string();
        assert_says(
            &message,
            &[&format!("line {}", ROWS + 2), "found 0 after 255.99609375", "sort the rows"],
        );
    }

    #[test]
    fn the_unit_of_a_sensor_that_begins_late_is_judged_where_it_begins() {
        let text = |length: f64| {
            let header = "t,gyr_x,gyr_y,gyr_z,acc_x,acc_y,acc_z\n".to_owned();
            (0..ROWS + 3000).fold(header, |text, k| {
                let force = if k < ROWS + 500 { ",,".to_owned() } else { format!("0,0,{length}") };
                text + &format!("{},0,0,0.01,{force}\n", k as f64 / 256.0)
            })
        };
        let refused = csv(text(1.0));
        let message = parts(&refused).err().unwrap().to_string();
        assert_says(&message, &["acc", "about 9.8 m/s²", "`g`"]);
        assert_eq!(message, refused.error());
        assert_eq!(parts(&csv(text(9.8))).unwrap().warnings.len(), csv(text(9.8)).read().warnings.len());
    }
}

//! Recordings: samples and manifest, read, checked and written.
//!
//! Outside of this module everything is in SI units (s, m/s², rad/s, µT, °C, rad); the files' units
//! live in [`mod@unit`] and the manifest alone.

use std::{
    ops::Range,
    path::{Path, PathBuf},
};

pub mod check;
mod epoch;
#[cfg(test)]
mod fixture;
mod format;
pub mod layout_guess;
pub mod log_topics;
pub mod manifest;
pub mod mapping;
pub mod order_statistics;
mod parts;
mod place;
pub mod read;
mod read_error;
mod samples;
mod sensor_kind;
mod series;
pub mod simulated;
pub mod topic;
pub mod transfer;
mod triple;
pub mod unit;
mod warning;
mod write;
mod write_error;

pub(crate) use self::format::{Format, is_bag_folder};
pub use self::{
    epoch::Epoch,
    manifest::Manifest,
    mapping::Mapping,
    order_statistics::median,
    parts::Source,
    place::Place,
    read_error::ReadError,
    samples::{GIMBALS, Samples},
    sensor_kind::SensorKind,
    series::Series,
    simulated::{Simulated, Stream},
    triple::{Nominal, Triple},
    unit::Unit,
    warning::Warning,
    write::writer::Written,
    write_error::WriteError,
};
use crate::file::{Limits, OutputSet};

/// Whether a path is a robot's log: a file by its ending, MCAP or a bag, or a folder that the recorder of ROS 2 made.
#[must_use]
pub fn is_log(path: &Path) -> bool {
    Format::of(path) == Ok(Format::Log)
}

/// The files that hold the samples of a recording: itself, or of a folder that the recorder of ROS 2 made those that its metadata
/// list.
///
/// # Errors
///
/// [`ReadError::Log`] of metadata that cannot be understood.
pub fn files_of(path: &Path) -> Result<Vec<PathBuf>, ReadError> {
    #[cfg(feature = "logs")]
    let files = imucal_logs::files_of(path).map_err(|error| ReadError::Log(Box::new(error)))?;
    #[cfg(not(feature = "logs"))]
    let files = vec![path.to_path_buf()];
    Ok(files)
}

/// A recording of an inertial measurement unit. All columns that are there have as many rows as `time`.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Name of the samples file, without its directory.
    pub name: String,
    /// Path of the samples file.
    pub path: PathBuf,
    /// What the samples are.
    pub manifest: Manifest,
    /// Sample times on the sensor's clock, s, strictly increasing, finite.
    pub time: Vec<f64>,
    /// What of an absolute clock `time` was counted from: the first row as it was read, where that is beyond 1e6 s.
    /// `None`: from the clock's own zero. The file has the sum of both.
    pub epoch: Option<Epoch>,
    /// Accelerometer: specific force, m/s².
    pub acc: Option<Triple>,
    /// Gyroscope: rate, rad/s.
    pub gyr: Option<Triple>,
    /// Magnetometer: field, µT.
    pub mag: Option<Triple>,
    /// Temperature, °C; NaN where not measured.
    pub temperature: Option<Vec<f64>>,
    /// Encoder angles outer, middle, inner, rad; NaN where not measured.
    pub gimbal: Option<Vec<[f64; 3]>>,
    /// Reference attitude table → n as quaternion w, x, y, z, as the file has it; NaN where not measured.
    pub reference: Option<Vec<[f64; 4]>>,
    /// Position of the reference point in n, m; NaN where not measured. Of no use without an attitude.
    pub position: Option<Vec<[f64; 3]>>,
    /// What a simulator says that ideal sensors would read.
    pub simulated: Option<Simulated>,
    /// Labels of rests and motions.
    pub segment: Option<Vec<Option<i64>>>,
    /// Columns the contract does not know.
    pub extra: Vec<ExtraColumn>,
    /// What the reader noticed.
    pub warnings: Vec<Warning>,
}

/// A column the contract does not know, kept as it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExtraColumn {
    /// Name in the header.
    pub name: String,
    /// Text of each row.
    pub values: Vec<String>,
}

impl Recording {
    /// A recording with times (s, strictly increasing) and no sensor yet, to be filled and written.
    #[must_use]
    pub fn new(name: impl Into<String>, manifest: Manifest, time: Vec<f64>) -> Self {
        let name = name.into();
        Self {
            path: PathBuf::from(&name),
            name,
            manifest,
            time,
            epoch: None,
            acc: None,
            gyr: None,
            mag: None,
            temperature: None,
            gimbal: None,
            reference: None,
            position: None,
            simulated: None,
            segment: None,
            extra: Vec::new(),
            warnings: Vec::new(),
        }
    }

    /// Reads `NAME.csv`, `NAME.csv.gz`, `NAME.mat` or, when built with the features `parquet` and `logs`, `NAME.parquet`, `NAME.mcap`,
    /// `NAME.bag`, `NAME.db3` and the folder `NAME` of a ROS 2 bag, and the manifest `NAME.toml` next to it, which a log needs not
    /// have. What is odd but harmless is in [`Recording::warnings`].
    ///
    /// # Errors
    ///
    /// [`ReadError`], when a file is missing, damaged or not what the contract says, or when its
    /// samples are clearly in another unit than its manifest says.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        Self::read_within(path, &Limits::default())
    }

    /// As [`Recording::read`], with limits other than the default.
    ///
    /// # Errors
    ///
    /// As [`Recording::read`].
    pub fn read_within(path: &Path, limits: &Limits) -> Result<Self, ReadError> {
        Self::read_as(path, &Mapping::default(), limits)
    }

    /// As [`Recording::read_within`], of a file whose columns have other names, or of some topics of a log. Then it needs no
    /// manifest, and its fields may be separated by semicolons, tabs, bars or blanks.
    ///
    /// # Errors
    ///
    /// As [`Recording::read`].
    pub fn read_as(path: &Path, mapping: &Mapping, limits: &Limits) -> Result<Self, ReadError> {
        Self::read_with(path, mapping, None, limits)
    }

    /// As [`Recording::read_as`]; `manifest` takes the place of the one next to the file.
    ///
    /// # Errors
    ///
    /// As [`Recording::read`].
    pub fn read_with(
        path: &Path,
        mapping: &Mapping,
        manifest: Option<Manifest>,
        limits: &Limits,
    ) -> Result<Self, ReadError> {
        let parts::Opened { format, manifest, warnings, field_is_stated } =
            parts::opened(path, mapping, manifest, limits)?;
        #[cfg(not(feature = "logs"))]
        let _ = field_is_stated;
        let unit = manifest.units.t;
        let mut table = match format {
            Format::Csv | Format::CsvGz => read::csv::read(path, unit, mapping, limits)?,
            #[cfg(feature = "parquet")]
            Format::Parquet => read::parquet::read(path, unit, mapping, limits)?,
            #[cfg(not(feature = "parquet"))]
            Format::Parquet => {
                return Err(ReadError::ParquetNotBuilt { path: path.to_path_buf() });
            }
            Format::Mat => read::matlab::read(path, unit, mapping, limits)?,
            #[cfg(feature = "logs")]
            Format::Log => read::logs::read(path, &mapping.topics, field_is_stated, limits)?,
            #[cfg(not(feature = "logs"))]
            Format::Log => return Err(ReadError::LogsNotBuilt { path: path.to_path_buf() }),
        };
        let misled = parts::misled(&warnings);
        table.warnings.splice(0..0, warnings);
        read::assembly::assemble(path, manifest, table).map_err(misled)
    }

    /// Writes the samples, in the units of the manifest, as the ending of `path` says, and the manifest
    /// next to them, over former files of these names. Both files are replaced, or none.
    ///
    /// # Errors
    ///
    /// [`WriteError`], when the recording contradicts itself or the system refuses.
    pub fn write(&self, path: &Path) -> Result<Written, WriteError> {
        let mut files = OutputSet::default();
        let written = self.write_into(path, &mut files)?;
        files.commit()?;
        Ok(written)
    }

    /// As [`Recording::write`], but as part of a set of files that is to be committed.
    ///
    /// # Errors
    ///
    /// As [`Recording::write`].
    pub fn write_into(&self, path: &Path, files: &mut OutputSet) -> Result<Written, WriteError> {
        write::writer::write_whole(self, path, files)
    }

    /// As [`Recording::write_into`], of consecutive parts in constant memory. The files are those that the whole would give.
    ///
    /// # Errors
    ///
    /// As [`Recording::write`], and for a part whose columns or manifest are not those of the first.
    pub fn write_parts(
        parts: impl IntoIterator<Item = Self>,
        path: &Path,
        files: &mut OutputSet,
    ) -> Result<Written, WriteError> {
        write::writer::write(parts, path, files)
    }

    /// Consecutive rows of it, without its warnings. Panics where a column has no such rows.
    fn part(&self, rows: Range<usize>) -> Self {
        fn of<T: Clone>(column: Option<&Vec<T>>, rows: &Range<usize>) -> Option<Vec<T>> {
            column.map(|column| column[rows.clone()].to_vec())
        }
        let extra = |column: &ExtraColumn| ExtraColumn {
            name: column.name.clone(),
            values: column.values[rows.clone()].to_vec(),
        };
        Self {
            name: self.name.clone(),
            path: self.path.clone(),
            manifest: self.manifest.clone(),
            time: self.time[rows.clone()].to_vec(),
            epoch: self.epoch,
            acc: self.acc.as_ref().map(|triple| triple.part(&rows)),
            gyr: self.gyr.as_ref().map(|triple| triple.part(&rows)),
            mag: self.mag.as_ref().map(|triple| triple.part(&rows)),
            temperature: of(self.temperature.as_ref(), &rows),
            gimbal: of(self.gimbal.as_ref(), &rows),
            reference: of(self.reference.as_ref(), &rows),
            position: of(self.position.as_ref(), &rows),
            simulated: self
                .simulated
                .as_ref()
                .map(|simulated| simulated.at(&rows.clone().collect::<Vec<_>>())),
            segment: of(self.segment.as_ref(), &rows),
            extra: self.extra.iter().map(extra).collect(),
            warnings: Vec::new(),
        }
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.time.len()
    }

    /// Median of the intervals between rows, s; `None` below two rows.
    #[must_use]
    pub fn median_interval(&self) -> Option<f64> {
        median(self.time.windows(2).map(|pair| pair[1] - pair[0]).collect())
    }

    /// Median of the intervals between a sensor's samples, s: longer than that between rows where others are measured between them;
    /// `None` below two samples.
    #[must_use]
    pub fn sample_interval(&self, kind: SensorKind) -> Option<f64> {
        let values = &self.sensor(kind)?.values;
        let measured = |row: &usize| values[*row].iter().all(|component| component.is_finite());
        let mut times = (0..values.len()).filter(measured).map(|row| self.time[row]);
        let mut before = times.next()?;
        median(times.map(|time| time - std::mem::replace(&mut before, time)).collect())
    }

    /// A sensor's samples in time, if it was recorded.
    #[must_use]
    pub fn series<'a>(&'a self, kind: SensorKind, usable: &'a [bool]) -> Option<Series<'a>> {
        let interval = self.sample_interval(kind).unwrap_or(1.0);
        Some(Series { time: &self.time, values: &self.sensor(kind)?.values, usable, interval })
    }

    /// The samples of a sensor, if it was recorded.
    #[must_use]
    pub fn sensor(&self, kind: SensorKind) -> Option<&Triple> {
        match kind {
            SensorKind::Acc => self.acc.as_ref(),
            SensorKind::Gyr => self.gyr.as_ref(),
            SensorKind::Mag => self.mag.as_ref(),
        }
    }
}

//! Writing samples as MCAP: messages of ROS 2, each of a row at which its sensor was read.
//!
//! Names of topics are those of REP 145. Poses are in the recording's frame n, whose z axis points down: its name says so.

use std::{io, path::Path};

use imucal_logs::{Kind, LogWriteError, LogWriter, TopicId};
use nalgebra::Vector3;

use crate::recording::{
    Recording,
    epoch::Epoch,
    read::{
        columns::{NAMES, REFERENCE},
        logs::DOWN,
    },
    sensor_kind::SensorKind,
    unit::{MICROTESLA_PER_TESLA, Unit},
    warning::Warning,
    write_error::WriteError,
};

/// What a topic's messages say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Series {
    Imu,
    Field,
    Temperature,
    Reference,
    SimulatedImu,
    SimulatedField,
    SimulatedTemperature,
}

impl Series {
    const ALL: [Self; 7] = [
        Self::Imu,
        Self::Field,
        Self::Temperature,
        Self::Reference,
        Self::SimulatedImu,
        Self::SimulatedField,
        Self::SimulatedTemperature,
    ];

    /// Topic, kind, and the frame: the sensor's, or the one in which a pose is.
    fn topic(self) -> (&'static str, Kind, String) {
        let sensor = || "imu_link".to_owned();
        match self {
            Self::Imu => ("/imu/data_raw", Kind::Imu, sensor()),
            Self::Field => ("/imu/mag", Kind::MagneticField, sensor()),
            Self::Temperature => ("/imu/temperature", Kind::Temperature, sensor()),
            Self::Reference => ("/reference/pose", Kind::Pose, format!("reference{DOWN}")),
            Self::SimulatedImu => ("/sim/imu/data_raw", Kind::Imu, sensor()),
            Self::SimulatedField => ("/sim/imu/mag", Kind::MagneticField, sensor()),
            Self::SimulatedTemperature => ("/sim/imu/temperature", Kind::Temperature, sensor()),
        }
    }

    fn is_in(self, recording: &Recording) -> bool {
        let simulated = recording.simulated.as_ref();
        match self {
            Self::Imu => recording.acc.is_some() || recording.gyr.is_some(),
            Self::Field => recording.mag.is_some(),
            Self::Temperature => recording.temperature.is_some(),
            Self::Reference => recording.reference.is_some() && recording.position.is_some(),
            Self::SimulatedImu => simulated.is_some_and(|sim| sim.acc.is_some() || sim.gyr.is_some()),
            Self::SimulatedField => simulated.is_some_and(|sim| sim.mag.is_some()),
            Self::SimulatedTemperature => simulated.is_some_and(|sim| sim.temperature.is_some()),
        }
    }

    /// The numbers of a row's message; NaN where not known.
    fn values(self, recording: &Recording, row: usize) -> Vec<f64> {
        let own = |kind| recording.sensor(kind).map(|triple| triple.values.as_slice());
        let simulated = recording.simulated.as_ref();
        let ideal = |kind| simulated.and_then(|sim| sim.sensor(kind));
        let temperature = |column: Option<&Vec<f64>>| vec![of_row(column, row).unwrap_or(f64::NAN)];
        match self {
            Self::Imu => imu(own(SensorKind::Acc), own(SensorKind::Gyr), row),
            Self::Field => field(own(SensorKind::Mag), row),
            Self::Temperature => temperature(recording.temperature.as_ref()),
            Self::Reference => {
                let position = of_row(recording.position.as_ref(), row).unwrap_or([f64::NAN; 3]);
                let attitude = of_row(recording.reference.as_ref(), row).unwrap_or([f64::NAN; 4]);
                position.into_iter().chain(attitude).collect()
            }
            Self::SimulatedImu => imu(ideal(SensorKind::Acc), ideal(SensorKind::Gyr), row),
            Self::SimulatedField => field(ideal(SensorKind::Mag), row),
            Self::SimulatedTemperature => temperature(simulated.and_then(|sim| sim.temperature.as_ref())),
        }
    }
}

fn of_row<T: Copy>(column: Option<&Vec<T>>, row: usize) -> Option<T> {
    column.and_then(|column| column.get(row)).copied()
}

fn triple(values: Option<&[Vector3<f64>]>, row: usize) -> Vector3<f64> {
    values.and_then(|values| values.get(row)).copied().unwrap_or(Vector3::repeat(f64::NAN))
}

/// A message without an attitude.
fn imu(force: Option<&[Vector3<f64>]>, rate: Option<&[Vector3<f64>]>, row: usize) -> Vec<f64> {
    let (force, rate) = (triple(force, row), triple(rate, row));
    force.iter().chain(&rate).copied().chain([f64::NAN; 4]).collect()
}

fn field(values: Option<&[Vector3<f64>]>, row: usize) -> Vec<f64> {
    (triple(values, row) / MICROTESLA_PER_TESLA).iter().copied().collect()
}

/// Samples as messages.
pub(crate) struct McapWriter<W: io::Write> {
    log: LogWriter<W>,
    topics: Vec<(Series, TopicId)>,
    left_out: Option<Warning>,
    last_ns: Option<i64>,
}

impl<W: io::Write> McapWriter<W> {
    /// Starts with the topics of a recording, which has the first rows.
    pub(crate) fn begin(out: W, first: &Recording, path: &Path) -> Result<Self, WriteError> {
        for sensor in SensorKind::ALL {
            let unit = first.sensor(sensor).map(|triple| triple.unit);
            if let Some(unit) = unit.filter(|unit| matches!(unit, Unit::Counts | Unit::Arbitrary)) {
                return Err(WriteError::NotOfRos { path: path.to_path_buf(), sensor, unit });
            }
        }
        let system = |error: LogWriteError| super::failed(path, io::Error::other(error));
        let mut log = LogWriter::new(out).map_err(system)?;
        let mut topics = Vec::new();
        for series in Series::ALL.into_iter().filter(|series| series.is_in(first)) {
            let (topic, kind, frame) = series.topic();
            topics.push((series, log.add(topic, kind, &frame).map_err(system)?));
        }
        let columns = left_out(first);
        let left_out = (!columns.is_empty()).then(|| Warning::NotInLog { path: path.to_path_buf(), columns });
        Ok(Self { log, topics, left_out, last_ns: None })
    }

    /// Appends the rows of a part that has the columns of the first; `before` were written already.
    pub(crate) fn append(
        &mut self,
        part: &Recording,
        path: &Path,
        before: usize,
    ) -> Result<io::Result<()>, WriteError> {
        for (row, time) in part.time.iter().enumerate() {
            let wrong =
                || WriteError::Stamp { path: path.to_path_buf(), row: before + row + 1, found: *time };
            let stamp =
                stamp_ns(part.epoch, *time).filter(|stamp| self.last_ns.is_none_or(|last| *stamp > last));
            let stamp = stamp.ok_or_else(wrong)?;
            self.last_ns = Some(stamp);
            for (series, topic) in &self.topics {
                let values = series.values(part, row);
                if values.iter().all(|value| value.is_nan()) {
                    continue;
                }
                match self.log.write(*topic, stamp, &values) {
                    Ok(()) => {}
                    Err(LogWriteError::Stamp { .. }) => return Err(wrong()),
                    Err(error) => return Ok(Err(io::Error::other(error))),
                }
            }
        }
        Ok(Ok(()))
    }

    /// Ends the file; what no message holds.
    pub(crate) fn finish(self) -> io::Result<Option<Warning>> {
        self.log.finish().map_err(io::Error::other)?;
        Ok(self.left_out)
    }
}

/// A stamp, ns: on the clock of its epoch, or since the recording's zero.
fn stamp_ns(epoch: Option<Epoch>, time: f64) -> Option<i64> {
    let picoseconds = epoch.unwrap_or(Epoch::of_picoseconds(0)).later(time)?.picoseconds();
    i64::try_from((picoseconds + 500).div_euclid(1000)).ok()
}

/// What a recording has that no message holds.
fn left_out(recording: &Recording) -> Vec<String> {
    let mut columns = Vec::new();
    if recording.gimbal.is_some() {
        columns.push("the encoder angles".to_owned());
    }
    if recording.reference.is_some() && recording.position.is_none() {
        columns.push(format!("`{}` and the others of an attitude without a position", NAMES[REFERENCE]));
    }
    if recording.position.is_some() && recording.reference.is_none() {
        columns.push("a position without an attitude".to_owned());
    }
    if recording.segment.is_some() {
        columns.push("`segment`".to_owned());
    }
    columns.extend(recording.extra.iter().map(|column| format!("`{}`", column.name)));
    columns
}

#[cfg(test)]
mod tests {
    use std::{fs, path::PathBuf};

    use super::*;
    use crate::{
        file::Limits,
        recording::{ExtraColumn, Manifest, Mapping, Simulated, fixture::assert_says},
    };

    /// Three rows with everything a recording can hold.
    fn full() -> Recording {
        let mut recording = Recording::new("run.csv", Manifest::default(), vec![0.0, 0.01, 0.02]);
        recording.epoch = Some(Epoch::of_picoseconds(1_700_000_000_123_456_789_000));
        recording.manifest.sensor.serial = Some("7".to_owned());
        let rows =
            |second: f64| vec![Vector3::new(1.5, 0.1, -9.7), Vector3::repeat(second), Vector3::x() * 9.8];
        for kind in SensorKind::ALL {
            let second = if kind == SensorKind::Acc { 5.625 } else { f64::NAN };
            let triple = recording.manifest.triple(kind, rows(second)).ok();
            match kind {
                SensorKind::Acc => recording.acc = triple,
                SensorKind::Gyr => recording.gyr = triple,
                SensorKind::Mag => recording.mag = triple,
            }
        }
        recording.temperature = Some(vec![20.0, f64::NAN, 21.5]);
        recording.reference = Some(vec![[0.5, -0.5, 0.5, 0.5]; 3]);
        recording.position = Some(vec![[1.0, -2.5, 0.1]; 3]);
        let values = || Some(rows(f64::NAN));
        recording.simulated =
            Some(Simulated { acc: values(), gyr: values(), mag: values(), temperature: Some(vec![25.0; 3]) });
        recording
    }

    fn bench() -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        (folder, path)
    }

    fn read(path: &Path, topics: &[&str]) -> Recording {
        let topics: Vec<String> = topics.iter().map(|topic| (*topic).to_owned()).collect();
        let mapping = Mapping::default().with_topics(&topics).unwrap();
        Recording::read_as(path, &mapping, &Limits::default()).unwrap()
    }

    #[test]
    fn a_recording_reads_back_what_it_writes_as_messages() {
        let (_folder, path) = bench();
        assert_eq!(full().write(&path).unwrap().left_out, None);
        let topics = ["imu=/imu/data_raw", "mag=/imu/mag", "temp=/imu/temperature", "ref=/reference/pose"];
        let back = read(&path, &topics);
        let all = full();
        assert_eq!((&back.time, back.epoch), (&all.time, all.epoch));
        assert_eq!((&back.reference, &back.position), (&all.reference, &all.position));
        assert_eq!(back.manifest.sensor, all.manifest.sensor);
        assert_eq!(back.warnings, []);
        for kind in SensorKind::ALL {
            let (found, expected) = (&back.sensor(kind).unwrap().values, &all.sensor(kind).unwrap().values);
            for (found, expected) in found.iter().zip(expected) {
                let same =
                    found.iter().all(|value| value.is_nan()) && expected.iter().all(|value| value.is_nan());
                assert!(
                    same || (found - expected).norm() <= 1e-15 * expected.norm(),
                    "{kind} {found} {expected}"
                );
            }
        }
        let simulated =
            read(&path, &["imu=/sim/imu/data_raw", "mag=/sim/imu/mag", "temp=/sim/imu/temperature"]);
        assert_eq!(simulated.acc.unwrap().values[0], all.simulated.unwrap().acc.unwrap()[0]);
        assert_eq!(simulated.temperature, Some(vec![25.0; 2]));
    }

    #[test]
    fn what_no_message_holds_is_named() {
        let (_folder, path) = bench();
        let mut recording = full();
        recording.gimbal = Some(vec![[0.0; 3]; 3]);
        recording.segment = Some(vec![None; 3]);
        recording.position = None;
        recording.extra = vec![ExtraColumn { name: "note".to_owned(), values: vec![String::new(); 3] }];
        let said = recording.write(&path).unwrap().left_out.unwrap().to_string();
        assert_says(&said, &["run.mcap", "encoder angles", "`ref_qw`", "`segment`", "`note`", "write CSV"]);
        assert!(read(&path, &["imu=/imu/data_raw", "mag=none", "temp=none"]).reference.is_none());
    }

    #[test]
    fn what_messages_cannot_say_is_refused_and_nothing_is_left() {
        let (folder, path) = bench();
        let refused = |change: &dyn Fn(&mut Recording)| {
            let mut recording = full();
            change(&mut recording);
            recording.write(&path).unwrap_err().to_string()
        };
        let counts = refused(&|recording| {
            recording.manifest.units.mag = Unit::Arbitrary;
            recording.mag.as_mut().unwrap().unit = Unit::Arbitrary;
        });
        assert_says(&counts, &["run.mcap", "mag in a.u.", "imucal apply", "write CSV"]);
        let early = refused(&|recording| {
            recording.epoch = None;
            recording.time = vec![-0.5, 0.0, 0.5];
        });
        assert_says(&early, &["run.mcap, row 1, column `t`", "-0.5 s", "0 to 2^31 s"]);
        let fine = refused(&|recording| recording.time = vec![0.0, 1e-10, 0.5]);
        assert_says(&fine, &["run.mcap, row 2, column `t`", "a nanosecond or more"]);
        let bag = full().write(&folder.path().join("run.bag")).unwrap_err().to_string();
        assert_says(&bag, &["run.bag", "`.bag`", "or .mcap"]);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}

//! Robots' logs: topics to the columns of a recording.
//!
//! | role | messages | columns |
//! | --- | --- | --- |
//! | `imu` | `sensor_msgs/Imu` | `acc_*`, `gyr_*` |
//! | `mag` | `sensor_msgs/MagneticField`, T | `mag_*`, µT |
//! | `temp` | `sensor_msgs/Temperature` | `temp` |
//! | `ref` | poses and odometry; the attitude of a `sensor_msgs/Imu` | `ref_q*`, `ref_p*`, by `z_up` |

use std::path::Path;

use imucal_logs::{Kind, Log, LogError, Stream, files_of, is_bag_folder};

use super::{
    columns::{POSITION, REFERENCE, TEMPERATURE, Table, slot_of},
    joined::{Series, join},
    z_up,
};
use crate::{
    file::{Limits, limits::Size},
    recording::{
        log_topics::{LogTopics, Role, TopicLine},
        read_error::ReadError,
        sensor_kind::SensorKind,
        unit::MICROTESLA_PER_TESLA,
        warning::Warning,
    },
};

/// A frame of which the z axis points down already ends so (REP 103).
pub(crate) const DOWN: &str = "_ned";

/// Reads the topics that are asked for, or those that there is no choice of. A field whose unit is `stated` elsewhere is left as the
/// log has it.
pub(crate) fn read(
    path: &Path,
    topics: &LogTopics,
    field_is_stated: bool,
    limits: &Limits,
) -> Result<Table, ReadError> {
    let log = Log::open(path, limits.size).map_err(|error| explained(error, limits))?;
    let lines = lines(&log);
    let fault = |fault| ReadError::Topics { path: path.to_path_buf(), fault: Box::new(fault) };
    let choice = topics.choose(&lines).map_err(fault)?;
    let mut warnings: Vec<Warning> = part_of(path).into_iter().collect();
    if !choice.unasked.is_empty() {
        let described = |(role, line): &(Role, TopicLine)| format!("{} as {}", line.described(), role.name());
        let taken = choice.unasked.iter().map(described).collect::<Vec<_>>().join(", ");
        let path = path.to_path_buf();
        warnings.push(Warning::TopicsTaken { path, taken, references: choice.references });
    }
    let mut names: Vec<&str> = choice.taken.iter().map(|(_, name)| name.as_str()).collect();
    // A simulator's attitude may stand in the messages of its sensors.
    names.sort_unstable();
    names.dedup();
    let reading = log.read(&names).map_err(|error| explained(error, limits))?;
    let of_log =
        |found: &imucal_logs::LogWarning| Warning::Log { path: path.to_path_buf(), found: found.to_string() };
    warnings.extend(reading.warnings.iter().map(of_log));
    let of_role = |(role, name): &(Role, String)| {
        let stream = reading.streams.iter().find(|stream| stream.topic == *name)?;
        Some(series(*role, stream, field_is_stated))
    };
    let series: Vec<Series> = choice.taken.iter().filter_map(of_role).collect();
    drop(reading);
    let mut table = join(path, series, limits)?;
    table.warnings.splice(0..0, warnings);
    Ok(table)
}

/// A file that is one of several of a bag.
fn part_of(path: &Path) -> Option<Warning> {
    let folder = path.parent().filter(|folder| is_bag_folder(folder))?;
    let files =
        files_of(folder).ok().filter(|files| files.len() > 1 && files.iter().any(|file| file == path))?;
    let here = Path::new(".");
    let (count, folder) = (files.len(), if folder.as_os_str().is_empty() { here } else { folder }.display());
    let found = format!("one of the {count} files of a bag; give the folder {folder} to read all of them");
    Some(Warning::Log { path: path.to_path_buf(), found })
}

fn explained(error: LogError, limits: &Limits) -> ReadError {
    let limit = Size(limits.size);
    match error {
        LogError::TooMany { path, .. } => ReadError::TooManySamples { path, limit },
        LogError::TooLarge { path, .. } => ReadError::TooLong { path, limit },
        error => ReadError::Log(Box::new(error)),
    }
}

fn lines(log: &Log) -> Vec<TopicLine> {
    let line = |topic: &imucal_logs::Topic| TopicLine {
        name: topic.name.clone(),
        type_name: topic.type_name.clone(),
        count: topic.count,
        roles: match &topic.kind {
            Ok(Kind::Imu) => Ok(vec![Role::Imu, Role::Reference]),
            Ok(Kind::MagneticField) => Ok(vec![Role::Mag]),
            Ok(Kind::Temperature) => Ok(vec![Role::Temperature]),
            Ok(Kind::Pose) => Ok(vec![Role::Reference]),
            Err(imucal_logs::Refusal::Type { .. }) => Ok(Vec::new()),
            Err(why) => Err(why.to_string()),
        },
    };
    log.topics().iter().map(line).collect()
}

/// The columns of a topic.
fn series(role: Role, stream: &Stream, field_is_stated: bool) -> Series {
    let mut series = Series::new(stream.topic.clone(), stream.stamps_ns.clone());
    let width = stream.kind.columns().len();
    let column = |at: usize| -> Vec<f64> { stream.values.iter().skip(at).step_by(width).copied().collect() };
    let columns = |first: usize, count: usize| (first..first + count).map(column).collect::<Vec<_>>();
    match (role, stream.kind) {
        (Role::Imu, _) => {
            series.add(slot_of(SensorKind::Acc), columns(0, 3));
            series.add(slot_of(SensorKind::Gyr), columns(3, 3));
        }
        (Role::Mag, _) => {
            let scale = if field_is_stated { 1.0 } else { MICROTESLA_PER_TESLA };
            let mut field = columns(0, 3);
            field.iter_mut().flatten().for_each(|value| *value *= scale);
            series.add(slot_of(SensorKind::Mag), field);
        }
        (Role::Temperature, _) => series.add(TEMPERATURE, columns(0, 1)),
        (Role::Reference, Kind::Imu) => series.add(REFERENCE, z_up::attitudes(&columns(6, 4))),
        (Role::Reference, _) => {
            let (position, attitude) = (columns(0, 3), columns(3, 4));
            let down = stream.frame.ends_with(DOWN);
            series.add(REFERENCE, if down { attitude } else { z_up::attitudes(&attitude) });
            series.add(POSITION, if down { position } else { z_up::positions(&position) });
        }
    }
    series
}

#[cfg(test)]
mod tests {
    use std::{ops::ControlFlow, path::PathBuf};

    use super::*;
    use crate::recording::{Mapping, Recording, Source, fixture::assert_says};

    fn fixture(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("logs/tests/fixtures").join(name)
    }

    fn read_topics(name: &str, topics: &[&str], units: &[&str]) -> Result<Recording, String> {
        let owned = |texts: &[&str]| texts.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>();
        let mapping =
            Mapping::parse(&[], &owned(units), None).and_then(|all| all.with_topics(&owned(topics)));
        let mapping = mapping.expect("a mapping");
        Recording::read_as(&fixture(name), &mapping, &Limits::default()).map_err(|error| error.to_string())
    }

    #[test]
    fn each_topic_fills_its_columns_in_units_of_a_recording() {
        for name in ["ros2-zstd.mcap", "bz2.bag"] {
            let recording = read_topics(name, &["ref=/vicon/pose"], &[]).unwrap();
            assert_eq!((recording.rows(), recording.time[39]), (40, 0.39));
            assert_eq!(recording.epoch.unwrap().picoseconds(), 1_700_000_000_123_456_789_000);
            assert_eq!(recording.acc.unwrap().values[3].as_slice(), [0.75, -0.5, 9.75]);
            assert_eq!(recording.gyr.unwrap().values[2].as_slice(), [0.25, -0.5, 0.5]);
            let mag = recording.mag.unwrap().values;
            assert!(mag[1].x.is_nan() && (mag[4] - nalgebra::Vector3::new(20.0, 4.0, -40.0)).norm() < 1e-12);
            let warm = recording.temperature.unwrap();
            assert!((warm[0], warm[30]) == (20.0, 50.0) && warm[1].is_nan());
            assert_eq!(recording.position.unwrap()[6], [2.0, 3.0, -3.0]);
            let texts: Vec<String> = recording.warnings.iter().map(ToString::to_string).collect();
            assert_says(&texts.join("\n"), &["took /imu/data (sensor_msgs", "as imu", "as mag", "as temp"]);
            assert!(!texts.iter().any(|text| text.contains("does not state")), "{texts:?}");
        }
    }

    #[test]
    fn the_attitude_of_a_simulated_sensor_may_be_the_reference() {
        let topics = ["imu=/imu/data", "ref=/imu/data", "mag=none", "temp=none"];
        let recording = read_topics("lz4.bag", &topics, &[]).unwrap();
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let attitude = recording.reference.unwrap();
        let expected = [0.0, half * 1.4, half * 0.2, 0.0];
        assert!(attitude[0].iter().zip(expected).all(|(found, part)| (found - part).abs() < 1e-15));
        assert!(attitude[1][0].is_nan() && recording.position.is_none() && recording.mag.is_none());
    }

    #[test]
    fn a_field_in_a_unit_of_its_own_is_left_as_it_is() {
        let recording = read_topics("none.bag", &["imu=/imu/data", "mag=/imu/mag"], &["mag=uT"]).unwrap();
        assert_eq!(recording.mag.unwrap().values[0].x, 2e-5);
        let texts: Vec<String> = recording.warnings.iter().map(ToString::to_string).collect();
        assert_says(&texts.join("\n"), &["none.bag, sensor mag: uT is stated", "ROS are in T"]);
        let folder = tempfile::tempdir().unwrap();
        let bag = folder.path().join("none.bag");
        std::fs::copy(fixture("none.bag"), &bag).unwrap();
        for (units, expected) in [("mag = \"uT\"", 2e-5), ("acc = \"m/s^2\"", 20.0)] {
            let manifest = format!("format = \"imucal-recording/1\"\n[units]\n{units}\n");
            std::fs::write(folder.path().join("none.toml"), manifest).unwrap();
            let recording = Recording::read(&bag).unwrap();
            let found = recording.mag.unwrap().values[0].x;
            assert!((found / expected - 1.0).abs() < 1e-12, "{units}: {found}");
        }
        let error = read_topics("none.bag", &["imu=/imu/data"], &["acc=g"]).unwrap_err();
        assert_says(&error, &["m/s^2", "the median length"]);
    }

    #[test]
    fn a_log_is_one_part_and_a_long_one_is_refused() {
        let mapping = Mapping::default().with_topics(&["imu=/imu/data".to_owned()]).unwrap();
        let mut lengths = Vec::new();
        let path = fixture("ros2-lz4.mcap");
        let limits = Limits::default();
        let source = Source { path: &path, mapping: &mapping, manifest: None, limits: &limits };
        Recording::read_parts(source, &mut |part| {
            lengths.push(part.rows());
            ControlFlow::Continue(())
        })
        .unwrap();
        assert_eq!(lengths, [40]);
        let limits = Limits { size: 3_000, ..Limits::default() };
        let error = Recording::read_as(&path, &mapping, &limits).unwrap_err().to_string();
        assert_says(&error, &["ros2-lz4.mcap", "--max-size"]);
    }
}

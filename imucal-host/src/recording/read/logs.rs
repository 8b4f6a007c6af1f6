//! Robots' logs: topics to the columns of a recording.
//!
//! | role | messages | columns |
//! | --- | --- | --- |
//! | `imu` | `sensor_msgs/Imu` | `acc_*`, `gyr_*` |
//! | `mag` | `sensor_msgs/MagneticField`, T | `mag_*`, µT |
//! | `temp` | `sensor_msgs/Temperature` | `temp` |
//! | `ref` | poses and odometry; the attitude of a `sensor_msgs/Imu` | `ref_q*`, `ref_p*`, by [`z_up`] |

use std::path::Path;

use imucal_logs::{Kind, Log, LogError, Stream};

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
const DOWN: &str = "_ned";

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
    let mut warnings = Vec::new();
    if !choice.unasked.is_empty() {
        let told = |(role, line): &(Role, TopicLine)| format!("{} as {}", line.told(), role.name());
        let taken = choice.unasked.iter().map(told).collect::<Vec<_>>().join(", ");
        let path = path.to_path_buf();
        warnings.push(Warning::TopicsTaken { path, taken, references: choice.references });
    }
    let names: Vec<&str> = choice.taken.iter().map(|(_, name)| name.as_str()).collect();
    let reading = log.read(&names).map_err(|error| explained(error, limits))?;
    let of_log =
        |found: &imucal_logs::LogWarning| Warning::Log { path: path.to_path_buf(), found: found.to_string() };
    warnings.extend(reading.warnings.iter().map(of_log));
    let all = choice.taken.iter().zip(&reading.streams);
    let series: Vec<Series> = all.map(|((role, _), stream)| series(*role, stream, field_is_stated)).collect();
    let mut table = join(path, &series, limits)?;
    table.warnings.splice(0..0, warnings);
    Ok(table)
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

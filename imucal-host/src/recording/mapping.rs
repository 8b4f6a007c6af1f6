//! The columns of another program's file, by the names that a recording has for them; the topics of a log.

use std::path::Path;

use super::{
    format::Format,
    log_topics::LogTopics,
    manifest::{Counts, Manifest},
    read::{column_guess::unit_behind, columns::NAMES},
    sensor_kind::SensorKind,
    unit::{TimeUnit, Unit},
};

/// What may be mapped: a name, and the columns of a recording that it stands for.
const QUANTITIES: [(&str, &[&str]); 12] = [
    ("acc", &["acc_x", "acc_y", "acc_z"]),
    ("gyr", &["gyr_x", "gyr_y", "gyr_z"]),
    ("mag", &["mag_x", "mag_y", "mag_z"]),
    ("temp", &["temp"]),
    ("segment", &["segment"]),
    ("gimbal", &["gimbal_outer", "gimbal_middle", "gimbal_inner"]),
    ("ref_q", &["ref_qw", "ref_qx", "ref_qy", "ref_qz"]),
    ("ref_p", &["ref_px", "ref_py", "ref_pz"]),
    ("sim_acc", &["sim_acc_x", "sim_acc_y", "sim_acc_z"]),
    ("sim_gyr", &["sim_gyr_x", "sim_gyr_y", "sim_gyr_z"]),
    ("sim_mag", &["sim_mag_x", "sim_mag_y", "sim_mag_z"]),
    ("sim_temp", &["sim_temp"]),
];

/// A mapping that contradicts itself or the file; its text says what was found, what was expected and what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)] // The fields are those of each message.
pub enum MappingFault {
    /// Not of the form `NAME=VALUE`.
    #[error("--{option}: found `{found}`, expected {expected}; write it so")]
    Form { option: &'static str, found: String, expected: &'static str },
    /// A quantity that no recording has.
    #[error("--{option}: found the quantity `{found}`, expected one of {expected}; write it exactly so")]
    Quantity { option: &'static str, found: String, expected: String },
    /// Too many or too few columns.
    #[error("--map {quantity}: found {found} columns, expected {expected}: {names}; name each of them once")]
    Count { quantity: &'static str, found: usize, expected: usize, names: String },
    /// A quantity, or a column of the file, that is mapped twice.
    #[error("found `{what}` mapped twice, expected once; remove one")]
    Twice { what: String },
    /// A unit that the quantity has not.
    #[error(
        "--unit {quantity}: found `{found}`, expected {expected}, or counts of one of them such as `16384/g`; write it exactly so"
    )]
    Unit { quantity: String, found: String, expected: String },
    /// A column that the file has not.
    #[error("found no column `{column}`, expected it since it is mapped; the file has {names}")]
    Absent { column: String, names: String },
    /// A column of the file that has the name which another one is mapped to.
    #[error(
        "found a column `{name}` in the file, and another one that is mapped to it; leave the mapping out, or rename the column"
    )]
    Taken { name: &'static str },
}

/// Columns of a file by the names of a recording, or topics of a log, and their units. Empty: the file is a recording, or a log of
/// which there is nothing to choose.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mapping {
    /// Name in the file, and in a recording.
    columns: Vec<(String, &'static str)>,
    units: Vec<(SensorKind, Stated)>,
    time: Option<TimeUnit>,
    pub(super) topics: LogTopics,
}

/// How a sensor's columns are stated.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stated {
    In(Unit),
    /// Counts of each m/s², rad/s or µT.
    Counts(f64),
}

impl Mapping {
    /// Understands `acc=ax,ay,az`, `acc=g` or `acc=16384/g` or `t=ms`, and the name of the column of times, whose ending says
    /// their unit where nothing else does (`timestamp_ms`).
    ///
    /// # Errors
    ///
    /// The first fault found.
    pub fn parse(map: &[String], units: &[String], time: Option<&str>) -> Result<Self, MappingFault> {
        let mut mapping = Self::default();
        if let Some(name) = time {
            mapping.add(name, "t")?;
            mapping.time = unit_of_time(name);
        }
        for text in map {
            mapping.map(text)?;
        }
        for text in units {
            mapping.state(text)?;
        }
        Ok(mapping)
    }

    /// The same with topics of a log, such as `imu=/imu/data`; `mag=none` leaves one out.
    ///
    /// # Errors
    ///
    /// The first fault found.
    pub fn with_topics(mut self, topics: &[String]) -> Result<Self, MappingFault> {
        self.topics = LogTopics::parse(topics)?;
        Ok(self)
    }

    /// How a simulator's file is read as its stream: of a log the topic alone and nothing that others have recorded; of other
    /// files everything, and the topic is left to [`Stream::chosen`](super::Stream::chosen).
    ///
    /// # Errors
    ///
    /// As [`Mapping::with_topics`].
    pub fn of_stream<'a>(
        path: &Path,
        topic: Option<&'a str>,
    ) -> Result<(Self, Option<&'a str>), MappingFault> {
        if Format::of(path) != Ok(Format::Log) {
            return Ok((Self::default(), topic));
        }
        let imu = topic.map(|topic| format!("imu={topic}"));
        let options: Vec<String> =
            imu.into_iter().chain(["mag=none".to_owned(), "temp=none".to_owned()]).collect();
        Ok((Self::default().with_topics(&options)?, None))
    }

    /// Columns are named.
    pub(super) fn has_columns(&self) -> bool {
        !self.columns.is_empty()
    }

    /// A sensor's unit is stated.
    pub(super) fn states(&self, kind: SensorKind) -> bool {
        self.units.iter().any(|(other, _)| *other == kind)
    }

    /// Nothing is mapped.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    fn map(&mut self, text: &str) -> Result<(), MappingFault> {
        let (name, columns) = split("map", text, "such as acc=ax,ay,az")?;
        let quantity = QUANTITIES.iter().find(|(known, _)| *known == name);
        let Some((quantity, known)) = quantity else {
            let expected = listed(QUANTITIES.iter().map(|(name, _)| *name));
            return Err(MappingFault::Quantity { option: "map", found: name.to_owned(), expected });
        };
        let found: Vec<&str> = columns.split(',').map(str::trim).collect();
        if found.len() != known.len() || found.iter().any(|name| name.is_empty()) {
            let names = listed(known.iter().copied());
            return Err(MappingFault::Count { quantity, found: found.len(), expected: known.len(), names });
        }
        found.into_iter().zip(*known).try_for_each(|(file, known)| self.add(file, known))
    }

    fn add(&mut self, file: &str, known: &str) -> Result<(), MappingFault> {
        let Some(known) = NAMES.into_iter().find(|name| *name == known) else { return Ok(()) };
        if self.columns.iter().any(|(_, other)| *other == known) {
            return Err(MappingFault::Twice { what: known.to_owned() });
        }
        let file = file.trim();
        if self.columns.iter().any(|(other, _)| other == file) {
            return Err(MappingFault::Twice { what: file.to_owned() });
        }
        self.columns.push((file.to_owned(), known));
        Ok(())
    }

    fn state(&mut self, text: &str) -> Result<(), MappingFault> {
        let (name, unit) = split("unit", text, "such as acc=g")?;
        if name == "t" {
            let bad = |expected| MappingFault::Unit { quantity: name.into(), found: unit.into(), expected };
            let parsed = TimeUnit::try_from(unit.to_owned());
            self.time = Some(parsed.map_err(|unknown| bad(unknown.expected))?);
            return Ok(());
        }
        let Some(kind) = SensorKind::ALL.into_iter().find(|kind| kind.to_string() == name) else {
            let expected = "acc, gyr, mag, t".to_owned();
            return Err(MappingFault::Quantity { option: "unit", found: name.to_owned(), expected });
        };
        if self.units.iter().any(|(other, _)| *other == kind) {
            return Err(MappingFault::Twice { what: name.to_owned() });
        }
        let stated = stated(kind, unit).ok_or_else(|| MappingFault::Unit {
            quantity: name.to_owned(),
            found: unit.to_owned(),
            expected: Unit::list(kind),
        })?;
        self.units.push((kind, stated));
        Ok(())
    }

    /// The names of a file's header as a recording has them.
    pub(crate) fn renamed(&self, names: &[&str]) -> Result<Vec<String>, MappingFault> {
        let mut renamed: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        for (file, known) in &self.columns {
            let Some(at) = names.iter().position(|name| name.trim() == file) else {
                let names = listed(names.iter().map(|name| name.trim()));
                return Err(MappingFault::Absent { column: file.clone(), names });
            };
            if names.iter().enumerate().any(|(other, name)| other != at && name.trim() == *known) {
                return Err(MappingFault::Taken { name: known });
            }
            renamed[at] = (*known).to_owned();
        }
        Ok(renamed)
    }

    /// The manifest with the units stated here.
    pub(crate) fn over(&self, mut manifest: Manifest) -> Manifest {
        if let Some(unit) = self.time {
            manifest.units.t = unit;
        }
        for (kind, stated) in &self.units {
            let (unit, counts) = match stated {
                Stated::In(unit) => (*unit, None),
                Stated::Counts(per_unit) => (Unit::Counts, Some(Counts { offset: 0.0, per_unit: *per_unit })),
            };
            let (of, place) = match kind {
                SensorKind::Acc => (&mut manifest.units.acc, &mut manifest.counts.acc),
                SensorKind::Gyr => (&mut manifest.units.gyr, &mut manifest.counts.gyr),
                SensorKind::Mag => (&mut manifest.units.mag, &mut manifest.counts.mag),
            };
            *of = unit;
            *place = counts.or(*place);
        }
        manifest
    }

    /// The sensors and the time whose units are not stated here.
    pub(crate) fn unstated(&self) -> Vec<(&'static str, String)> {
        let units = Manifest::default().units;
        let first = |kind: SensorKind| QUANTITIES[kind as usize].1[0];
        let is_mapped = |kind: SensorKind| self.columns.iter().any(|(_, known)| *known == first(kind));
        let sensors = SensorKind::ALL.into_iter().filter(|kind| is_mapped(*kind) && !self.states(*kind));
        let mut all: Vec<(&'static str, String)> =
            sensors.map(|kind| (QUANTITIES[kind as usize].0, units.of(kind).to_string())).collect();
        if self.time.is_none() {
            all.push(("t", units.t.to_string()));
        }
        all
    }
}

fn split<'a>(
    option: &'static str,
    text: &'a str,
    expected: &'static str,
) -> Result<(&'a str, &'a str), MappingFault> {
    let parts = text.split_once('=').map(|(name, value)| (name.trim(), value.trim()));
    parts.filter(|(name, value)| !name.is_empty() && !value.is_empty()).ok_or_else(|| MappingFault::Form {
        option,
        found: text.to_owned(),
        expected,
    })
}

/// `g`, or counts of one such as `16384/g` and `16.4/deg/s`.
fn stated(kind: SensorKind, text: &str) -> Option<Stated> {
    let unit = |text: &str| text.parse::<Unit>().ok().filter(|unit| Unit::of(kind).contains(unit));
    if let Some(unit) = unit(text) {
        return Some(Stated::In(unit));
    }
    let (number, of) = text.split_once('/')?;
    let number: f64 = number.trim().parse().ok().filter(|n: &f64| n.is_finite() && *n != 0.0)?;
    Some(Stated::Counts(number * unit(of.trim())?.per_si()?))
}

/// The columns of a recording that a quantity has.
pub(crate) fn names_of(quantity: &str) -> Option<&'static [&'static str]> {
    QUANTITIES.iter().find(|(known, _)| *known == quantity).map(|(_, names)| *names)
}

/// The unit of times that stands behind a column's name, such as `timestamp_ms`, `time [s]` or `t(us)`.
pub(crate) fn unit_of_time(name: &str) -> Option<TimeUnit> {
    TimeUnit::try_from(unit_behind("t", name)?.to_owned()).ok()
}

fn listed<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<String> = names.map(|name| format!("`{name}`")).collect();
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        file::Limits,
        recording::{Recording, fixture::assert_says},
    };

    fn mapping(map: &[&str], units: &[&str], time: Option<&str>) -> Result<Mapping, MappingFault> {
        let owned = |texts: &[&str]| texts.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>();
        Mapping::parse(&owned(map), &owned(units), time)
    }

    fn read(text: &str, mapping: &Mapping) -> Result<Recording, String> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("log.csv");
        std::fs::write(&path, text).expect("room");
        Recording::read_as(&path, mapping, &Limits::default()).map_err(|error| error.to_string())
    }

    const MAP: [&str; 2] = ["acc=ax,ay,az", "gyr=gx, gy, gz"];

    #[test]
    fn a_log_in_g_and_degrees_with_other_names_is_a_recording_in_si() {
        let text = "timestamp_ms,ax,ay,az,gx,gy,gz,note\n1000,0,0,1,180,0,0,a\n1010,0,0,-1,0,90,0,b\n";
        let mapping = mapping(&MAP, &["acc=g", "gyr=deg/s"], Some("timestamp_ms")).expect("a mapping");
        let recording = read(text, &mapping).expect("it reads");
        assert_eq!(recording.time, [1.0, 1.01]);
        assert_eq!(recording.acc.expect("mapped").values[1].z, -9.80665);
        assert!((recording.gyr.expect("mapped").values[0].x - std::f64::consts::PI).abs() < 1e-15);
        assert_eq!(recording.extra[0].values, ["a", "b"]);
        assert_eq!(recording.manifest.units.acc, Unit::Gravity);
    }

    #[test]
    fn counts_are_stated_by_how_many_make_a_unit() {
        let text = "t,ax,ay,az\n0,0,0,16384\n0.01,0,16384,0\n";
        let mapping = mapping(&["acc=ax,ay,az"], &["acc=16384/g"], None).expect("a mapping");
        let acc = read(text, &mapping).expect("it reads").acc.expect("mapped");
        assert_eq!((acc.values[0].z, acc.unit), (9.80665, Unit::Counts));
        let per_unit = 16.4 * 180.0 / std::f64::consts::PI;
        let found = stated(SensorKind::Gyr, "16.4/deg/s");
        assert!(
            matches!(found, Some(Stated::Counts(counts)) if (counts / per_unit - 1.0).abs() < 1e-15),
            "{found:?}"
        );
    }

    #[test]
    fn semicolons_tabs_and_bars_separate_and_a_comma_is_the_decimal_point_of_such_a_file() {
        let mapping = mapping(&["acc=ax,ay,az"], &["acc=m/s^2"], Some("Time [s]")).expect("a mapping");
        for text in [
            "Time [s];ax;ay;az\n0,5;0;-1,25;9,5\n0,51;0;1;9\n",
            "Time [s]\tax\tay\taz\n0.5\t0\t-1.25\t9.5\n0.51\t0\t1\t9\n",
            "Time [s] | ax | ay | az\n0.5 | 0 | -1,25 | 9.5\n0.51 | 0 | 1 | 9\n",
        ] {
            let recording = read(text, &mapping).expect("it reads");
            assert_eq!(recording.time, [0.5, 0.51]);
            assert_eq!(recording.acc.expect("mapped").values[0], nalgebra::Vector3::new(0.0, -1.25, 9.5));
        }
    }

    #[test]
    fn units_that_are_not_stated_are_warned_of() {
        let text = "t,ax,ay,az\n0,0,0,9.8\n0.01,0,0,9.8\n";
        let recording =
            read(text, &mapping(&["acc=ax,ay,az"], &[], None).expect("a mapping")).expect("it reads");
        let warnings: Vec<String> = recording.warnings.iter().map(ToString::to_string).collect();
        assert!(warnings.iter().any(|warning| warning.contains("m/s^2")), "{warnings:?}");
    }

    #[test]
    fn a_unit_that_contradicts_the_numbers_is_refused() {
        let text = "t,ax,ay,az\n0,0,0,9.8\n0.01,0,9.8,0\n";
        let error =
            read(text, &mapping(&["acc=ax,ay,az"], &["acc=g"], None).expect("a mapping")).unwrap_err();
        assert_says(&error, &["96.1", "m/s^2"]);
    }

    #[test]
    fn what_is_wrong_with_a_mapping_is_said_with_what_was_expected() {
        let fault = |map: &[&str], units: &[&str]| mapping(map, units, None).unwrap_err().to_string();
        assert_says(&fault(&["acc"], &[]), &["--map", "`acc`", "acc=ax,ay,az"]);
        assert_says(&fault(&["accel=a,b,c"], &[]), &["`accel`", "`acc`, `gyr`"]);
        assert_says(&fault(&["acc=a,b"], &[]), &["found 2 columns, expected 3"]);
        assert_says(&fault(&["acc=a,b,b"], &[]), &["`b` mapped twice"]);
        assert_says(&fault(&["acc=a,b,c", "acc=d,e,f"], &[]), &["`acc_x` mapped twice"]);
        assert_says(&fault(&[], &["acc=deg/s"]), &["--unit acc", "m/s^2, g, mg"]);
        assert_says(&fault(&[], &["acc=g", "acc=mg"]), &["`acc` mapped twice"]);
        assert_says(&fault(&[], &["acc=0/g"]), &["`0/g`"]);
        assert_says(&fault(&[], &["t=minutes"]), &["`minutes`", "ms"]);
        let absent = read("t,ax,ay,az\n0,0,0,1\n", &mapping(&["acc=ax,ay,aw"], &[], None).expect("one"));
        assert_says(&absent.unwrap_err(), &["log.csv", "no column `aw`", "`ax`, `ay`, `az`"]);
        let taken =
            read("t,ax,ay,az,acc_x\n0,0,0,1,1\n", &mapping(&["acc=ax,ay,az"], &[], None).expect("one"));
        assert_says(&taken.unwrap_err(), &["`acc_x`", "another one that is mapped to it"]);
    }
}

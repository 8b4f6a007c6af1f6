//! What a reader noticed that is worth telling but stops nothing.

use std::path::PathBuf;

use super::{
    place::{Place, at_line},
    sensor_kind::SensorKind,
    unit::{TimeUnit, Unit},
};

/// Something noticed while reading; its text names the file, the place, what was found and what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Warning {
    /// A column the contract does not know.
    #[error(
        "{path}{}, column `{column}`: not a column of a recording; kept as it is and not used (rename it if it is meant as one)",
        at_line(.line)
    )]
    UnknownColumn {
        /// Samples file.
        path: PathBuf,
        /// Line of the header, where the file has lines.
        line: Option<u64>,
        /// Name in the header.
        column: String,
    },
    /// A key of the manifest the contract does not know.
    #[error("{path}, line {line}: unknown key `{key}` is ignored; {}", suggest(.nearest))]
    UnknownKey {
        /// Manifest.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Key with its section.
        key: String,
        /// The key probably meant.
        nearest: Option<String>,
    },
    /// Comments before the header.
    #[error("{path}: comments before the header were passed over (lines that begin with # or %: {lines})")]
    Comments {
        /// Samples file.
        path: PathBuf,
        /// How many.
        lines: u64,
    },
    /// The last line was cut and has been dropped.
    #[error(
        "{path}, {place}: the last line is cut (found {found} of {expected} whole fields and no line end) and was dropped; record or copy the file again if more than a sample is missing"
    )]
    TruncatedLine {
        /// Samples file.
        path: PathBuf,
        /// The dropped line.
        place: Place,
        /// Whole fields found.
        found: usize,
        /// Fields of the header.
        expected: usize,
    },
    /// The last line is complete but has no line end, so that its last field may be cut.
    #[error(
        "{path}, {place}: the last line has no line end; it was kept, but its last field `{found}` (column `{column}`) may be cut; end the file with a line end"
    )]
    UnterminatedLine {
        /// Samples file.
        path: PathBuf,
        /// The last line.
        place: Place,
        /// Its last column.
        column: String,
        /// That column's text.
        found: String,
    },
    /// The compressed stream ends early; the whole rows before were kept.
    #[error(
        "{path}: the gzip stream ends early; {rows} whole rows were kept; copy the file again to have the rest"
    )]
    TruncatedStream {
        /// Samples file.
        path: PathBuf,
        /// Rows kept.
        rows: usize,
    },
    /// The samples' size is unusual for the sensor, and no other unit explains it.
    #[error(
        "{path}, from {from} on, sensor {sensor}: the median length is {found:.4} {si} when read as `{unit}`, expected {expected}; check {key} in the manifest"
    )]
    SizeUnusual {
        /// Samples file.
        path: PathBuf,
        /// First of the samples.
        from: Place,
        /// The sensor.
        sensor: SensorKind,
        /// Its unit in the manifest.
        unit: Unit,
        /// Median length on the SI side.
        found: f64,
        /// `m/s²`, `rad/s` or `µT`.
        si: &'static str,
        /// What is usual.
        expected: String,
        /// Key of the manifest to look at.
        key: String,
    },
    /// The samples' interval is unusual, which a wrong unit of `t` causes.
    #[error(
        "{path}, from {from} on, column `t`: the median interval is {found:e} s when read as `{unit}`, expected 2.5e-5 to 2 s; check t of [units] in the manifest"
    )]
    IntervalUnusual {
        /// Samples file.
        path: PathBuf,
        /// First of the rows.
        from: Place,
        /// Unit of `t`.
        unit: TimeUnit,
        /// Median interval, s.
        found: f64,
    },
    /// A gyroscope faster than any, which a wrong unit causes.
    #[error(
        "{path}, from {from} on, sensor gyr: one sample in two hundred is faster than {found:.0} rad/s when read as `{unit}`, expected below 70 rad/s (4000 °/s); {remedy}"
    )]
    RateUnusual {
        /// Samples file.
        path: PathBuf,
        /// First of the samples.
        from: Place,
        /// The gyroscope's unit.
        unit: Unit,
        /// The rate, rad/s.
        found: f64,
        /// What to look at.
        remedy: String,
    },
    /// Units that the manifest leaves out.
    #[error(
        "{path}{}: [units] does not state all units; assumed: {}; write those that the file is in",
        at_line(.line),
        units(.assumed)
    )]
    UnitsAssumed {
        /// Manifest.
        path: PathBuf,
        /// Line of its section, if there is one.
        line: Option<usize>,
        /// Each key with the unit that is taken for it.
        assumed: Vec<(&'static str, String)>,
    },
    /// Samples that no sensor can have measured; taken for missing.
    #[error(
        "{path}, {place}, column `{column}`: {found:.3e} {unit} found ({more} more like it), which no sensor measures; taken for not measured; correct it if a digit or a decimal point was lost"
    )]
    Absurd {
        /// Samples file.
        path: PathBuf,
        /// The first of them.
        place: Place,
        /// Its column.
        column: String,
        /// Its value, as the file has it.
        found: f64,
        /// Unit of the file.
        unit: Unit,
        /// How many others there are in the column.
        more: usize,
    },
    /// A position of the reference without an attitude.
    #[error(
        "{path}{}, column `ref_px`: a position without an attitude is kept and not used; add ref_qw, ref_qx, ref_qy, ref_qz of the same body",
        at_line(.line)
    )]
    PositionAlone {
        /// Samples file.
        path: PathBuf,
        /// Line of the header, where the file has lines.
        line: Option<u64>,
    },
    /// A rig's axes without the angles about them.
    #[error(
        "{path}{}: [rig] of the manifest gives axes, but the columns `gimbal_outer`, `gimbal_middle` and `gimbal_inner`, which hold the angles about them, are missing; the recording is used as one without a rig; add the columns, or delete axes of [rig]",
        at_line(.line)
    )]
    RigWithoutAngles {
        /// Samples file.
        path: PathBuf,
        /// Line of the header, where the file has lines.
        line: Option<u64>,
    },
    /// Variables of a MAT-file that are no columns of samples.
    #[error(
        "{path}: left out {}, expected numbers in {rows} rows{}", listed(.others), unpacked(.others)
    )]
    LeftOut {
        /// The MAT-file.
        path: PathBuf,
        /// Rows of the times, or of most columns.
        rows: usize,
        /// Each with what it is.
        others: Vec<String>,
    },
    /// Columns of a Parquet file whose values have no text.
    #[error("{path}: left out {}, expected one number or text in a row", listed(.columns))]
    NotOneValue {
        /// The Parquet file.
        path: PathBuf,
        /// Each with its type.
        columns: Vec<String>,
    },
    /// Columns that the messages of a log do not hold.
    #[error(
        "{path}: left out {}, which messages of sensors, temperatures and poses do not hold; write CSV or Parquet to keep all columns", .columns.join(", ")
    )]
    NotInLog {
        /// The log.
        path: PathBuf,
        /// Their names.
        columns: Vec<String>,
    },
    /// Something odd in a log.
    #[error("{path}: {found}")]
    Log {
        /// The log.
        path: PathBuf,
        /// What it is.
        found: String,
    },
    /// Topics that nobody has asked for.
    #[error("{path}: took {taken}, there being no other; choose with --topic{}", poses(.references))]
    TopicsTaken {
        /// The log.
        path: PathBuf,
        /// Each with its type, its number of messages and what it is taken for.
        taken: String,
        /// Topics that may be a reference, of which none is taken.
        references: Vec<String>,
    },
    /// Units that are not those of the messages.
    #[error(
        "{path}, sensor {sensor}: {unit} is stated, where messages of ROS are in {usual}; the numbers were taken as stated; leave the unit out if the driver keeps to ROS"
    )]
    UnitOfDriver {
        /// The log.
        path: PathBuf,
        /// The sensor.
        sensor: SensorKind,
        /// The stated unit.
        unit: Unit,
        /// That of the message.
        usual: &'static str,
    },
    /// A unit of times that the file does not have.
    #[error("{path}: t = \"{unit}\" is stated, where the stamps are in {found}; it was ignored")]
    UnitOfStamps {
        /// The file.
        path: PathBuf,
        /// The stated unit.
        unit: TimeUnit,
        /// That of the stamps.
        found: TimeUnit,
    },
    /// Samples that do not stand at the times of the rows.
    #[error(
        "{path}, `{series}`: {between} of {of} samples stand between the rows and were taken to the nearest one along a straight line (up to {farthest:.6} s; their noise looks smaller by that), and {left_out} without a row of their own were left out"
    )]
    Joined {
        /// The file.
        path: PathBuf,
        /// Topic or file of the samples.
        series: String,
        /// How many were taken to a row.
        between: usize,
        /// How many have none.
        left_out: usize,
        /// How many there are.
        of: usize,
        /// The longest way to a row, s.
        farthest: f64,
    },
    /// The file holds no sensor.
    #[error(
        "{path}{}: no sensor columns found, expected acc_x, acc_y, acc_z or those of gyr or mag; nothing can be calibrated from it",
        at_line(.line)
    )]
    NoSensor {
        /// Samples file.
        path: PathBuf,
        /// Line of the header, where the file has lines.
        line: Option<u64>,
    },
    /// The file holds a simulator's columns and no sensor; which is as it should be where a simulator's file is asked for.
    #[error(
        "{path}{}: a simulator's columns found and no sensor's; nothing can be calibrated from it, but a recording of the sensor can be compared with it: imucal diagnose RECORDING --sim {path}",
        at_line(.line)
    )]
    SimulatorAlone {
        /// Samples file.
        path: PathBuf,
        /// Line of the header, where the file has lines.
        line: Option<u64>,
    },
    /// Gravity of the site that no place on Earth has.
    #[error(
        "{path}, line {line}: gravity {found} m/s² found, expected 9.76 to 9.84 on Earth; correct it or leave it out and give latitude_deg and height_m"
    )]
    GravityUnusual {
        /// Manifest.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// The value, m/s².
        found: f64,
    },
}

impl Warning {
    /// Counts the samples of the same column in a later part with those of this one; false where it is another warning.
    pub(super) fn counted_with(&mut self, later: &Self) -> bool {
        match (self, later) {
            (Self::Absurd { column, more, .. }, Self::Absurd { column: same, more: others, .. })
                if column == same =>
            {
                *more += others + 1;
                true
            }
            _ => false,
        }
    }
}

fn units(assumed: &[(&'static str, String)]) -> String {
    assumed.iter().map(|(key, unit)| format!("{key} = \"{unit}\"")).collect::<Vec<_>>().join(", ")
}

/// Things that are named, at most.
const NAMED: usize = 8;

/// The first of things that are found, each as it is described.
pub(super) fn listed(others: &[String]) -> String {
    let named = others.iter().take(NAMED).cloned().collect::<Vec<_>>().join(", ");
    match others.len().saturating_sub(NAMED) {
        0 => named,
        more => format!("{named} and {more} more"),
    }
}

/// What to do with objects of MATLAB that hold samples.
fn unpacked(others: &[String]) -> &'static str {
    if others.iter().any(|other| other.ends_with("(timetable)") || other.ends_with("(table)")) {
        "; of a table T save `S = table2struct(T, \"ToScalar\", true)`, and of a timetable that of `timetable2table(T)`"
    } else if others.iter().any(|other| other.ends_with("(datetime)") || other.ends_with("(duration)")) {
        "; of times save `t = seconds(T - T(1))`"
    } else {
        ""
    }
}

fn poses(there: &[String]) -> String {
    match there {
        [] => String::new(),
        there => {
            format!("; a reference is only taken by --topic ref=TOPIC (poses are in {})", there.join(", "))
        }
    }
}

fn suggest(nearest: &Option<String>) -> String {
    match nearest {
        Some(key) => format!("write `{key}` if that is meant, or remove it"),
        None => "remove it".to_owned(),
    }
}

//! Files whose columns have other names than a recording's, and logs whose topics are to be chosen.

use std::path::Path;

use clap::Args;

use super::{progress::Progress, reading::Reading, warn};
use crate::{
    recording::{
        Mapping, ReadError, Recording,
        layout_guess::{guess, nameless},
    },
    report::layout,
};

/// What the columns of another program's file are, or which topics of a log are meant.
#[derive(Args, Clone, Debug)]
pub(super) struct Columns {
    /// Columns of a file with other names, in the order x, y, z, such as acc=ax,ay,az; also gyr, mag, temp, gimbal,
    /// ref_q, ref_p and sim_acc to sim_temp. Give it once for each
    #[arg(long, value_name = "SENSOR=COLUMNS", help_heading = "Another program's file")]
    map: Vec<String>,
    /// Units of the columns, such as acc=g,gyr=deg/s,t=ms; of counts how many make a unit: acc=16384/g
    #[arg(
        long = "unit",
        value_name = "SENSOR=UNIT",
        value_delimiter = ',',
        help_heading = "Another program's file"
    )]
    unit: Vec<String>,
    /// The column of times; its unit is stated by --unit t=ms, or by the end of its name (timestamp_ms)
    #[arg(long = "time", value_name = "COLUMN", help_heading = "Another program's file")]
    time: Option<String>,
    /// A topic of an MCAP file or a bag: imu=/imu/data, mag=, temp=, or ref= for a reference's poses; the only one of a
    /// sensor is taken without it, and mag=none takes none. Give it once for each
    #[arg(long = "topic", value_name = "ROLE=TOPIC", help_heading = "A robot's log")]
    topic: Vec<String>,
}

impl Columns {
    pub(super) fn mapping(&self) -> anyhow::Result<Mapping> {
        Ok(Mapping::parse(&self.map, &self.unit, self.time.as_deref())?.with_topics(&self.topic)?)
    }

    /// An error where an option is given for files that have no use for it.
    pub(super) fn refuse_for(&self, files: &str, why: &str) -> anyhow::Result<()> {
        let given = [
            ("--map", !self.map.is_empty()),
            ("--unit", !self.unit.is_empty()),
            ("--time", self.time.is_some()),
            ("--topic", !self.topic.is_empty()),
        ];
        match given.into_iter().find(|(_, given)| *given) {
            Some((option, _)) => anyhow::bail!("{option}: found it for {files}, {why}; leave it out"),
            None => Ok(()),
        }
    }
}

/// Reads a recording, or another program's file as one, and warns of what is odd in it.
pub(super) fn read(path: &Path, columns: &Columns, reading: Reading) -> anyhow::Result<Recording> {
    let mapping = columns.mapping()?;
    let progress = Progress::reading(path);
    let recording = Recording::read_as(path, &mapping, &reading.limits())
        .map_err(|error| explained(path, error, reading))?;
    drop(progress);
    for warning in &recording.warnings {
        warn(warning);
    }
    Ok(recording)
}

/// An error of reading, with what the file's columns probably are where these are not known.
pub(super) fn explained(path: &Path, error: ReadError, reading: Reading) -> anyhow::Error {
    match hint(path, &error, reading) {
        Some(hint) => anyhow::anyhow!("{error}\n\n{hint}"),
        None => error.into(),
    }
}

/// What the file's columns probably are, where it is not known, or the command that chooses a topic.
fn hint(path: &Path, error: &ReadError, reading: Reading) -> Option<String> {
    let command = std::env::args().nth(1).unwrap_or_default();
    let error = error.fault();
    if let ReadError::Topics { fault, .. } = error {
        return Some(layout::command(&command, path, &fault.remedy()?));
    }
    let unknown = matches!(
        error,
        ReadError::Header { .. } | ReadError::ManifestMissing { .. } | ReadError::Mapping { .. }
    );
    if let Some(fields) = nameless(path, &reading.limits()).filter(|_| unknown) {
        return Some(layout::names_wanted(fields));
    }
    let guess = guess(path, &reading.limits()).filter(|_| unknown)?;
    Some(layout::guess(&guess, &command, path))
}

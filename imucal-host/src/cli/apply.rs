//! `imucal apply`

use std::{
    ffi::OsStr,
    path::{Path, PathBuf},
};

use clap::Args;

use super::{
    Ending,
    columns::{self, Columns},
    load,
    output::say,
    overwrite::{Overwrite, Planned, files_of},
    reading::Reading,
    refuse, warn,
};
use crate::apply;

#[derive(Args, Debug)]
#[command(after_help = "Example:\n  imucal apply tumble.csv --calibration unit.bin --out tumble-si.csv")]
pub(super) struct Arguments {
    /// The recording to correct
    recording: PathBuf,
    /// The calibration: TOML or record
    #[arg(long, value_name = "CAL")]
    calibration: PathBuf,
    /// The corrected recording; default NAME-calibrated in the input's folder
    #[arg(long, value_name = "REC2")]
    out: Option<PathBuf>,
    /// Apply a calibration made for another serial
    #[arg(long)]
    other_serial: bool,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    columns: Columns,
    #[command(flatten)]
    reading: Reading,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let out = arguments.out.clone().unwrap_or_else(|| default_output(&arguments.recording));
    let mut inputs = files_of(&arguments.recording);
    inputs.push(arguments.calibration.clone());
    let mut files = arguments.overwrite.plan(&inputs, &Planned::recording(&out))?;
    let recording = columns::read(&arguments.recording, &arguments.columns, arguments.reading)?;
    let stored = match load(&arguments.calibration, arguments.reading)? {
        Ok(stored) => stored,
        Err(damaged) => return Ok(refuse(&damaged)),
    };
    let record = stored.to_record(&arguments.calibration)?;
    let warning = match apply::check(&recording, &stored, &record, arguments.other_serial) {
        Ok(warning) => warning,
        Err(refusal) => return Ok(refuse(&refusal)),
    };
    if let Some(warning) = warning {
        warn(&warning);
    }
    apply::apply(&recording, &stored, &record)?.write_into(&out, &mut files)?;
    files.commit()?;
    say!("{}: {} rows corrected into {}", recording.name, recording.rows(), out.display());
    Ok(Ending::Done)
}

/// `NAME-calibrated.csv.gz` for `NAME.csv.gz`; of a log, which is not written, `NAME-calibrated.csv`.
fn default_output(path: &Path) -> PathBuf {
    let name = path.file_name().and_then(OsStr::to_str).unwrap_or("recording.csv");
    let lower = name.to_ascii_lowercase();
    let ending = [".csv.gz", ".csv", ".parquet"].into_iter().find(|ending| lower.ends_with(ending));
    // Endings are ASCII, so that the lengths agree and the cut is between characters.
    let log = [".mcap", ".bag"].into_iter().find(|ending| lower.ends_with(ending));
    let (stem, ending) = match log {
        Some(log) => (&name[..name.len() - log.len()], ".csv"),
        None => name.split_at(name.len() - ending.map_or(0, str::len)),
    };
    path.with_file_name(format!("{stem}-calibrated{ending}"))
}

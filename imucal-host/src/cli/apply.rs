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
    progress::Progress,
    reading::Reading,
    refuse, warn,
};
use crate::{
    apply::{self, StreamError},
    recording::{Source, is_log},
};

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
    let stored = match load(&arguments.calibration, arguments.reading)? {
        Ok(stored) => stored,
        Err(damaged) => return Ok(refuse(&damaged)),
    };
    let record = stored.to_record(&arguments.calibration)?;
    let (mapping, limits) = (arguments.columns.mapping()?, arguments.reading.limits());
    let source = Source { path: &arguments.recording, mapping: &mapping, manifest: None, limits: &limits };
    let progress = Progress::reading(source.path);
    let applied = apply::stream(source, (&stored, &record), arguments.other_serial, &out, &mut files);
    drop(progress);
    let applied = match applied {
        Ok(applied) => applied,
        Err(StreamError::Refused { refusal, warnings }) => {
            warnings.iter().for_each(|warning| warn(warning));
            return Ok(refuse(&refusal));
        }
        Err(StreamError::Read(error)) => {
            return Err(columns::explained(source.path, error, arguments.reading));
        }
        Err(error) => return Err(error.into()),
    };
    applied.warnings.iter().for_each(|warning| warn(warning));
    applied.remarks.iter().for_each(|remark| warn(remark));
    files.commit()?;
    say!("{}: {} rows corrected into {}", applied.recording, applied.rows, out.display());
    Ok(Ending::Done)
}

/// `NAME-calibrated.csv.gz` for `NAME.csv.gz`; of a log or a MAT-file, which are not written, `NAME-calibrated.csv`.
fn default_output(path: &Path) -> PathBuf {
    let name = path.file_name().and_then(OsStr::to_str).unwrap_or("recording.csv");
    let lower = name.to_ascii_lowercase();
    let ending = [".csv.gz", ".csv", ".parquet"].into_iter().find(|ending| lower.ends_with(ending));
    // Endings are ASCII, so that the lengths agree and the cut is between characters.
    let (stem, ending) = match path.file_stem().and_then(OsStr::to_str) {
        Some(stem) if is_log(path) || lower.ends_with(".mat") => (stem, ".csv"),
        _ => name.split_at(name.len() - ending.map_or(0, str::len)),
    };
    path.with_file_name(format!("{stem}-calibrated{ending}"))
}

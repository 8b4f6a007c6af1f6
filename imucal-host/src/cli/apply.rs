//! `imucal apply`

use std::{
    ffi::OsStr,
    path::{Path, PathBuf},
};

use clap::Args;

use super::{Ending, read, warn};
use crate::{apply, store::StoredCalibration};

#[derive(Args, Debug)]
pub(super) struct Arguments {
    /// The recording to correct
    recording: PathBuf,
    /// The calibration: TOML or record
    #[arg(long, value_name = "CAL")]
    calibration: PathBuf,
    /// The corrected recording; default NAME-calibrated beside the input
    #[arg(long, value_name = "REC2")]
    out: Option<PathBuf>,
    /// Apply a calibration made for another serial
    #[arg(long)]
    force: bool,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let recording = read(&arguments.recording)?;
    let stored = StoredCalibration::load(&arguments.calibration)?;
    let record = stored.to_record(&arguments.calibration)?;
    let warning = match apply::check(&recording, &stored, &record, arguments.force) {
        Ok(warning) => warning,
        Err(refusal) => {
            eprintln!("imucal: refused: {refusal}");
            return Ok(Ending::Refused);
        }
    };
    if let Some(warning) = warning {
        warn(&warning);
    }
    let out = arguments.out.clone().unwrap_or_else(|| beside(&arguments.recording));
    apply::apply(&recording, &stored, &record).write(&out)?;
    println!("{}: {} rows corrected into {}", recording.name, recording.rows(), out.display());
    Ok(Ending::Done)
}

/// `NAME-calibrated.csv.gz` for `NAME.csv.gz`.
fn beside(path: &Path) -> PathBuf {
    let name = path.file_name().and_then(OsStr::to_str).unwrap_or("recording.csv");
    let (stem, ending) = name.split_once('.').unwrap_or((name, "csv"));
    path.with_file_name(format!("{stem}-calibrated.{ending}"))
}

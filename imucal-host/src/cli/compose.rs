//! `imucal compose`

use std::path::PathBuf;

use clap::Args;

use super::{
    Ending, load,
    output::say,
    overwrite::{Overwrite, Planned},
    reading::Reading,
    refuse,
};
use crate::{compose::compose, store::form::Form};

#[derive(Args, Debug)]
#[command(
    after_help = "Example:\n  imucal compose in-use.toml of-corrected.toml --out both.toml --record both.bin"
)]
pub(super) struct Arguments {
    /// The calibration that the device uses
    old: PathBuf,
    /// A calibration from a recording that the device has corrected by it
    new: PathBuf,
    /// Write both as one calibration of raw values, for people
    #[arg(long, value_name = "CAL.toml", required_unless_present = "record")]
    out: Option<PathBuf>,
    /// Write the record for the device
    #[arg(long, value_name = "CAL.bin")]
    record: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    reading: Reading,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let planned = [(&arguments.out, Form::Toml), (&arguments.record, Form::Record)];
    let outputs: Vec<Planned> = planned
        .into_iter()
        .filter_map(|(path, form)| Some(Planned::calibration(path.as_ref()?, form)))
        .collect();
    let inputs = [arguments.old.clone(), arguments.new.clone()];
    let mut files = arguments.overwrite.plan(&inputs, &outputs)?;
    let mut both = Vec::new();
    for path in &inputs {
        match load(path, arguments.reading)? {
            Ok(stored) => both.push(stored),
            Err(damaged) => return Ok(refuse(&damaged)),
        }
    }
    let composed = match compose(&both[0], &both[1]) {
        Ok(composed) => composed,
        Err(fault) => return Ok(refuse(&fault)),
    };
    if let Some(path) = &arguments.out {
        composed.write_toml(path, &mut files)?;
    }
    if let Some(path) = &arguments.record {
        composed.write_record(path, &mut files)?;
    }
    files.commit()?;
    for path in arguments.out.iter().chain(&arguments.record) {
        say!("{}: both as one calibration of raw values", path.display());
    }
    Ok(Ending::Done)
}

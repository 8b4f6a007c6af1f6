//! `imucal compare`

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;

use super::{
    Ending, load, output,
    overwrite::{Overwrite, Planned},
    reading::Reading,
    refuse,
};
use crate::{compare::compare, report};

#[derive(Args, Debug)]
#[command(after_help = "Example:\n  imucal compare unit-2025.toml unit-2026.toml")]
pub(super) struct Arguments {
    /// The earlier calibration: TOML or record
    first: PathBuf,
    /// The later calibration of the same unit
    second: PathBuf,
    /// Compare calibrations of two serials
    #[arg(long)]
    other_serial: bool,
    /// Write the comparison as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    reading: Reading,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let outputs: Vec<Planned> = arguments.json.iter().map(Planned::new).collect();
    let inputs = [arguments.first.clone(), arguments.second.clone()];
    let mut files = arguments.overwrite.plan(&inputs, &outputs)?;
    let mut both = Vec::new();
    for path in [&arguments.first, &arguments.second] {
        match load(path, arguments.reading)? {
            Ok(stored) => both.push(stored),
            Err(damaged) => return Ok(refuse(&damaged)),
        }
    }
    let comparison = match compare(&both[0], &both[1], arguments.other_serial) {
        Ok(comparison) => comparison,
        Err(fault) => return Ok(refuse(&fault)),
    };
    output::text(&report::compare::compared(&comparison))?;
    if let Some(path) = &arguments.json {
        let json = serde_json::to_string_pretty(&comparison)
            .context("the comparison cannot be spelt as JSON")?
            + "\n";
        files.add(path, json.as_bytes())?;
    }
    files.commit()?;
    Ok(Ending::Done)
}

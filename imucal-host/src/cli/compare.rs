//! `imucal compare`

use std::path::{Path, PathBuf};

use clap::Args;

use super::{
    Ending,
    html::Html,
    json::Json,
    load,
    overwrite::{Overwrite, Planned},
    reading::Reading,
    refuse,
};
use crate::{compare::compare, page, report};

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
    #[command(flatten)]
    json: Json,
    #[command(flatten)]
    html: Html,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    reading: Reading,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let outputs: Vec<Planned> =
        arguments.json.planned().into_iter().chain(arguments.html.planned()).collect();
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
    arguments.json.give(&mut files, &comparison, &|| report::compare::compared(&comparison))?;
    let title = format!("{} to {}", name(&arguments.first), name(&arguments.second));
    let inputs = [("first", arguments.first.as_path()), ("second", &arguments.second)];
    let facts = |provenance: page::Provenance| {
        let unit = &both[1].sensor;
        let days = format!("{} days", comparison.days);
        Ok(provenance
            .with("unit", &unit.name)
            .with("serial number", &unit.serial)
            .with("between them", &days))
    };
    let parts = || vec![page::comparison::comparison(&comparison)];
    arguments.html.add_of(&mut files, &title, &inputs, &facts, &parts)?;
    files.commit()?;
    Ok(Ending::Done)
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

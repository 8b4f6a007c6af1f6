//! `imucal noise`

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::{
    Ending,
    columns::{self, Columns},
    html::Html,
    json::Json,
    output::{self, say},
    overwrite::{Overwrite, Planned, files_of},
    progress::Progress,
    reading::Reading,
    refuse, warn,
};
use crate::{
    allan::{self, sensor::Refusal},
    export::{self, Inputs, Target},
    page, report,
    store::{noise_file::NoiseFile, today},
};

#[derive(Args, Debug)]
#[command(after_help = "Example:\n  imucal noise still.csv --json noise.json")]
pub(super) struct Arguments {
    /// A recording of the untouched unit: an hour or more for the bias instability
    recording: PathBuf,
    #[command(flatten)]
    json: Json,
    #[command(flatten)]
    html: Html,
    /// Print the settings of another program in place of the tables
    #[arg(long, value_name = "TARGET")]
    to: Option<To>,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    columns: Columns,
    #[command(flatten)]
    reading: Reading,
}

/// What the noise alone can be printed for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum To {
    /// Kalibr's imu.yaml
    Kalibr,
    /// The noise of a Gazebo sensor
    Sdf,
    /// The JSON
    Json,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let on_screen = arguments.json.on_screen();
    anyhow::ensure!(!(on_screen && arguments.to.is_some()), "--json -: found --to too, expected one of them");
    let outputs: Vec<Planned> =
        arguments.json.planned().into_iter().chain(arguments.html.planned()).collect();
    let mut files = arguments.overwrite.plan(&files_of(&arguments.recording), &outputs)?;
    let mapping = arguments.columns.mapping()?;
    let progress = Progress::reading(&arguments.recording);
    let noise = allan::noise(&arguments.recording, &mapping, &arguments.reading.limits())
        .map_err(|error| columns::explained(&arguments.recording, error, arguments.reading))?;
    drop(progress);
    let warnings = noise.messages();
    warnings.iter().for_each(|warning| warn(warning));
    let file = NoiseFile::new(&noise, warnings);
    if let Some(path) = arguments.json.path() {
        files.add(path, file.text().as_bytes())?;
    }
    let page = || page::of_noise(&file, &arguments.recording, today());
    arguments.html.add_page(&mut files, &arguments.recording, &page)?;
    files.commit()?;
    let estimated = noise.sensors.iter().any(|(_, found)| found.is_ok());
    match arguments.to {
        _ if on_screen => output::document(&file.text())?,
        Some(To::Json) => output::document(&file.text())?,
        Some(to) if estimated => return print(&file, to),
        _ => output::text(&report::noise::noise(&file))?,
    }
    if estimated {
        return Ok(Ending::Done);
    }
    // What moved says more than what moved with it.
    let refusals = noise.sensors.iter().filter_map(|(_, found)| found.as_ref().err());
    let moved_with = |refusal: &&Refusal| matches!(refusal, Refusal::MovedWith { .. });
    let first = refusals.min_by_key(moved_with).map(ToString::to_string);
    let nothing = || format!("{}: found no sensor, expected the columns of one", file.recording);
    Ok(refuse(&first.unwrap_or_else(nothing)))
}

fn print(file: &NoiseFile, to: To) -> anyhow::Result<Ending> {
    let target = if to == To::Kalibr { Target::Kalibr } else { Target::Sdf };
    let inputs = Inputs { noise: Some(file), ..Inputs::default() };
    match export::document(target, &inputs) {
        Ok(document) => {
            output::document(&document.text)?;
            Ok(Ending::Done)
        }
        Err(refusal) => {
            say!("{}: nothing printed", file.recording);
            Ok(refuse(&refusal))
        }
    }
}

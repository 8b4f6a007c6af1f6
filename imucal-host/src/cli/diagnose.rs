//! `imucal diagnose`

use std::path::PathBuf;

use clap::Args;

use super::{Ending, output::say, read};
use crate::diagnosis::{Options, diagnose};

#[derive(Args, Debug)]
pub(super) struct Arguments {
    /// The recording to diagnose
    recording: PathBuf,
    /// Withhold a catalogue entry, or take a term out of the baseline
    #[arg(long, value_name = "EFFECT_OR_TERM", num_args = 1..)]
    without: Vec<String>,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let recording = read(&arguments.recording)?;
    let clock = std::time::Instant::now();
    let options = Options { without: arguments.without.clone() };
    let diagnosis =
        diagnose(&recording, &options, &|stage| eprintln!("{:6.2} {stage}", clock.elapsed().as_secs_f64()));
    say!("{}", serde_json::to_string_pretty(&diagnosis)?);
    Ok(Ending::Done)
}

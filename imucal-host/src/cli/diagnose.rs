//! `imucal diagnose`

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;

use super::{
    Ending,
    columns::{self, Columns},
    html::Html,
    json::Json,
    load, output,
    overwrite::{Overwrite, Planned, files_of},
    own_effects,
    progress::Progress,
    reading::Reading,
    refuse, warn,
};
use crate::{
    diagnosis::{Diagnosis, Options, Verdict, diagnose, proposal::confirmation},
    effect::{Effect, user},
    file::OutputSet,
    page,
    recording::{self, Mapping, Recording, Stream, Warning},
    report,
    store::watch_file,
};

#[derive(Args, Debug)]
#[command(after_help = "Example:\n  imucal diagnose robot.csv --sim simulated.csv --html gap.html")]
pub(super) struct Arguments {
    /// The recording to diagnose: NAME.csv, NAME.csv.gz, NAME.parquet or NAME.mat, with its manifest NAME.toml in the
    /// same folder; or a log, NAME.mcap, NAME.db3 or NAME.bag, or the folder of a ROS 2 bag
    #[arg(required_unless_present = "list")]
    recording: Option<PathBuf>,
    /// The unit's present model, as `imucal calibrate` wrote it (default: calibrated from the recording)
    #[arg(long, value_name = "CAL")]
    model: Option<PathBuf>,
    /// A simulator's ideal stream of the same movement, on its own clock: columns sim_* (or acc_*, gyr_*, mag_*) of a
    /// recording
    #[arg(long, value_name = "SIM")]
    sim: Option<PathBuf>,
    /// Which of several streams in SIM is meant: NAME of columns sim_NAME_acc_x, sim_NAME_gyr_x, … (m/s², rad/s, µT); of a log, which
    /// may be that of the recording, a topic of sensor_msgs/Imu
    #[arg(long, value_name = "NAME", requires = "sim")]
    sim_topic: Option<String>,
    /// What the drift watch of the unit's device has seen, as the device wrote it; it is reported next to the diagnosis
    #[arg(long, value_name = "FILE")]
    watch: Option<PathBuf>,
    /// Exclude effects from the candidates, or terms (such as acc.misalignment) from the baseline
    #[arg(long, value_name = "EFFECT_OR_TERM", num_args = 1..)]
    without: Vec<String>,
    /// Your own effects, in TOML: candidates like those of the catalogue (see docs/user_effects.md)
    #[arg(long, value_name = "FILE")]
    effects: Option<PathBuf>,
    /// Test the effects of --effects on another recording, with the fitted amplitudes that the file holds (as --proposals writes
    /// them)
    #[arg(long, requires = "effects")]
    frozen: bool,
    /// Write the formulas that are proposed where no effect explains the gap, as a file for --effects
    #[arg(long, value_name = "FILE", conflicts_with = "frozen")]
    proposals: Option<PathBuf>,
    #[command(flatten)]
    json: Json,
    #[command(flatten)]
    html: Html,
    /// List every effect: what it is, its usual size, what a recording needs to show it, what it may be mistaken for
    #[arg(long)]
    list: bool,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    columns: Columns,
    #[command(flatten)]
    reading: Reading,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let own = own_effects(arguments.effects.as_deref(), &arguments.reading.limits())?;
    let without = user::known(&arguments.without, &own).context("--without")?;
    let Some(path) = arguments.recording.as_deref().filter(|_| !arguments.list) else {
        output::text(&report::catalogue::catalogue(&own))?;
        return Ok(Ending::Done);
    };
    let frozen = frozen(arguments, &own)?;
    let mut inputs = files_of(path);
    inputs.extend(arguments.model.clone());
    inputs.extend(arguments.sim.iter().flat_map(|path| files_of(path)));
    inputs.extend(arguments.effects.clone());
    inputs.extend(arguments.watch.clone());
    let proposals = arguments.proposals.iter().map(Planned::new);
    let written: Vec<Planned> =
        arguments.json.planned().into_iter().chain(proposals).chain(arguments.html.planned()).collect();
    let mut files = arguments.overwrite.plan(&inputs, &written)?;
    let recording = columns::read(path, &arguments.columns, arguments.reading)?;
    let model = arguments.model.as_deref().map(|path| load(path, arguments.reading)).transpose()?;
    let model = match model {
        Some(Err(damaged)) => return Ok(refuse(&damaged)),
        model => model.and_then(Result::ok),
    };
    let topic = arguments.sim_topic.as_deref();
    let stream = arguments.sim.as_deref().map(|path| stream(path, topic, &recording, arguments.reading));
    let stream = stream.transpose()?;
    let limits = arguments.reading.limits();
    let watch =
        arguments.watch.as_deref().map(|path| watch_file::read_of(path, &recording, &limits)).transpose()?;
    let options = Options { without, model, stream, effects: own, frozen, watch, settings: None };
    let progress = Progress::start();
    let diagnosis = diagnose(&recording, &options, &|stage| progress.stage(stage));
    drop(progress);
    arguments.html.add(&mut files, &recording, &|| vec![page::diagnosis::diagnosis(&diagnosis)])?;
    print(arguments, &diagnosis, files)?;
    Ok(if diagnosis.verdict == Verdict::NotTestable { Ending::Refused } else { Ending::Done })
}

/// The text of the user's file, where its effects are to be confirmed.
fn frozen(arguments: &Arguments, own: &[&'static Effect]) -> anyhow::Result<Option<String>> {
    let path = arguments.effects.as_deref().filter(|_| arguments.frozen);
    Ok(path.map(|path| confirmation::frozen(path, own, &arguments.reading.limits())).transpose()?)
}

/// A simulator's stream for a recording, of a topic where its file has several.
fn stream(
    path: &Path,
    topic: Option<&str>,
    recording: &Recording,
    reading: Reading,
) -> anyhow::Result<Stream> {
    let (mapping, topic) = Mapping::of_stream(path, topic)?;
    let simulated = Recording::read_as(path, &mapping, &reading.limits())
        .map_err(|error| columns::explained(path, error, reading))?;
    simulated.warnings.iter().filter(|warning| !is_expected(warning)).for_each(|warning| warn(warning));
    Stream::chosen(&simulated, recording, topic).with_context(|| path.display().to_string())
}

/// That a simulator's file has no sensor, or topics other than the one that is meant, is what is asked for.
fn is_expected(warning: &Warning) -> bool {
    match warning {
        Warning::SimulatorAlone { .. } | Warning::NoSensor { .. } => true,
        Warning::UnknownColumn { column, .. } => recording::topic::split(column).is_some(),
        _ => false,
    }
}

fn print(arguments: &Arguments, diagnosis: &Diagnosis, mut files: OutputSet) -> anyhow::Result<()> {
    let proposed: String = diagnosis.proposals.iter().map(|proposal| proposal.toml.as_str()).collect();
    if let Some(path) = arguments.proposals.as_ref().filter(|_| !proposed.is_empty()) {
        files.add(path, proposed.as_bytes())?;
    }
    if let Some(path) = arguments.json.path() {
        files.add(path, diagnosis.text().as_bytes())?;
    }
    files.commit()?;
    match arguments.json.on_screen() {
        true => output::document(&diagnosis.text()),
        false => output::text(&report::diagnosis::page(diagnosis)),
    }
}

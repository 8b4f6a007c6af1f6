//! `imucal calibrate`

use std::path::PathBuf;

use clap::Args;

use super::{
    Ending,
    columns::{self, Columns},
    fitting::Fitting,
    html::Html,
    json::Json,
    output,
    overwrite::{Overwrite, Planned, files_of},
    progress::Progress,
    reading::Reading,
    warn,
};
use crate::{
    calibrate::{Calibration, calibrate, request::Request},
    file::OutputSet,
    page,
    recording::{Recording, SensorKind},
    report,
    store::{StoredCalibration, form::Form},
};

pub(super) use crate::store::today;

#[derive(Args, Debug)]
#[command(
    after_help = "Example:\n  imucal calibrate tumble.csv --out unit.toml --record unit.bin --html unit.html"
)]
pub(super) struct Arguments {
    /// The recording: NAME.csv, NAME.csv.gz, NAME.parquet or NAME.mat, with its manifest NAME.toml in the same folder;
    /// or a log, NAME.mcap, NAME.db3 or NAME.bag, or the folder of a ROS 2 bag
    recording: PathBuf,
    #[command(flatten)]
    fitting: Fitting,
    /// Write the calibration for people
    #[arg(long, value_name = "CAL.toml")]
    out: Option<PathBuf>,
    /// Write the record for the device
    #[arg(long, value_name = "CAL.bin")]
    record: Option<PathBuf>,
    #[command(flatten)]
    json: Json,
    #[command(flatten)]
    html: Html,
    /// Fit every model, score each on data left out of its fit, and recommend one
    #[arg(long)]
    compare: bool,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    columns: Columns,
    #[command(flatten)]
    reading: Reading,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let request = arguments.fitting.request(arguments.compare)?;
    let files = arguments.overwrite.plan(&files_of(&arguments.recording), &outputs(arguments))?;
    let recording = columns::read(&arguments.recording, &arguments.columns, arguments.reading)?;
    request.check(&recording)?;
    let progress = Progress::start();
    let calibration = calibrate(&recording, &request.options(), &|stage| progress.stage(stage));
    drop(progress);
    let json = report::json::text(&calibration);
    print(arguments, &calibration, &json)?;
    write(arguments, &request, (&recording, &calibration), &json, files)?;
    Ok(if request.is_met(&calibration) { Ending::Done } else { Ending::Refused })
}

/// The files asked for.
fn outputs(arguments: &Arguments) -> Vec<Planned> {
    [
        (arguments.out.as_deref(), Form::Toml),
        (arguments.record.as_deref(), Form::Record),
        (arguments.json.path(), Form::Json),
    ]
    .into_iter()
    .filter_map(|(path, form)| Some(Planned::calibration(path?, form)))
    .chain(arguments.html.planned())
    .collect()
}

fn print(arguments: &Arguments, calibration: &Calibration, json: &str) -> anyhow::Result<()> {
    match arguments.json.on_screen() {
        true => output::document(json),
        false => output::text(&report::table::table(calibration)),
    }
}

/// Writes all files that were asked for, or none; those that hold sensors only where there is one.
fn write(
    arguments: &Arguments,
    request: &Request,
    (recording, calibration): (&Recording, &Calibration),
    json: &str,
    mut files: OutputSet,
) -> anyhow::Result<()> {
    let of = if request.accept_suspect { StoredCalibration::with_suspects } else { StoredCalibration::of };
    let stored = of(calibration, today());
    let nothing = SensorKind::ALL.into_iter().all(|kind| stored.triad(kind).is_none());
    if let Some(path) = arguments.json.path() {
        files.add(path, json.as_bytes())?;
    }
    let parts = || vec![page::calibration::calibration(calibration, recording)];
    arguments.html.add(&mut files, recording, &parts)?;
    for path in arguments.out.iter().chain(&arguments.record).filter(|_| nothing) {
        warn(&format!("{}: not written, since no sensor was accepted", path.display()));
    }
    if let Some(path) = arguments.out.as_ref().filter(|_| !nothing) {
        stored.write_toml(path, &mut files)?;
    }
    if let Some(path) = arguments.record.as_ref().filter(|_| !nothing) {
        stored.write_record(path, &mut files)?;
    }
    Ok(files.commit()?)
}

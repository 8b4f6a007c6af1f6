//! `imucal calibrate`

use std::{path::PathBuf, time::SystemTime};

use clap::Args;
use imucal_core::record::Date;

use super::{Ending, output, progress::Progress, read, warn};
use crate::{
    calibrate::{AccModel, Calibration, Options, calibrate, gyr, mag},
    recording::{Recording, SensorKind},
    report,
    store::StoredCalibration,
};

#[derive(Args, Debug)]
pub(super) struct Arguments {
    /// The recording: NAME.csv, NAME.csv.gz (or NAME.parquet), with NAME.toml beside it
    recording: PathBuf,
    /// Models, e.g. acc=T9,gyr=K9,mag=E9; acc=T6 fits six parameters from six faces. A sensor named here must be
    /// accepted for the program to end with 0
    #[arg(long, value_delimiter = ',', value_parser = model)]
    model: Vec<(SensorKind, ModelChoice)>,
    /// Write the calibration for people
    #[arg(long, value_name = "CAL.toml")]
    out: Option<PathBuf>,
    /// Write the record for the device
    #[arg(long, value_name = "CAL.bin")]
    record: Option<PathBuf>,
    /// Write everything as JSON; `-` prints it instead of the table
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Use this multiple of the initial rest's variance for the rest test instead of trying 2 to 10
    #[arg(long, value_name = "MULTIPLE", value_parser = multiple)]
    threshold: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ModelChoice {
    Acc(AccModel),
    Only,
}

/// One `sensor=model`.
fn model(text: &str) -> Result<(SensorKind, ModelChoice), String> {
    match text {
        "acc=T9" => Ok((SensorKind::Acc, ModelChoice::Acc(AccModel::T9))),
        "acc=T6" => Ok((SensorKind::Acc, ModelChoice::Acc(AccModel::T6))),
        _ if text.strip_prefix("gyr=") == Some(gyr::MODEL) => Ok((SensorKind::Gyr, ModelChoice::Only)),
        _ if text.strip_prefix("mag=") == Some(mag::MODEL) => Ok((SensorKind::Mag, ModelChoice::Only)),
        _ => Err(format!("`{text}` is no model; expected acc=T9, acc=T6, gyr=K9 or mag=E9")),
    }
}

fn multiple(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|m: &f64| m.is_finite() && *m > 0.0)
        .ok_or_else(|| "expected a number above 0".into())
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let named: Vec<SensorKind> = arguments.model.iter().map(|(kind, _)| *kind).collect();
    check_models(&named)?;
    output::check(&output::files_of(&arguments.recording), &outputs(arguments))?;
    let recording = read(&arguments.recording)?;
    check_named(&recording, &named)?;
    let progress = Progress::start();
    let calibration = calibrate(&recording, &options(arguments), &|stage| progress.stage(stage));
    drop(progress);
    print(arguments, &calibration)?;
    write(arguments, &calibration)?;
    Ok(ending(&calibration, &named))
}

/// The files asked for; `--json -` is none.
fn outputs(arguments: &Arguments) -> Vec<PathBuf> {
    let json = arguments.json.iter().filter(|path| path.as_os_str() != "-");
    arguments.out.iter().chain(&arguments.record).chain(json).cloned().collect()
}

fn options(arguments: &Arguments) -> Options {
    let mut options = Options::default();
    for (_, choice) in &arguments.model {
        if let ModelChoice::Acc(acc) = choice {
            options.acc = *acc;
        }
    }
    if let Some(threshold) = arguments.threshold {
        options.multipliers = vec![threshold];
    }
    options
}

/// Each sensor has one model.
fn check_models(named: &[SensorKind]) -> anyhow::Result<()> {
    let twice = named.iter().enumerate().find(|(index, kind)| named[..*index].contains(kind));
    twice.map_or(Ok(()), |(_, kind)| {
        anyhow::bail!("--model: found {kind} twice, expected one model a sensor; leave one out")
    })
}

fn check_named(recording: &Recording, named: &[SensorKind]) -> anyhow::Result<()> {
    match named.iter().find(|kind| recording.sensor(**kind).is_none()) {
        Some(kind) => anyhow::bail!(
            "{}: --model names {kind}, but the recording has no columns {}; leave it out of --model",
            recording.name,
            kind.columns().join(", ")
        ),
        None => Ok(()),
    }
}

/// 0 once something was accepted and nothing named was refused.
fn ending(calibration: &Calibration, named: &[SensorKind]) -> Ending {
    let accepted = |kind: SensorKind| calibration.sensor(kind).is_some_and(|outcome| outcome.verdict.is_ok());
    let any = SensorKind::ALL.into_iter().any(accepted);
    if any && named.iter().all(|kind| accepted(*kind)) { Ending::Done } else { Ending::Refused }
}

fn print(arguments: &Arguments, calibration: &Calibration) -> anyhow::Result<()> {
    if let Some(path) = &arguments.json {
        let text = serde_json::to_string_pretty(&report::json::calibration(calibration))? + "\n";
        if path.as_os_str() == "-" {
            return output::text(&text);
        }
        output::file(path, &text)?;
    }
    output::text(&report::table::table(calibration))
}

fn write(arguments: &Arguments, calibration: &Calibration) -> anyhow::Result<()> {
    let stored = StoredCalibration::of(calibration, today());
    let nothing = SensorKind::ALL.into_iter().all(|kind| stored.triad(kind).is_none());
    for path in arguments.out.iter().chain(&arguments.record).filter(|_| nothing) {
        warn(&format!("{}: not written, since no sensor was accepted", path.display()));
    }
    if nothing {
        return Ok(());
    }
    if let Some(path) = &arguments.out {
        stored.save_toml(path)?;
    }
    if let Some(path) = &arguments.record {
        stored.save_record(path)?;
    }
    Ok(())
}

/// Today, UTC; `SOURCE_DATE_EPOCH` overrides it, for outputs that must not depend on the day.
pub(super) fn today() -> Date {
    let seconds =
        std::env::var("SOURCE_DATE_EPOCH").ok().and_then(|text| text.parse().ok()).unwrap_or_else(|| {
            SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs())
        });
    Date::from_unix(seconds)
}

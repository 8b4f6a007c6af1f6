//! `imucal calibrate`

use std::{path::PathBuf, time::SystemTime};

use clap::Args;
use imucal_core::record::Date;

use super::{
    Ending,
    columns::{self, Columns},
    html::Html,
    output,
    overwrite::{Overwrite, Planned, files_of},
    progress::Progress,
    reading::Reading,
    warn,
};
use crate::{
    calibrate::{
        AccModel, Calibration, Options, Status, calibrate,
        gyr::{rig, turns},
        known_attitudes::ladder,
        mag::samples,
    },
    file::OutputSet,
    observe::pose,
    page,
    recording::{Recording, SensorKind},
    report,
    store::{StoredCalibration, form::Form},
};

#[derive(Args, Debug)]
#[command(
    after_help = "Example:\n  imucal calibrate tumble.csv --out unit.toml --record unit.bin --html unit.html"
)]
pub(super) struct Arguments {
    /// The recording: NAME.csv, NAME.csv.gz or NAME.parquet, with its manifest NAME.toml in the same folder; or a log, NAME.mcap or
    /// NAME.bag
    recording: PathBuf,
    /// Models by sensor, e.g. acc=T9,gyr=K9,mag=E9: a letter and the number of parameters. From rests: acc=T9 (gain and
    /// bias) or T6 (scale and bias, from six faces), gyr=K9 (gain), mag=E9 (ellipsoid). On a rig: acc=I14 (gain, bias and
    /// tilt of the base) or T12, I17, I20, I23; gyr=G12 (gain and bias) or G21; mag=X21 (gain, bias, hard iron on gimbals
    /// and field) or M12, M15, X18. With an optical reference: gyr=G12 or G21, mag=M15 or M12. The exit status is 0 only
    /// if every sensor named here is accepted
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
    #[command(flatten)]
    html: Html,
    /// Use this multiple of the initial rest's variance for the rest test instead of trying 2 to 10
    #[arg(long, value_name = "MULTIPLE", value_parser = multiple)]
    threshold: Option<f64>,
    /// Fit every model, score each on data left out of its fit, and recommend one
    #[arg(long)]
    compare: bool,
    /// Do not estimate how bias and scale follow the temperature, where the recording has a column temp
    #[arg(long)]
    no_temperature: bool,
    /// Also write suspect sensors: their fit is within all limits, but its residual is not the noise
    #[arg(long)]
    accept_suspect: bool,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    columns: Columns,
    #[command(flatten)]
    reading: Reading,
}

/// A model named on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ModelChoice {
    /// A field form of the accelerometer.
    Acc(AccModel),
    /// A rung of the sensor's ladder on a rig.
    Rig(&'static str),
    /// The sensor's field form, where it has but one.
    Field,
}

/// One `sensor=model`.
fn model(text: &str) -> Result<(SensorKind, ModelChoice), String> {
    let rung = |ladder: &[(&'static str, &str)], name: &str| {
        ladder.iter().find(|(known, _)| *known == name).map(|(known, _)| ModelChoice::Rig(known))
    };
    let found = match text.split_once('=') {
        Some(("acc", "T9")) => Some((SensorKind::Acc, ModelChoice::Acc(AccModel::T9))),
        Some(("acc", "T6")) => Some((SensorKind::Acc, ModelChoice::Acc(AccModel::T6))),
        Some(("acc", name)) => rung(&ladder::ACCELEROMETER, name).map(|choice| (SensorKind::Acc, choice)),
        Some(("gyr", name)) if name == turns::MODEL => Some((SensorKind::Gyr, ModelChoice::Field)),
        Some(("gyr", name)) => rung(&rig::MODELS, name).map(|choice| (SensorKind::Gyr, choice)),
        Some(("mag", name)) if name == samples::MODEL => Some((SensorKind::Mag, ModelChoice::Field)),
        Some(("mag", name)) => rung(&ladder::MAGNETOMETER, name).map(|choice| (SensorKind::Mag, choice)),
        _ => None,
    };
    found.ok_or_else(|| {
        let names =
            |ladder: &[(&str, &str)]| ladder.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
        format!(
            "`{text}` is no model; expected acc=T9 or acc=T6, on a rig acc= {}; gyr={}, on a rig gyr= {}; \
             mag={}, on a rig mag= {}",
            names(&ladder::ACCELEROMETER),
            turns::MODEL,
            names(&rig::MODELS),
            samples::MODEL,
            names(&ladder::MAGNETOMETER)
        )
    })
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
    let files = arguments.overwrite.plan(&files_of(&arguments.recording), &outputs(arguments))?;
    let recording = columns::read(&arguments.recording, &arguments.columns, arguments.reading)?;
    check_named(&recording, &named)?;
    check_rig(&recording, &arguments.model)?;
    let progress = Progress::start();
    let calibration = calibrate(&recording, &options(arguments), &|stage| progress.stage(stage));
    drop(progress);
    let json = serde_json::to_string_pretty(&report::json::calibration(&calibration))? + "\n";
    print(arguments, &calibration, &json)?;
    write(arguments, (&recording, &calibration), &json, files)?;
    Ok(ending(arguments, &calibration, &named))
}

/// The files asked for.
fn outputs(arguments: &Arguments) -> Vec<Planned> {
    [(&arguments.out, Form::Toml), (&arguments.record, Form::Record), (&json_file(arguments), Form::Json)]
        .into_iter()
        .filter_map(|(path, form)| Some(Planned::calibration(path.as_ref()?, form)))
        .chain(arguments.html.planned())
        .collect()
}

/// The JSON's file; `--json -` is none.
fn json_file(arguments: &Arguments) -> Option<PathBuf> {
    arguments.json.clone().filter(|path| path.as_os_str() != "-")
}

fn options(arguments: &Arguments) -> Options {
    let mut options =
        Options { compare: arguments.compare, temperature: !arguments.no_temperature, ..Options::default() };
    for choice in &arguments.model {
        match *choice {
            (SensorKind::Acc, ModelChoice::Acc(field)) => (options.acc, options.rig_acc) = (field, None),
            (SensorKind::Acc, ModelChoice::Rig(name)) => options.rig_acc = Some(name),
            (SensorKind::Gyr, ModelChoice::Rig(name)) => options.rig_gyr = Some(name),
            (SensorKind::Gyr, ModelChoice::Field) => options.rig_gyr = None,
            (SensorKind::Mag, ModelChoice::Rig(name)) => options.rig_mag = Some(name),
            (SensorKind::Mag, ModelChoice::Field) => options.rig_mag = None,
            _ => {}
        }
    }
    if let Some(threshold) = arguments.threshold {
        options.multipliers = vec![threshold];
    }
    options
}

/// A rung of a rig's ladder needs the rig.
fn check_rig(recording: &Recording, models: &[(SensorKind, ModelChoice)]) -> anyhow::Result<()> {
    for (kind, choice) in models {
        let ModelChoice::Rig(name) = choice else { continue };
        let file = &recording.name;
        let along_reference = recording.gimbal.is_none() && recording.reference.is_some();
        match (kind, *name) {
            (SensorKind::Gyr, _) | (SensorKind::Mag, "M15") if along_reference => continue,
            (SensorKind::Mag, "X18" | "X21") if along_reference => anyhow::bail!(
                "{file}: --model mag={name} has hard iron on gimbals, and a reference attitude has no gimbals; \
                 use mag=M15, or mag=M12 where the reference's frame is north, east, down"
            ),
            (SensorKind::Mag, _) if along_reference => {}
            _ => on_gimbals(recording, *kind, name)?,
        }
        if *kind == SensorKind::Mag && recording.manifest.site.field_ned_ut.is_none() {
            anyhow::bail!(
                "{file}: --model mag={name} needs Earth's field, expected [site] field_ned_ut = [north, east, down] \
                 in its TOML; add it, or leave --model out for the field form"
            );
        }
    }
    Ok(())
}

/// The recording has the encoders of a rig.
fn on_gimbals(recording: &Recording, kind: SensorKind, name: &str) -> anyhow::Result<()> {
    pose::axes_and_encoders(recording).map(|_| ()).map_err(|why| {
        let file = &recording.name;
        anyhow::anyhow!("{file}: --model {kind}={name} needs a rig: {why}; leave it out for the field form")
    })
}

/// Each sensor has one model.
fn check_models(named: &[SensorKind]) -> anyhow::Result<()> {
    let twice = named.iter().enumerate().find(|(index, kind)| named[..*index].contains(kind));
    twice.map_or(Ok(()), |(_, kind)| {
        anyhow::bail!("--model: found {kind} twice, expected one model a sensor; leave one out")
    })
}

fn check_named(recording: &Recording, named: &[SensorKind]) -> anyhow::Result<()> {
    let missing: Vec<&SensorKind> = named.iter().filter(|kind| recording.sensor(**kind).is_none()).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let list = |words: Vec<String>| words.join(", ");
    anyhow::bail!(
        "{}: --model names {}, but the recording has no columns {}; leave it out of --model",
        recording.name,
        list(missing.iter().map(ToString::to_string).collect()),
        list(missing.iter().map(|kind| kind.columns().join(", ")).collect())
    )
}

/// 0 once something was accepted, nothing named was refused, and nothing is suspect that was not asked for.
fn ending(arguments: &Arguments, calibration: &Calibration, named: &[SensorKind]) -> Ending {
    let written = |status: Status| match status {
        Status::Accepted => true,
        Status::Suspect => arguments.accept_suspect,
        Status::Refused => false,
    };
    let has = |kind: SensorKind| calibration.sensor(kind).is_some_and(|outcome| written(outcome.status()));
    let any = SensorKind::ALL.into_iter().any(has);
    let suspect = calibration.sensors.iter().any(|outcome| outcome.status() == Status::Suspect);
    let done = any && named.iter().all(|kind| has(*kind)) && (arguments.accept_suspect || !suspect);
    if done { Ending::Done } else { Ending::Refused }
}

fn print(arguments: &Arguments, calibration: &Calibration, json: &str) -> anyhow::Result<()> {
    match (&arguments.json, json_file(arguments)) {
        (Some(_), None) => output::document(json),
        _ => output::text(&report::table::table(calibration)),
    }
}

/// Writes all files that were asked for, or none; those that hold sensors only where there is one.
fn write(
    arguments: &Arguments,
    (recording, calibration): (&Recording, &Calibration),
    json: &str,
    mut files: OutputSet,
) -> anyhow::Result<()> {
    let of = if arguments.accept_suspect { StoredCalibration::with_suspects } else { StoredCalibration::of };
    let stored = of(calibration, today());
    let nothing = SensorKind::ALL.into_iter().all(|kind| stored.triad(kind).is_none());
    if let Some(path) = json_file(arguments) {
        files.add(&path, json.as_bytes())?;
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

/// Today, UTC; `SOURCE_DATE_EPOCH` overrides it, for outputs that must not depend on the day.
pub(super) fn today() -> Date {
    let seconds =
        std::env::var("SOURCE_DATE_EPOCH").ok().and_then(|text| text.parse().ok()).unwrap_or_else(|| {
            SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs())
        });
    Date::from_unix(seconds)
}

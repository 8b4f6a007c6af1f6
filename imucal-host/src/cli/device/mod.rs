//! `imucal device`

mod watch;

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::Context;
use clap::{Args, Subcommand};
use imucal_core::{
    link::{FitReport, Key, LastReset, RecordState, ResetCause, VERSION},
    record::{self, CalibrationRecord, Date, HigherOrder, Order},
};

use super::{
    Ending, load,
    output::say,
    overwrite::{Overwrite, Planned, files_of},
    read,
    reading::Reading,
    refuse, warn,
};
use crate::{
    apply,
    calibrate::{Options, calibrate},
    device::{Address, DeviceError, Session, fit::BoardFit},
    recording::{Recording, SensorKind},
    report::{
        measure::{counted, rounded},
        table::words,
    },
    store::StoredCalibration,
};

#[derive(Args, Debug)]
#[command(after_help = "Example:\n  imucal device get --device serial:/dev/ttyACM0 --out unit.bin")]
pub(super) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Print the device's identity, its record and its state
    Identify(Place),
    /// Download the stored record
    Get(Get),
    /// Upload a calibration; the device checks, stores and uses it
    Put(Put),
    /// Correct a recording sample by sample on the device
    Stream(Stream),
    /// Fit a recording's observations on board, and store what is accepted
    Calibrate(Calibrate),
    /// Make the device refuse changes until its power is cycled or it is unlocked
    Lock(Place),
    /// Allow changes again; needs the device's key
    Unlock(Place),
    /// Go back to the record that was stored before the last one
    Restore(Place),
    /// Print what the device's drift watch has seen since its start
    Watch(watch::Arguments),
}

/// Where the device is.
#[derive(Args, Debug)]
pub(super) struct Place {
    /// `serial:PATH[@BAUD]`, `tcp:HOST:PORT`, `qemu[:IMAGE]`, `an505[:IMAGE]` or `microbit[:IMAGE]`
    #[arg(long, value_name = "WHERE")]
    device: Address,
    /// File that keeps the flash of qemu from one start to the next
    #[arg(long, value_name = "FILE")]
    flash: Option<PathBuf>,
    /// File of the device's key: 64 hexadecimal digits
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
}

#[derive(Args, Debug)]
struct Get {
    #[command(flatten)]
    place: Place,
    /// The record
    #[arg(long, value_name = "CAL.bin")]
    out: PathBuf,
    #[command(flatten)]
    overwrite: Overwrite,
}

#[derive(Args, Debug)]
struct Put {
    #[command(flatten)]
    place: Place,
    /// TOML or record
    calibration: PathBuf,
    /// Overwrite a record of another sensor or of a newer format
    #[arg(long)]
    replace: bool,
    #[command(flatten)]
    reading: Reading,
}

#[derive(Args, Debug)]
struct Stream {
    #[command(flatten)]
    place: Place,
    /// The recording to correct
    recording: PathBuf,
    /// The corrected recording
    #[arg(long, value_name = "REC2")]
    out: PathBuf,
    /// Apply a calibration made for another serial
    #[arg(long)]
    other_serial: bool,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    reading: Reading,
}

#[derive(Args, Debug)]
struct Calibrate {
    #[command(flatten)]
    place: Place,
    /// The recording
    recording: PathBuf,
    /// Search the gyroscope's parameters with the device's swarm of this seed first
    #[arg(long, value_name = "SEED")]
    search: Option<u64>,
    /// Overwrite a record of another sensor or of a newer format
    #[arg(long)]
    replace: bool,
    #[command(flatten)]
    reading: Reading,
}

impl Place {
    pub(super) fn open(&self) -> anyhow::Result<Session> {
        open(&self.device, self.flash.as_deref(), self.key.as_deref())
    }

    /// The files that the device itself is in.
    fn files(&self) -> Vec<PathBuf> {
        self.flash.iter().chain(&self.key).cloned().collect()
    }
}

/// Begins a session, with the key in a file if there is one.
pub(super) fn open(address: &Address, flash: Option<&Path>, key: Option<&Path>) -> anyhow::Result<Session> {
    let key = key.map(key_of).transpose()?;
    Ok(Session::open_with(address, flash, key)?)
}

/// The key in a file; what it holds is in no message.
fn key_of(path: &Path) -> anyhow::Result<Key> {
    let text = fs::read_to_string(path).with_context(|| path.display().to_string())?;
    Key::from_hex(text.trim())
        .with_context(|| format!("{}: found no key, expected 64 hexadecimal digits", path.display()))
}

/// A device that says no is a refusal; one that cannot be reached, an error.
pub(super) fn ending(done: anyhow::Result<Ending>) -> anyhow::Result<Ending> {
    match done {
        Err(error) => match error.downcast::<DeviceError>() {
            Ok(refusal @ DeviceError::Refused { .. }) => Ok(refuse(&refusal)),
            Ok(other) => Err(other.into()),
            Err(error) => Err(error),
        },
        done => done,
    }
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    ending(match &arguments.command {
        Command::Identify(place) => identify(place),
        Command::Get(arguments) => get(arguments),
        Command::Put(arguments) => put(arguments),
        Command::Stream(arguments) => stream(arguments),
        Command::Calibrate(arguments) => fit(arguments),
        Command::Lock(place) => lock(place),
        Command::Unlock(place) => unlock(place),
        Command::Restore(place) => restore(place),
        Command::Watch(arguments) => watch::run(arguments),
    })
}

fn identify(place: &Place) -> anyhow::Result<Ending> {
    let mut session = place.open()?;
    let identity = session.identity().clone();
    let status = session.status()?;
    let (major, minor, patch) = identity.firmware;
    say!("{}, serial {}", named(&identity.unit.name), named(&identity.unit.serial));
    say!(
        "firmware {major}.{minor}.{patch}, records {}.{}, protocol {VERSION}",
        identity.record_version.0,
        identity.record_version.1
    );
    say!(
        "{}, {}",
        if identity.keyed { "changes need its key" } else { "changes need no key" },
        if status.locked { "locked" } else { "not locked" }
    );
    let capacity = identity.capacity;
    say!(
        "fits {} points, {} poses, {} turns of {} blocks; a swarm of {}",
        capacity.points,
        capacity.poses,
        capacity.turns,
        capacity.blocks,
        capacity.particles
    );
    say!(
        "record {}: {}{}",
        status.sequence,
        named_state(status.record),
        if status.unsaved { ", unsaved changes" } else { "" }
    );
    if let Some(stack) = status.stack {
        say!("stack used so far: {stack} B");
    }
    let seconds = status.uptime / 1_000;
    match session.last_reset()? {
        Some(last) => say!("up for {seconds} s since {}", named_reset(&last)),
        None => say!("up for {seconds} s"),
    }
    if let Some([x, y, z]) = session.bias_of_the_day()? {
        say!(
            "taken off the rate since the start: {x:.6}, {y:.6}, {z:.6} rad/s, as its gyroscope showed at rest"
        );
    }
    Ok(Ending::Done)
}

fn lock(place: &Place) -> anyhow::Result<Ending> {
    place.open()?.lock()?;
    say!("locked: it refuses changes until its power goes, or until it is unlocked with its key");
    Ok(Ending::Done)
}

fn unlock(place: &Place) -> anyhow::Result<Ending> {
    place.open()?.unlock()?;
    say!("unlocked: it takes changes again");
    Ok(Ending::Done)
}

fn restore(place: &Place) -> anyhow::Result<Ending> {
    let Some(sequence) = place.open()?.restore_previous()? else {
        return Ok(refuse(&"no record is stored before the last one"));
    };
    say!("the record before the last one is in use again, stored as record {sequence}");
    Ok(Ending::Done)
}

/// What became of the stored record, in words.
fn named_state(state: RecordState) -> &'static str {
    match state {
        RecordState::Empty => "none is stored",
        RecordState::InUse => "in use",
        RecordState::Unconfirmed => "in use, without a serial that confirms it",
        RecordState::OtherSensor => "of another sensor, not in use",
        RecordState::NewerFormat => "of a newer format, not in use; update the firmware",
        RecordState::Unusable => "cannot be used; put another",
        RecordState::Previous => {
            "WARNING: a later record has lost bits in flash, the one before it is in use; put it again"
        }
        RecordState::Lost => {
            "WARNING: the stored record has lost bits in flash, none is in use; put it again"
        }
    }
}

/// What a run began with, in words.
fn named_reset(last: &LastReset) -> String {
    let cause = match last.cause {
        ResetCause::PowerOn => return "its power came on".into(),
        ResetCause::Unannounced => "a reset by a pin or a debugger",
        ResetCause::Fault => "WARNING: a fault",
        ResetCause::StackOverflow => "WARNING: an overflow of its stack",
        ResetCause::Watchdog => "WARNING: its watchdog ended a run that hung",
        _ => "a reset of a kind that this program does not know",
    };
    let at = if last.address == 0 { String::new() } else { format!(" at {:#010x}", last.address) };
    format!("{cause}{at}; resets since the power came on: {}", last.resets)
}

fn named(text: &str) -> &str {
    if text.is_empty() { "unknown" } else { text }
}

fn get(arguments: &Get) -> anyhow::Result<Ending> {
    let mut files = arguments.overwrite.plan(&arguments.place.files(), &[Planned::new(&arguments.out)])?;
    let Some(bytes) = arguments.place.open()?.record()? else {
        return Ok(refuse(&"no record is stored on the device"));
    };
    files.add(&arguments.out, &bytes)?;
    files.commit()?;
    say!("{} bytes into {}", bytes.len(), arguments.out.display());
    Ok(Ending::Done)
}

fn put(arguments: &Put) -> anyhow::Result<Ending> {
    let stored = match load(&arguments.calibration, arguments.reading)? {
        Ok(stored) => stored,
        Err(damaged) => return Ok(refuse(&damaged)),
    };
    let record = stored.to_record(&arguments.calibration)?;
    let mut page = [0; HigherOrder::MAX_LEN];
    let bytes = record::encode(&record, &mut page)?;
    if bytes.len() > record::MAX_LEN {
        return Ok(refuse(&format!(
            "{}: the record has {} bytes, and a message to a device holds {}; put a calibration with terms beyond the \
             first order for fewer sensors",
            arguments.calibration.display(),
            bytes.len(),
            record::MAX_LEN
        )));
    }
    let sequence = arguments.place.open()?.put_record(bytes, arguments.replace)?;
    say!("stored as record {sequence}");
    Ok(Ending::Done)
}

/// What the device corrects with.
fn on_device(session: &mut Session) -> anyhow::Result<Option<CalibrationRecord<HigherOrder>>> {
    let Some(bytes) = session.record()? else { return Ok(None) };
    Ok(Some(record::decode_as(&bytes)?))
}

fn stream(arguments: &Stream) -> anyhow::Result<Ending> {
    let mut inputs = files_of(&arguments.recording);
    inputs.extend(arguments.place.files());
    let mut files = arguments.overwrite.plan(&inputs, &Planned::recording(&arguments.out))?;
    let recording = read(&arguments.recording, arguments.reading)?;
    let mut session = arguments.place.open()?;
    let Some(record) = on_device(&mut session)? else {
        return Ok(refuse(&"no record is stored on the device; put one, or calibrate on board"));
    };
    let stored = StoredCalibration::from_record(&record);
    match apply::check(&recording, &stored, &record, arguments.other_serial) {
        Ok(warning) => warning.iter().for_each(|w| warn(w)),
        Err(refusal) => return Ok(refuse(&refusal)),
    }
    let corrected = apply::apply_by(&recording, &stored, |sensor, raw, temperature| {
        session.correct_at(sensor, raw, temperature)
    })?;
    corrected.write_into(&arguments.out, &mut files)?;
    files.commit()?;
    say!(
        "{}: {} rows corrected on the device into {}",
        recording.name,
        recording.rows(),
        arguments.out.display()
    );
    Ok(Ending::Done)
}

fn fit(arguments: &Calibrate) -> anyhow::Result<Ending> {
    let recording = read(&arguments.recording, arguments.reading)?;
    let options = Options { rig_acc: None, rig_gyr: None, rig_mag: None, ..Options::default() };
    let calibration = calibrate(&recording, &options, &|_| {});
    let mut session = arguments.place.open()?;
    let today = Date::from_unix(std::time::UNIX_EPOCH.elapsed()?.as_secs());
    let (mut accepted, mut equal) = (0, true);
    for outcome in &calibration.sensors {
        let Some(mut fit) = BoardFit::of(outcome, &session.identity().capacity) else { continue };
        fit.task.search = arguments.search.filter(|_| outcome.kind == SensorKind::Gyr);
        let report = session.fit(&fit, today)?;
        accepted += u32::from(report.refusal.is_none());
        equal &= print(&recording, outcome.kind, &fit, &report)?;
    }
    if accepted == 0 {
        return Ok(refuse(&"no sensor of this recording was accepted on board"));
    }
    let sequence = session.store_record(arguments.replace)?;
    say!("stored as record {sequence}");
    Ok(if equal { Ending::Done } else { refuse(&"the device and this machine fit differently") })
}

/// Prints what the device found; false where the same fit here differs.
fn print(
    recording: &Recording,
    kind: SensorKind,
    fit: &BoardFit,
    report: &FitReport,
) -> anyhow::Result<bool> {
    say!(
        "{}: {}: {} of {}: {} after {}, condition {}: {}",
        recording.name,
        words(kind),
        report.model.name(),
        fit.observations.len(),
        report.termination.name(),
        counted(report.iterations, "iteration"),
        rounded(report.condition.into(), 1),
        report
            .refusal
            .map_or_else(|| "accepted".into(), |refusal| format!("{}: {refusal}", refusal.reason())),
    );
    for (k, value) in report.theta.iter().enumerate() {
        let std = report.covariance.get(k * (k + 3) / 2).map(|variance| variance.sqrt());
        let std = std.filter(|std| !std.is_nan()).map_or_else(|| "∞".into(), |std| format!("{std:.1e}"));
        say!("  parameter {:>2}  {value:>14.8} ± {std}", k + 1);
    }
    let equal = fit.is_here(report);
    match equal {
        Some(equal) => say!("  the same fit here: {}", if equal { "equal bit for bit" } else { "DIFFERENT" }),
        None => say!("  searched by the device's own generator: not made again here"),
    }
    Ok(equal.unwrap_or(true))
}

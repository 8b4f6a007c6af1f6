//! `imucal capture`

mod on_device;

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use clap::Args;
use imucal_core::{
    accept::{Quantity, Refusal},
    link::CaptureTask,
    session::{
        SessionSettings,
        axes::LARGEST_STRAIN,
        guide::{Advice, Guide},
        store::NotStored,
    },
};

use super::{
    Ending,
    calibrate::today,
    columns::{self, Columns},
    output::{self, say},
    overwrite::{Overwrite, Planned, files_of},
    reading::Reading,
    refuse, warn,
};
use crate::{
    capture::{self, Capture},
    device::Address,
    effect::axis_swap,
    file::OutputSet,
    recording::{Recording, SensorKind},
    report::{self, table::words},
    store::{StoredCalibration, form::Form},
};

#[derive(Args, Debug)]
#[command(
    after_help = "Examples:\n  imucal capture tumble.csv --record tumble.bin\n  imucal capture tumble.csv --device qemu \
                  --flash unit.flash\n  imucal capture --device serial:/dev/ttyACM0 --manifest unit.toml --record unit.bin"
)]
pub(super) struct Arguments {
    /// The recording to replay through a session; without it the device's own sensors bring the samples
    #[arg(required_unless_present = "device")]
    recording: Option<PathBuf>,
    /// Let this device run the session, and store what it accepts: `serial:PATH[@BAUD]`, `tcp:HOST:PORT`,
    /// `qemu[:IMAGE]` or `an505[:IMAGE]`; without it this machine runs the same code
    #[arg(long, value_name = "WHERE")]
    device: Option<Address>,
    /// File that keeps the flash of qemu from one start to the next
    #[arg(long, value_name = "FILE", requires = "device")]
    flash: Option<PathBuf>,
    /// File of the device's key: 64 hexadecimal digits
    #[arg(long, value_name = "FILE", requires = "device")]
    key: Option<PathBuf>,
    /// Manifest with the units of the device's own sensors; without it they are m/s², rad/s and µT
    #[arg(long, value_name = "FILE", conflicts_with = "recording", requires = "device")]
    manifest: Option<PathBuf>,
    /// Give up where the device's own sensors have not reached the targets after so many seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 900, conflicts_with = "recording")]
    within: u32,
    /// Error of a calibrated vector at which a sensor is done, in percent of its length: accelerometer, gyroscope,
    /// magnetometer; 0: the sensor is not asked for
    #[arg(long, value_name = "A,G,M", value_delimiter = ',', default_value = "0.1,0.3,1")]
    target: Vec<f32>,
    /// Replay at so many times the speed of the recording; without it as fast as it goes
    #[arg(long, value_name = "FACTOR")]
    speed: Option<f64>,
    /// Write the accepted sensors as a record
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Write the accepted sensors as TOML
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    columns: Columns,
    #[command(flatten)]
    reading: Reading,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    anyhow::ensure!(
        arguments.target.len() == SensorKind::ALL.len()
            && arguments.target.iter().all(|percent| (0.0..=100.0).contains(percent)),
        "--target: three shares in percent, 0 to 100, such as 0.1,0.3,1"
    );
    anyhow::ensure!(
        arguments.speed.is_none_or(|factor| factor.is_finite() && factor > 0.0),
        "--speed: a factor above 0"
    );
    let mut inputs: Vec<PathBuf> = arguments.recording.iter().flat_map(|path| files_of(path)).collect();
    inputs.extend(arguments.flash.iter().chain(&arguments.key).chain(&arguments.manifest).cloned());
    let files = arguments.overwrite.plan(&inputs, &planned(arguments))?;
    match (&arguments.device, &arguments.recording) {
        (Some(device), recording) => on_device::run(arguments, device, recording.as_deref(), files),
        (None, Some(recording)) => here(arguments, recording, files),
        (None, None) => anyhow::bail!("name a recording or --device"),
    }
}

/// Runs the session on this machine.
fn here(arguments: &Arguments, path: &Path, mut files: OutputSet) -> anyhow::Result<Ending> {
    let recording = columns::read(path, &arguments.columns, arguments.reading)?;
    let recorded = recorded(&recording);
    let task = task_of(arguments, &recording, &recorded)?;
    say!("{}: replayed through the session of a device", recording.name);
    let mut lines = Lines::new(arguments, task.hold, &recorded);
    let Some(session) = replay(&recording, &task, &mut lines)? else {
        return Ok(refuse(&"the manifest's gravity or units are none that a session takes"));
    };
    output::text(&report::capture::state(&session.guide(), session.settings(), &recorded))?;
    let (stored, refused) = capture::calibration(&session, &task, &recording, today());
    for (kind, why) in &refused {
        say!("{} is not calibrated: {}", words(*kind), reason(why, *kind, &task));
    }
    for kind in recorded {
        if let Some(terms) = stored.triad(kind).and_then(|triad| triad.temperature.as_ref()) {
            say!("{} follows the temperature: gain and bias hold at {:.1} °C", words(kind), terms.reference);
        }
    }
    if stored.mag.is_some() {
        say!("{}", report::capture::axes(capture::axes_of_magnetometer(&session)));
    }
    if SensorKind::ALL.into_iter().all(|kind| stored.triad(kind).is_none()) {
        warn_of_nothing(arguments);
    } else {
        write(arguments, &stored, &mut files)?;
        files.commit()?;
    }
    let enough = session.guide().advice == Advice::Enough;
    Ok(if enough { Ending::Done } else { Ending::Refused })
}

fn recorded(recording: &Recording) -> Vec<SensorKind> {
    SensorKind::ALL.into_iter().filter(|kind| recording.sensor(*kind).is_some()).collect()
}

/// The session for a recording; a sensor that is not recorded is not asked for.
fn task_of(
    arguments: &Arguments,
    recording: &Recording,
    recorded: &[SensorKind],
) -> anyhow::Result<CaptureTask> {
    Ok(capture::task(&recording.manifest, shares(arguments, recorded))?)
}

/// Targets as shares of a vector's length.
fn shares(arguments: &Arguments, asked: &[SensorKind]) -> [f32; 3] {
    SensorKind::ALL
        .map(|kind| if asked.contains(&kind) { arguments.target[kind as usize] / 100.0 } else { 0.0 })
}

fn planned(arguments: &Arguments) -> Vec<Planned> {
    let toml = arguments.out.iter().map(|path| Planned::calibration(path, Form::Toml));
    let record = arguments.record.iter().map(|path| Planned::calibration(path, Form::Record));
    toml.chain(record).collect()
}

fn warn_of_nothing(arguments: &Arguments) {
    for path in arguments.out.iter().chain(&arguments.record) {
        warn(&format!("{}: not written, since no sensor was accepted", path.display()));
    }
}

fn write(arguments: &Arguments, stored: &StoredCalibration, files: &mut OutputSet) -> anyhow::Result<()> {
    if let Some(path) = &arguments.out {
        stored.write_toml(path, files)?;
    }
    if let Some(path) = &arguments.record {
        stored.write_record(path, files)?;
    }
    Ok(())
}

/// Prints a line whenever something has changed, in step with the recording where that was asked for.
struct Lines<'a> {
    speed: Option<f64>,
    hold: f32,
    asked: &'a [SensorKind],
    before: Option<Guide>,
    last: f64,
}

impl<'a> Lines<'a> {
    fn new(arguments: &Arguments, hold: f32, asked: &'a [SensorKind]) -> Self {
        Self { speed: arguments.speed, hold, asked, before: None, last: 0.0 }
    }

    fn see(&mut self, time: f64, guide: &Guide) -> anyhow::Result<()> {
        if let Some(speed) = self.speed {
            std::thread::sleep(Duration::from_secs_f64(((time - self.last) / speed).clamp(0.0, 1.0)));
            self.last = time;
        }
        if self.before.as_ref().is_none_or(|before| capture::differ(before, guide)) {
            output::line(format_args!("{}", report::capture::line(time, guide, self.hold, self.asked)))?;
            self.before = Some(*guide);
        }
        Ok(())
    }
}

fn replay(
    recording: &Recording,
    task: &CaptureTask,
    lines: &mut Lines<'_>,
) -> anyhow::Result<Option<Box<Capture>>> {
    let mut failed = None;
    let session = capture::replay(recording, task, &mut |time, session| {
        if failed.is_none() {
            failed = lines.see(time, &session.guide()).err();
        }
    });
    match failed {
        Some(error) => Err(error),
        None => Ok(session),
    }
}

fn reason(why: &NotStored, kind: SensorKind, task: &CaptureTask) -> String {
    match why {
        NotStored::NoEstimate => TOO_LITTLE.into(),
        NotStored::Refused(refusal) => refused(refusal, kind, task),
        NotStored::Surer { stored, new } => surer(*stored, *new),
        NotStored::HigherOrder => HIGHER_ORDER.into(),
        NotStored::OwnAxes => OWN_AXES.into(),
        NotStored::OtherAxes { strain, .. } => other_axes(*strain),
        NotStored::OtherUnit => OTHER_UNIT.into(),
    }
}

const HIGHER_ORDER: &str = "the one in use has nonlinear terms, or terms of temperature to second order, which a session does not fit";
const OWN_AXES: &str = "the one in use is in the accelerometer's axes, this one in its own";
const OTHER_UNIT: &str = "the one in use gives its values in another unit, on which what reads them relies";
const TOO_LITTLE: &str = "too few rests, turns or places of the field for a fit";

/// A refusal, and what would mend axes on which the sensors disagree.
fn refused(refusal: &Refusal, kind: SensorKind, task: &CaptureTask) -> String {
    let Refusal::Implausible { what: Quantity::Axes, value, .. } = refusal else {
        return refusal.to_string();
    };
    let swap = format!("{kind}.axis_swap ({})", axis_swap::columns(kind, *value as usize));
    match (kind, task.field_down) {
        (SensorKind::Mag, None) => format!(
            "it is mounted in another order of the axes than the accelerometer, or it is mirrored, {swap}; \
             add [site] latitude_deg to the manifest, which decides it"
        ),
        (SensorKind::Mag, Some(_)) => format!(
            "{swap} would explain that the dip comes out the other way than at [site]; correct the columns"
        ),
        (SensorKind::Gyr, _) => format!(
            "{swap} would explain that turns go against gravity's; correct its columns, or the accelerometer's \
             where that is refused as well"
        ),
        (SensorKind::Acc, _) => format!(
            "{swap} would explain that the other sensors disagree with it on the axes; correct its columns, or theirs"
        ),
    }
}

/// Why a session's triad cannot be turned into the axes of a record.
fn other_axes(strain: f32) -> String {
    let most = 100.0 * LARGEST_STRAIN;
    let by = if strain.is_finite() {
        format!("differs from this one by {:.1} % beyond a rotation, of {most} % allowed", 100.0 * strain)
    } else {
        "is in other units than this one, or a mirror image of it".into()
    };
    format!("the axes of the record in use are not known, since its accelerometer {by}")
}

fn surer(stored: f32, new: f32) -> String {
    format!("the one in use is surer, {:.3} % against {:.3} %", 100.0 * stored, 100.0 * new)
}

/// What is needed to print the end of a session.
fn settings_of(task: &CaptureTask) -> SessionSettings {
    task.settings().unwrap_or_default()
}

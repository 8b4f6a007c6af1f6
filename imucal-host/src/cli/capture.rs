//! `imucal capture`

use std::{path::PathBuf, time::Duration};

use clap::Args;
use imucal_core::session::{SessionSettings, guide::Advice, store::NotStored};

use super::{
    Ending,
    calibrate::today,
    output::{self, say},
    overwrite::{Overwrite, Planned, files_of},
    read,
    reading::Reading,
    warn,
};
use crate::{
    capture::{self, Capture},
    file::OutputSet,
    recording::{Recording, SensorKind},
    report::{self, table::words},
    store::{StoredCalibration, form::Form},
};

#[derive(Args, Debug)]
#[command(after_help = "Example:\n  imucal capture tumble.csv --record tumble.bin")]
pub(super) struct Arguments {
    /// The recording to replay through the session of a device
    recording: PathBuf,
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
    let outputs = planned(arguments);
    let mut files = arguments.overwrite.plan(&files_of(&arguments.recording), &outputs)?;
    let recording = read(&arguments.recording, arguments.reading)?;
    let recorded: Vec<SensorKind> =
        SensorKind::ALL.into_iter().filter(|kind| recording.sensor(*kind).is_some()).collect();
    let mut settings = capture::settings(&recording);
    for kind in SensorKind::ALL {
        // A sensor that is not recorded is not asked for.
        let asked = if recorded.contains(&kind) { arguments.target[kind as usize] } else { 0.0 };
        settings.target[kind as usize] = asked / 100.0;
    }
    say!("{}: replayed through the session of a device", recording.name);
    let session = replay(arguments, &recording, settings, &recorded)?;
    output::text(&report::capture::state(&session, &recorded))?;
    let (stored, refused) = capture::calibration(&session, &recording, today());
    for (kind, why) in &refused {
        say!("{} is not calibrated: {}", words(*kind), reason(why));
    }
    let nothing = SensorKind::ALL.into_iter().all(|kind| stored.triad(kind).is_none());
    for path in arguments.out.iter().chain(&arguments.record).filter(|_| nothing) {
        warn(&format!("{}: not written, since no sensor was accepted", path.display()));
    }
    if !nothing {
        write(arguments, &stored, &mut files)?;
        files.commit()?;
    }
    let enough = session.guide().advice == Advice::Enough;
    Ok(if enough { Ending::Done } else { Ending::Refused })
}

fn planned(arguments: &Arguments) -> Vec<Planned> {
    let toml = arguments.out.iter().map(|path| Planned::calibration(path, Form::Toml));
    let record = arguments.record.iter().map(|path| Planned::calibration(path, Form::Record));
    toml.chain(record).collect()
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
fn replay(
    arguments: &Arguments,
    recording: &Recording,
    settings: SessionSettings,
    recorded: &[SensorKind],
) -> anyhow::Result<Box<Capture>> {
    let mut before = None;
    let mut failed = None;
    let mut last = 0.0;
    let session = capture::replay(recording, settings, &mut |time, session| {
        if let Some(speed) = arguments.speed {
            std::thread::sleep(Duration::from_secs_f64(((time - last) / speed).clamp(0.0, 1.0)));
            last = time;
        }
        let guide = session.guide();
        if failed.is_none() && before.as_ref().is_none_or(|before| capture::differ(before, &guide)) {
            failed = output::line(format_args!("{}", report::capture::line(time, session, recorded))).err();
            before = Some(guide);
        }
    });
    match failed {
        Some(error) => Err(error),
        None => Ok(session),
    }
}

fn reason(why: &NotStored) -> String {
    match why {
        NotStored::NoEstimate => "too few rests, turns or places of the field for a fit".into(),
        NotStored::Refused(refusal) => refusal.to_string(),
        NotStored::Surer { stored, new } => {
            format!("the stored one is surer, {:.3} % against {:.3} %", 100.0 * stored, 100.0 * new)
        }
    }
}

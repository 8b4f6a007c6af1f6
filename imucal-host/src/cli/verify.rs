//! `imucal verify`

use std::path::PathBuf;

use clap::Args;
use imucal_core::record::{self, CalibrationRecord, HigherOrder, Order};

use super::{
    Ending,
    columns::{self, Columns},
    device::{self, ending},
    load,
    output::say,
    progress::Progress,
    reading::Reading,
    refuse, warn,
};
use crate::{
    apply,
    calibrate::{Options, calibrate},
    device::{Address, Session},
    equivalence::{
        FitEquivalence, SampleEquivalence, board, board::BoardSamples, fits, samples, samples::Samples,
    },
    recording::{Recording, SensorKind},
    report::table::words,
    store::StoredCalibration,
};

#[derive(Args, Debug)]
#[command(after_help = "Example:\n  imucal verify tumble.csv --calibration unit.bin --device qemu")]
pub(super) struct Arguments {
    /// The recording to replay
    recording: PathBuf,
    /// The calibration: TOML or record
    #[arg(long, value_name = "CAL")]
    calibration: PathBuf,
    /// Replay through a device as well, and compare bits: `serial:PATH[@BAUD]`, `tcp:HOST:PORT`, `qemu[:IMAGE]`, `an505[:IMAGE]`
    /// or `microbit[:IMAGE]`. It stores the calibration's record
    #[arg(long, value_name = "WHERE")]
    device: Option<Address>,
    /// File that keeps the flash of qemu from one start to the next
    #[arg(long, value_name = "FILE", requires = "device")]
    flash: Option<PathBuf>,
    /// File of the device's key: 64 hexadecimal digits
    #[arg(long, value_name = "FILE", requires = "device")]
    key: Option<PathBuf>,
    /// Compare although the calibration was made for another serial
    #[arg(long, alias = "force")]
    other_serial: bool,
    #[command(flatten)]
    columns: Columns,
    #[command(flatten)]
    reading: Reading,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let recording = columns::read(&arguments.recording, &arguments.columns, arguments.reading)?;
    let stored = match load(&arguments.calibration, arguments.reading)? {
        Ok(stored) => stored,
        Err(damaged) => return Ok(refuse(&damaged)),
    };
    let record = stored.to_record(&arguments.calibration)?;
    match apply::check(&recording, &stored, &record, arguments.other_serial) {
        Ok(warning) => warning.iter().for_each(|w| warn(w)),
        Err(refusal) => return Ok(refuse(&refusal)),
    }
    let progress = Progress::start();
    progress.stage("comparing samples");
    let samples: Vec<SampleEquivalence> = SensorKind::ALL
        .into_iter()
        .filter_map(|kind| {
            let triad = stored.triad(kind)?;
            Some(samples::compare(Samples::of(&recording, kind)?, triad, record.triad(kind.into())?))
        })
        .collect();
    progress.stage("fitting again, by the core and by the reference");
    let fits = refit(&recording, &stored);
    drop(progress);
    samples.iter().try_for_each(print_samples)?;
    fits.iter().try_for_each(print_fit)?;
    let alike = match &arguments.device {
        None => true,
        Some(address) => {
            let session = device::open(address, arguments.flash.as_deref(), arguments.key.as_deref());
            match session.and_then(|mut session| replay(&mut session, &recording, &record)) {
                Err(error) => return ending(Err(error)),
                Ok(alike) => alike,
            }
        }
    };
    let passed =
        alike && samples.iter().all(SampleEquivalence::passes) && fits.iter().all(FitEquivalence::passes);
    say!("{}", if passed { "equivalent" } else { "NOT equivalent" });
    Ok(if passed { Ending::Done } else { Ending::Refused })
}

/// Replays fits and samples through a device; whether every bit is the same.
fn replay(
    session: &mut Session,
    recording: &Recording,
    record: &CalibrationRecord<HigherOrder>,
) -> anyhow::Result<bool> {
    let options = Options { rig_acc: None, rig_gyr: None, rig_mag: None, ..Options::default() };
    let fits = board::fits(session, &calibrate(recording, &options, &|_| {}))?;
    let mut page = [0; HigherOrder::MAX_LEN];
    let bytes = record::encode(record, &mut page)?;
    session.put_record(bytes, false)?;
    let kept = session.record()?.as_deref() == Some(bytes);
    let samples = board::samples(session, recording, record)?;
    for fit in &fits {
        say!("{}: fitted on the device: {}", words(fit.kind), bits(fit.equal));
    }
    say!("record of {} bytes, stored and read back: {}", bytes.len(), bits(kept));
    for s in &samples {
        say!(
            "{}: {} samples corrected on the device: {}{}",
            words(s.kind),
            s.samples,
            bits(s.passes()),
            s.first
                .map_or_else(String::new, |first| format!(": {} of them, the first is {first}", s.different))
        );
    }
    Ok(kept && fits.iter().all(|fit| fit.equal) && samples.iter().all(BoardSamples::passes))
}

fn bits(equal: bool) -> &'static str {
    if equal { "equal bit for bit" } else { "DIFFERENT" }
}

/// Fits again whatever the recording and the calibration share, by the models that the calibration names.
fn refit(recording: &Recording, stored: &StoredCalibration) -> Vec<FitEquivalence> {
    let calibration = calibrate(recording, &stored.models(), &|_| {});
    calibration
        .sensors
        .iter()
        .filter(|outcome| stored.triad(outcome.kind).is_some())
        .filter_map(|outcome| fits::compare(recording, outcome))
        .collect()
}

fn print_samples(s: &SampleEquivalence) -> anyhow::Result<()> {
    say!(
        "{}: {} samples, {} of them corrected for temperature: f32 core against f64 reference: max {:.3e} {unit}, rms \
         {:.3e} {unit}, max {:.0} ulp; {:.2e} of full scale ({:.4} {unit}); {:.2} times the bound of its roundings, \
         limit {}{}: {}",
        words(s.kind),
        s.samples,
        s.warm,
        s.max,
        s.rms,
        s.max_ulp,
        s.max / s.full_scale,
        s.full_scale,
        s.of_bound,
        samples::LIMIT,
        if s.record_is_nearest { "" } else { "; the record holds OTHER FIGURES than were stored" },
        if s.passes() { "ok" } else { "FAILED" },
        unit = s.unit,
    );
    Ok(())
}

fn print_fit(fit: &FitEquivalence) -> anyhow::Result<()> {
    say!(
        "{}: fitted again: f32 core (stopped by {}) against f64 reference, nominal SI: {}",
        words(fit.kind),
        fit.termination.name(),
        if fit.passes() { "ok" } else { "FAILED" }
    );
    for p in &fit.parameters {
        say!(
            "  {:<8} {:>14.8} {:>14.8} {:>9.1e} = {:>7.1} ulp = {:.4} std errors",
            p.name,
            p.device,
            p.reference,
            p.device - p.reference,
            p.ulp,
            (p.device - p.reference).abs() / p.std
        );
    }
    Ok(())
}

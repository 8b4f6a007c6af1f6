//! `imucal check`

use std::path::PathBuf;

use clap::Args;

use super::{
    Ending,
    calibrate::today,
    columns::{self, Columns},
    json::Json,
    load, output,
    overwrite::{Overwrite, Planned, files_of},
    reading::Reading,
    refuse, warn,
};
use crate::{
    apply,
    calibrate::{Calibration, calibrate},
    compare::{CompareFault, Comparison, SensorComparison, compare},
    recording::{Recording, SensorKind, median},
    report::{self, table::words},
    store::StoredCalibration,
};

#[derive(Args, Debug)]
#[command(after_help = "Example:\n  imucal check tumble.csv --calibration unit.toml")]
pub(super) struct Arguments {
    /// A recording that a calibration can be made from
    recording: PathBuf,
    /// The calibration to check: TOML or record
    #[arg(long, value_name = "CAL")]
    calibration: PathBuf,
    /// Check a calibration made for another serial
    #[arg(long)]
    other_serial: bool,
    #[command(flatten)]
    json: Json,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    columns: Columns,
    #[command(flatten)]
    reading: Reading,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let outputs: Vec<Planned> = arguments.json.planned().into_iter().collect();
    let mut inputs = files_of(&arguments.recording);
    inputs.push(arguments.calibration.clone());
    let mut files = arguments.overwrite.plan(&inputs, &outputs)?;
    let stored = match load(&arguments.calibration, arguments.reading)? {
        Ok(stored) => stored,
        Err(damaged) => return Ok(refuse(&damaged)),
    };
    let recording = columns::read(&arguments.recording, &arguments.columns, arguments.reading)?;
    let record = stored.to_record(&arguments.calibration)?;
    match apply::check(&recording, &stored, &record, arguments.other_serial) {
        Ok(warning) => warning.iter().for_each(|warning| warn(warning)),
        Err(refusal) => return Ok(refuse(&refusal)),
    }
    let calibration = calibrate(&recording, &stored.models(), &|_| {});
    calibration.warnings.iter().for_each(|warning| warn(warning));
    let now = StoredCalibration::of(&calibration, today());
    let stored = at_temperature_of(&recording, stored, &now);
    let comparison = match compare(&stored, &now, arguments.other_serial) {
        Ok(comparison) => comparison,
        Err(CompareFault::Nothing { other_terms, without_errors }) => {
            output::text(&unchecked(&stored, &calibration, &other_terms, &without_errors))?;
            return Ok(refuse(&"this recording calibrates none of the sensors, so that nothing is checked"));
        }
        Err(fault) => return Ok(refuse(&fault)),
    };
    let text = || {
        let unchecked = unchecked(&stored, &calibration, &comparison.other_terms, &comparison.without_errors);
        verdicts(&comparison) + &unchecked + &report::compare::compared(&comparison)
    };
    arguments.json.give(&mut files, &comparison, &text)?;
    files.commit()?;
    // What states no errors can be off by anything.
    let fits =
        comparison.without_errors.is_empty() && comparison.sensors.iter().all(|sensor| !sensor.has_moved());
    Ok(if fits { Ending::Done } else { Ending::Refused })
}

/// The calibration as it is at the temperature of a recording whose own fit shows no dependence on it.
fn at_temperature_of(
    recording: &Recording,
    mut stored: StoredCalibration,
    now: &StoredCalibration,
) -> StoredCalibration {
    let known = recording.temperature.iter().flatten().copied().filter(|temperature| temperature.is_finite());
    let Some(temperature) = median(known.collect()) else { return stored };
    let StoredCalibration { acc, gyr, mag, .. } = &mut stored;
    for (kind, triad) in SensorKind::ALL.into_iter().zip([acc, gyr, mag]) {
        if let Some(triad) = triad
            && now.triad(kind).is_some_and(|now| now.temperature.is_none())
        {
            *triad = triad.at_temperature(temperature);
        }
    }
    stored
}

/// A line for each sensor that was compared; ends its lines.
fn verdicts(comparison: &Comparison) -> String {
    let line = |sensor: &SensorComparison| {
        let verdict = match (sensor.has_moved(), sensor.gain) {
            (true, _) => "the calibration no longer fits",
            (false, Some(_)) => "the calibration still fits, within the errors of both",
            (false, None) => "its biases still fit, within the errors of both; its gains are not checked",
        };
        format!("{}: {verdict}\n", words(sensor.sensor))
    };
    comparison.sensors.iter().map(line).collect()
}

/// A line for each calibrated sensor that this recording does not calibrate, or that cannot be compared, with the reason.
fn unchecked(
    stored: &StoredCalibration,
    calibration: &Calibration,
    other_terms: &[SensorKind],
    without_errors: &[SensorKind],
) -> String {
    let mut text = String::new();
    for kind in SensorKind::ALL.into_iter().filter(|kind| stored.triad(*kind).is_some()) {
        let outcome = calibration.sensors.iter().find(|outcome| outcome.kind == kind);
        let why = match outcome {
            None => "it is not in this recording".to_owned(),
            Some(outcome) if outcome.accepted().is_some() => match kind {
                kind if other_terms.contains(&kind) => report::compare::OTHER_TERMS.to_owned(),
                kind if without_errors.contains(&kind) => report::compare::WITHOUT_ERRORS.to_owned(),
                _ => continue,
            },
            Some(outcome) => match &outcome.verdict {
                Err(refused) => format!("this recording does not calibrate it: {}", refused.refusal),
                Ok(()) => "its fit to this recording is suspect: its residual is not the noise".to_owned(),
            },
        };
        text += &format!("{}: not checked; {why}\n", words(kind));
    }
    text
}

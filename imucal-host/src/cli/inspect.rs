//! `imucal inspect`

use std::path::PathBuf;

use clap::Args;
use imucal_core::triad::Triad;
use nalgebra::Matrix3;

use super::{
    Ending, load,
    output::{self, say},
    reading::Reading,
};
use crate::{
    diagnosis::watched::Watched,
    recording::{SensorKind, Unit},
    report::{
        measure::{percent, plain, rounded},
        table::{parameters, words},
        terms::{write_nonlinearity, write_temperature},
        watch,
    },
    store::{StoredTriad, watch_file},
};

#[derive(Args, Debug)]
#[command(after_help = "Example:\n  imucal inspect unit.bin")]
pub(super) struct Arguments {
    /// The calibration: TOML or record; or the summary of a device's drift watch
    calibration: PathBuf,
    #[command(flatten)]
    reading: Reading,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let limits = arguments.reading.limits();
    // What cannot be read is reported below, as of a calibration.
    if limits.read_small(&arguments.calibration).is_ok_and(|bytes| watch_file::is_summary(&bytes)) {
        return print_watch(arguments);
    }
    let stored = match load(&arguments.calibration, arguments.reading)? {
        Ok(stored) => stored,
        Err(damaged) => {
            say!("{damaged}");
            return Ok(Ending::Refused);
        }
    };
    say!("{}: intact", arguments.calibration.display());
    say!("sensor {}, serial {}", or_unknown(&stored.sensor.name), or_unknown(&stored.sensor.serial));
    say!("made on {}", stored.date);
    for kind in SensorKind::ALL {
        match stored.triad(kind) {
            Some(triad) => print_triad(kind, triad)?,
            None => say!("{}: not calibrated", words(kind)),
        }
    }
    Ok(Ending::Done)
}

fn print_watch(arguments: &Arguments) -> anyhow::Result<Ending> {
    match watch_file::read_within(&arguments.calibration, &arguments.reading.limits()) {
        Ok(summary) => {
            say!("{}: intact", arguments.calibration.display());
            output::text(&watch::watched(&Watched::of(&summary, &[])))?;
            Ok(Ending::Done)
        }
        Err(damaged) => {
            say!("{damaged}");
            Ok(Ending::Refused)
        }
    }
}

fn or_unknown(text: &str) -> &str {
    if text.is_empty() { "unknown" } else { text }
}

fn print_triad(kind: SensorKind, triad: &StoredTriad) -> anyhow::Result<()> {
    say!(
        "{} ({}): calibrated [{}] = gain · (raw [{}] − bias)",
        words(kind),
        triad.model,
        triad.unit_out,
        triad.unit_in
    );
    let std = Triad { gain: rows(triad.gain_std), bias: triad.bias_std.into() };
    output::text(&parameters(&Triad { gain: rows(triad.gain), bias: triad.bias.into() }, &std))?;
    let unit = match kind {
        SensorKind::Gyr => "rad a turn".into(),
        _ => Unit::of_residuals(triad.unit_in, triad.unit_out).to_string(),
    };
    let held = triad.held_out_rms.map_or_else(|| "not known".into(), plain);
    say!(
        "  {} observations, {} parameters; rms {} {unit}, held out {held}; condition {}, coverage {}",
        triad.observations,
        triad.parameters,
        plain(triad.rms),
        rounded(triad.condition, 1),
        percent(triad.coverage)
    );
    let mut terms = String::new();
    if let Some(warm) = &triad.temperature {
        write_temperature(&mut terms, warm, triad.unit_in)?;
    }
    if let Some(bent) = &triad.nonlinearity {
        write_nonlinearity(&mut terms, bent, triad.unit_in)?;
    }
    if !terms.is_empty() {
        output::text(&terms)?;
    }
    if let Some(own) = &triad.provenance {
        say!("  made on {}, serial {}", own.date, or_unknown(&own.serial));
    }
    Ok(())
}

fn rows(entries: [[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| entries[row][column])
}

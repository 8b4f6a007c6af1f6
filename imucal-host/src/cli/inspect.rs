//! `imucal inspect`

use std::path::PathBuf;

use clap::Args;

use super::{
    Ending, load,
    output::{self, say},
    reading::Reading,
};
use crate::{
    diagnosis::watched::Watched,
    recording::SensorKind,
    report::{
        measure::{measure, percent, plain, rounded},
        table::words,
        watch,
    },
    store::{StoredTriad, watch_file},
};

#[derive(Args, Debug)]
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
    for row in 0..3 {
        let gain: Vec<String> =
            (0..3).map(|column| measure(triad.gain[row][column], triad.gain_std[row][column])).collect();
        say!(
            "  {}  {:>26} {:>26} {:>26}   {:>22}",
            ["x", "y", "z"][row],
            gain[0],
            gain[1],
            gain[2],
            measure(triad.bias[row], triad.bias_std[row])
        );
    }
    let unit = if kind == SensorKind::Gyr { "rad a turn".into() } else { triad.unit_out.to_string() };
    let held = triad.held_out_rms.map_or_else(|| "not known".into(), plain);
    say!(
        "  {} observations, {} parameters; rms {} {unit}, held out {held}; condition {}, coverage {}",
        triad.observations,
        triad.parameters,
        plain(triad.rms),
        rounded(triad.condition, 1),
        percent(triad.coverage)
    );
    if let Some(own) = &triad.provenance {
        say!("  made on {}, serial {}", own.date, or_unknown(&own.serial));
    }
    Ok(())
}

//! `imucal corrupt`

use std::path::PathBuf;

use clap::Args;

use super::{
    Ending, load,
    output::say,
    overwrite::{Overwrite, Planned, files_of},
    read,
    reading::Reading,
    refuse, warn,
};
use crate::{
    corrupt::{self, Drawing},
    store::noise_file::NoiseFile,
};

#[derive(Args, Debug)]
#[command(
    after_help = "Example:\n  imucal corrupt sim.csv --calibration cal.toml --noise noise.json --out as-read.csv"
)]
pub(super) struct Arguments {
    /// An ideal stream: a simulator's columns `sim_acc_x` and so on, or `acc_x` and so on
    simulated: PathBuf,
    /// The calibration of the unit: TOML or record
    #[arg(long, value_name = "CAL")]
    calibration: PathBuf,
    /// What the unit would have read
    #[arg(long, value_name = "REC")]
    out: PathBuf,
    /// The noise of the unit, by `imucal noise --json`; without it there is none
    #[arg(long, value_name = "NOISE.json")]
    noise: Option<PathBuf>,
    /// Seed of the noise
    #[arg(long, value_name = "N", default_value_t = 1, requires = "noise")]
    seed: u64,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    reading: Reading,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let mut inputs = files_of(&arguments.simulated);
    inputs.push(arguments.calibration.clone());
    inputs.extend(arguments.noise.clone());
    let mut files = arguments.overwrite.plan(&inputs, &Planned::recording(&arguments.out))?;
    let ideal = read(&arguments.simulated, arguments.reading)?;
    let stored = match load(&arguments.calibration, arguments.reading)? {
        Ok(stored) => stored,
        Err(damaged) => return Ok(refuse(&damaged)),
    };
    let record = stored.to_record(&arguments.calibration)?;
    let limits = arguments.reading.limits();
    let noise = arguments.noise.as_ref().map(|path| NoiseFile::read(path, &limits)).transpose()?;
    let drawing = noise.as_ref().map(|noise| Drawing { noise, seed: arguments.seed });
    let read = match corrupt::corrupt(&ideal, &stored, &record, drawing) {
        Ok(read) => read,
        Err(refusal) => return Ok(refuse(&refusal)),
    };
    if let Some(noise) = &noise {
        for kind in crate::recording::SensorKind::ALL {
            let known = noise.sensor(kind).is_some_and(|sensor| sensor.known_axes().next().is_some());
            if stored.triad(kind).is_some() && !known {
                warn(&format!("{kind}: no noise is added, since {} has no estimate of it", noise.recording));
            }
        }
    }
    let written = read.write_into(&arguments.out, &mut files)?;
    written.left_out.iter().for_each(|warning| warn(warning));
    files.commit()?;
    say!("{}: {} rows corrupted into {}", ideal.name, read.rows(), arguments.out.display());
    Ok(Ending::Done)
}

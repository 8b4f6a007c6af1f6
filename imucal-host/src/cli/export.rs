//! `imucal export`

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;

use super::{
    Ending, load,
    output::{self, say},
    overwrite::{Overwrite, Planned},
    reading::Reading,
    refuse, warn,
};
use crate::{
    diagnosis::finding::{self, Cause, Diagnosis},
    export::{self, Inputs, Target},
    file::Limits,
    store::{covariance_file::CovarianceFile, noise_file::NoiseFile},
};

#[derive(Args, Debug)]
#[command(after_help = "Example:\n  imucal export cal.toml --to c-header --out imu_calibration.h")]
pub(super) struct Arguments {
    /// The calibration: TOML or record
    calibration: PathBuf,
    /// The program that reads it
    #[arg(long, value_name = "TARGET")]
    to: Target,
    /// The noise of the unit, by `imucal noise --json`
    #[arg(long, value_name = "NOISE.json")]
    noise: Option<PathBuf>,
    /// How the calibration's errors vary together, by the `imucal calibrate --json` that wrote it; for `python`
    #[arg(long, value_name = "CAL.json")]
    covariance: Option<PathBuf>,
    /// What a diagnosis found, by `imucal diagnose --json`; the targets have no place for it and list it
    #[arg(long, value_name = "DIAGNOSIS.json")]
    diagnosis: Option<PathBuf>,
    /// Samples a second of the target; without it those of the noise's recording. For `kalibr`, `sdf` and `ros`
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Write to a file in place of the screen
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    reading: Reading,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let mut inputs = vec![arguments.calibration.clone()];
    inputs.extend(arguments.noise.iter().chain(&arguments.covariance).chain(&arguments.diagnosis).cloned());
    let outputs: Vec<Planned> = arguments.out.iter().map(Planned::new).collect();
    let mut files = arguments.overwrite.plan(&inputs, &outputs)?;
    let limits = arguments.reading.limits();
    let calibration = match load(&arguments.calibration, arguments.reading)? {
        Ok(stored) => stored,
        Err(damaged) => return Ok(refuse(&damaged)),
    };
    let noise = arguments.noise.as_ref().map(|path| NoiseFile::read(path, &limits)).transpose()?;
    anyhow::ensure!(
        arguments.noise.is_none() || arguments.to.takes_noise(),
        "--noise: found another target, expected `kalibr`, `sdf`, `python`, `ros` or `csv`; the others have no place for noise"
    );
    anyhow::ensure!(
        arguments.covariance.is_none() || arguments.to.takes_covariance(),
        "--covariance: found another target, expected `python`; the others have no place for covariances"
    );
    anyhow::ensure!(
        arguments.rate.is_none() || arguments.to.takes_rate(),
        "--rate: found another target, expected `kalibr`, `sdf` or `ros`; nothing in the others depends on a rate"
    );
    let covariance = arguments.covariance.as_ref();
    let covariance = covariance.map(|path| CovarianceFile::read(path, &limits, &calibration)).transpose()?;
    let causes =
        arguments.diagnosis.as_ref().map(|path| causes(path, &limits)).transpose()?.unwrap_or_default();
    if let Some(noise) = noise.as_ref().filter(|noise| {
        !noise.serial.is_empty()
            && !calibration.sensor.serial.is_empty()
            && noise.serial != calibration.sensor.serial
    }) {
        warn(&format!(
            "the noise is of serial `{}`, the calibration of `{}`; check that they belong together",
            noise.serial, calibration.sensor.serial
        ));
    }
    let given = Inputs {
        calibration: Some(&calibration),
        noise: noise.as_ref(),
        covariance: covariance.as_ref(),
        causes: &causes,
        rate: arguments.rate,
    };
    let document = match export::document(arguments.to, &given) {
        Ok(document) => document,
        Err(refusal) => return Ok(refuse(&refusal)),
    };
    let Some(out) = &arguments.out else {
        output::document(&document.text)?;
        return Ok(Ending::Done);
    };
    files.add(out, document.text.as_bytes())?;
    files.commit()?;
    say!("{}: written; it cannot say", out.display());
    for line in &document.cannot {
        say!("  - {line}");
    }
    Ok(Ending::Done)
}

/// Causes that a diagnosis asserts, in words.
fn causes(path: &Path, limits: &Limits) -> anyhow::Result<Vec<String>> {
    let expected = || {
        format!(
            "{}: expected `{}`; give the file that `imucal diagnose --json` wrote",
            path.display(),
            finding::FORMAT
        )
    };
    let bytes = limits.read_small(path).with_context(|| format!("{}: cannot be read", path.display()))?;
    let diagnosis: Diagnosis = serde_json::from_slice(&bytes).with_context(expected)?;
    anyhow::ensure!(diagnosis.format == finding::FORMAT, "{}", expected());
    Ok(diagnosis.causes.iter().map(described).collect())
}

fn described(cause: &Cause) -> String {
    let sizes = cause
        .parameters
        .iter()
        .filter_map(|amount| Some(format!("{} {:.4e} {}", amount.name, amount.value?, amount.unit)));
    let sizes: Vec<String> = sizes.collect();
    if sizes.is_empty() { cause.effect.clone() } else { format!("{} ({})", cause.effect, sizes.join(", ")) }
}

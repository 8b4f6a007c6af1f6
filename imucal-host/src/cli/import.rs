//! `imucal import`

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::{
    Ending,
    output::say,
    overwrite::{Overwrite, Planned},
    reading::Reading,
    warn,
};
use crate::recording::{Manifest, read::imu_tk};

/// Other people's formats.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Layout {
    /// Two text files of imu_tk, lines of `t x y z`: the accelerometer's, then the gyroscope's
    #[value(name = "imu_tk")]
    ImuTk,
}

#[derive(Args, Debug)]
pub(super) struct Arguments {
    /// The accelerometer's file
    acc: PathBuf,
    /// The gyroscope's file
    gyr: PathBuf,
    /// Their layout
    #[arg(long, value_enum, default_value = "imu_tk")]
    from: Layout,
    /// What the samples are: a recording's TOML with units, site and sensor
    #[arg(long, value_name = "NAME.toml")]
    manifest: PathBuf,
    /// The recording to write: .csv, .csv.gz or .parquet
    #[arg(long, value_name = "REC")]
    out: PathBuf,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    reading: Reading,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let inputs = [arguments.acc.clone(), arguments.gyr.clone()];
    let mut files = arguments.overwrite.plan(&inputs, &Planned::recording(&arguments.out))?;
    let limits = arguments.reading.limits();
    let (manifest, warnings) = Manifest::read_within(&arguments.manifest, &limits)?;
    let recording = match arguments.from {
        Layout::ImuTk => imu_tk::read_pair(&arguments.acc, &arguments.gyr, manifest, &limits)?,
    };
    for warning in warnings.iter().chain(&recording.warnings) {
        warn(warning);
    }
    recording.write_into(&arguments.out, &mut files)?;
    files.commit()?;
    say!("{}: {} rows", arguments.out.display(), recording.rows());
    Ok(Ending::Done)
}

//! `imucal import`

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::{Args, ValueEnum};

use super::{
    Ending,
    columns::{self, Columns},
    output::say,
    overwrite::{Overwrite, Planned},
    progress::Progress,
    reading::Reading,
    warn,
};
use crate::{
    file::OutputSet,
    recording::{
        Manifest, Recording, Source,
        read::{euroc, imu_tk},
        transfer::{TransferError, transfer},
    },
};

/// Other people's formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Layout {
    /// One CSV, Parquet or MAT-file, with its columns by --map, --unit and --time; fields of text separated by commas,
    /// semicolons, tabs, bars or blanks
    Csv,
    /// An MCAP file or a bag, its topics by --topic
    Log,
    /// A folder of EuRoC: mav0/imu0 and, as the reference, its ground truth or Vicon's poses
    Euroc,
    /// Two text files of imu_tk, lines of `t x y z`: the accelerometer's, then the gyroscope's
    #[value(name = "imu_tk")]
    ImuTk,
}

#[derive(Args, Debug)]
#[command(
    after_help = "Example:\n  imucal import log.csv --time timestamp_ms --map acc=ax,ay,az --map gyr=gx,gy,gz --unit acc=g,gyr=deg/s \
                  --out log-si.csv"
)]
pub(super) struct Arguments {
    /// One CSV, Parquet or MAT-file, log or folder of EuRoC, or the accelerometer's and the gyroscope's file of imu_tk
    #[arg(required = true, num_args = 1..=2)]
    files: Vec<PathBuf>,
    /// Layout of the files; without it, their number decides
    #[arg(long, value_enum)]
    from: Option<Layout>,
    /// What the samples are: a recording's TOML with units, site and sensor; needed for imu_tk
    #[arg(long, value_name = "NAME.toml")]
    manifest: Option<PathBuf>,
    /// The recording to write: .csv, .csv.gz, .parquet or .mcap
    #[arg(long, value_name = "REC")]
    out: PathBuf,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    columns: Columns,
    #[command(flatten)]
    reading: Reading,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let inputs: Vec<PathBuf> = arguments.files.iter().chain(&arguments.manifest).cloned().collect();
    let mut files = arguments.overwrite.plan(&inputs, &Planned::recording(&arguments.out))?;
    let limits = arguments.reading.limits();
    let manifest = match &arguments.manifest {
        Some(path) => {
            let (manifest, warnings) = Manifest::read_within(path, &limits)?;
            warnings.iter().for_each(|warning| warn(warning));
            Some(manifest)
        }
        None => None,
    };
    let is_euroc = |folder: &Path| match arguments.from {
        None => euroc::is_folder(folder),
        from => from == Some(Layout::Euroc),
    };
    let rows = match (arguments.files.as_slice(), arguments.from) {
        ([folder], _) if is_euroc(folder) => {
            arguments
                .columns
                .refuse_for("a folder of EuRoC", "whose columns, units and topics are its own")?;
            whole(&euroc::read_folder(folder, manifest, &limits)?, arguments, &mut files)?
        }
        ([file], None | Some(Layout::Csv | Layout::Log)) => {
            by_parts(file, manifest.as_ref(), arguments, &mut files)?
        }
        ([acc, gyr], None | Some(Layout::ImuTk)) => {
            arguments
                .columns
                .refuse_for("imu_tk", "whose columns are `t x y z` and whose units --manifest states")?;
            let manifest = manifest.context("imu_tk: its files say no units; add --manifest")?;
            whole(&imu_tk::read_pair(acc, gyr, manifest, &limits)?, arguments, &mut files)?
        }
        (_, Some(Layout::Csv | Layout::Log | Layout::Euroc)) => {
            anyhow::bail!("--from: found two files, expected one")
        }
        _ => anyhow::bail!("imu_tk: found one file, expected the accelerometer's and then the gyroscope's"),
    };
    files.commit()?;
    say!("{}: {rows} rows", arguments.out.display());
    Ok(Ending::Done)
}

/// Writes a recording that was read as a whole; its number of rows.
fn whole(recording: &Recording, arguments: &Arguments, files: &mut OutputSet) -> anyhow::Result<usize> {
    recording.warnings.iter().for_each(|warning| warn(warning));
    recording.write_into(&arguments.out, files)?;
    Ok(recording.rows())
}

/// Reads and writes a file of any length; its number of rows.
fn by_parts(
    path: &Path,
    manifest: Option<&Manifest>,
    arguments: &Arguments,
    files: &mut OutputSet,
) -> anyhow::Result<usize> {
    let (mapping, limits) = (arguments.columns.mapping()?, arguments.reading.limits());
    let source = Source { path, mapping: &mapping, manifest, limits: &limits };
    let progress = Progress::reading(path);
    let done = transfer(source, &arguments.out, files, Some);
    drop(progress);
    let done = done.map_err(|error| match error {
        TransferError::Read(error) => columns::explained(path, error, arguments.reading),
        TransferError::Write(error) => error.into(),
    })?;
    done.warnings.iter().for_each(|warning| warn(warning));
    Ok(done.rows)
}

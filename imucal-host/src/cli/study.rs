//! `imucal study`

use clap::{Args, Subcommand};

use super::{Ending, output, progress::Progress};
use crate::study::{coverage, recovery, trust, units};

#[derive(Args, Debug)]
#[command(after_help = "Example:\n  imucal study trust")]
pub(super) struct Arguments {
    #[command(subcommand)]
    study: Study,
}

#[derive(Debug, Subcommand)]
enum Study {
    /// How far noise shifts an ellipsoid's centre where only a part of the sphere is seen, by estimator
    Coverage {
        /// Clouds that the table at 30 % averages over; the other table takes a fifth of them
        #[arg(long, value_name = "N", default_value_t = 500)]
        runs: u32,
        /// Seed of all random numbers
        #[arg(long, value_name = "N", default_value_t = 1)]
        seed: u64,
    },
    /// Errors of calibrations of simulated recordings over the standard errors that they report
    Recovery {
        /// Recordings, of two units in turn
        #[arg(long, value_name = "N", default_value_t = 200)]
        runs: u64,
        /// Seed of the first; each further one has the next
        #[arg(long, value_name = "N", default_value_t = 1000)]
        seed: u64,
    },
    /// Healthy and faulty hand recordings: whether accepted calibrations are as good as they report
    ///
    /// Ends with 1 where a limit is broken.
    Trust {
        /// Healthy recordings of each of the grid's 60 cells
        #[arg(long, value_name = "N", default_value_t = 20)]
        each: u64,
        /// Recordings of each kind of fault
        #[arg(long, value_name = "N", default_value_t = 10)]
        faulty: u64,
        /// Seed of all random numbers
        #[arg(long, value_name = "N", default_value_t = 1)]
        seed: u64,
    },
    /// Two simulated units on the simulated rig, before and after calibration by each model
    Units {
        /// Seed of all random numbers
        #[arg(long, value_name = "N", default_value_t = 1)]
        seed: u64,
    },
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let progress = Progress::start();
    progress.stage("simulating and calibrating");
    let (text, kept) = match arguments.study {
        Study::Coverage { runs, seed } => (coverage::report(runs, seed), true),
        Study::Recovery { runs, seed } => (recovery::report(seed, runs)?, true),
        Study::Trust { each, faulty, seed } => trust::report(each, faulty, seed),
        Study::Units { seed } => (units::report(seed)?, true),
    };
    drop(progress);
    output::document(&text)?;
    Ok(if kept { Ending::Done } else { Ending::Refused })
}

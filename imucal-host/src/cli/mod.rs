//! The program's commands. One file each; this one only reads the command line and says how it ended.

use std::{path::Path, process::ExitCode};

use clap::{Parser, Subcommand};

use self::{output::Volume, reading::Reading};
use crate::{
    allocator::keep_freed_memory,
    effect::{self, Effect},
    file::Limits,
    recording::Recording,
    store::{LoadError, StoredCalibration},
};

mod apply;
mod batch;
mod blind;
mod calibrate;
mod capture;
mod check;
mod columns;
mod compare;
mod compose;
mod corrupt;
mod demo;
mod device;
mod diagnose;
mod export;
mod fitting;
mod html;
mod import;
mod inspect;
mod interrupt;
mod json;
mod manual;
mod noise;
mod output;
mod overwrite;
mod progress;
mod reading;
mod robot;
mod simulate;
mod study;
mod verify;

/// Calibrates inertial and magnetic sensors from recordings, through the code that runs on their microcontroller.
#[derive(Debug, Parser)]
#[command(name = "imucal", version, about, max_term_width = 80)]
struct Cli {
    /// Print only errors, refusals, and a document that was asked for with `-`
    #[arg(long, short, global = true, conflicts_with = "verbose", help_heading = "How much is printed")]
    quiet: bool,
    /// Print each stage of the work and when it began
    #[arg(long, short, global = true, help_heading = "How much is printed")]
    verbose: bool,
    #[command(subcommand)]
    command: Command,
}

impl Cli {
    fn volume(&self) -> Volume {
        match (self.quiet, self.verbose) {
            (true, _) => Volume::Quiet,
            (_, true) => Volume::Verbose,
            _ => Volume::Usual,
        }
    }
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Fit all models that a recording supports, with standard errors; refuse what it does not determine.
    Calibrate(calibrate::Arguments),
    /// Calibrate many units at once, and name those that are unlike the others.
    Batch(batch::Arguments),
    /// Guide through a calibration session of a device: what to do next, how sure each sensor is, when it is enough.
    Capture(capture::Arguments),
    /// Correct a recording with the core's code, as a device does.
    Apply(apply::Arguments),
    /// Check whether a calibration still fits a unit, by a recording of it
    Check(check::Arguments),
    /// Compare two calibrations of a unit: how far each parameter has moved, and what that means
    Compare(compare::Arguments),
    /// Combine the calibration in use with a new one that was made from the device's corrected output
    Compose(compose::Arguments),
    /// Print a calibration, its quality, and whether it is intact.
    Inspect(inspect::Arguments),
    /// Compare the core in f32 with a reference in f64, sample by sample and fit by fit.
    Verify(verify::Arguments),
    /// Talk to a co-processor: identify, get and put its record, stream, calibrate on board.
    Device(device::Arguments),
    /// Convert another program's files to a recording.
    Import(import::Arguments),
    /// Simulate a recording of a unit on a flight motion simulator.
    Simulate(simulate::Arguments),
    /// Estimate the noise of a unit from a recording at rest: Allan deviations and their coefficients, with intervals.
    Noise(noise::Arguments),
    /// Write a calibration and a unit's noise for another program, and list what that program cannot say.
    Export(export::Arguments),
    /// Add the errors of a calibrated unit to an ideal stream.
    Corrupt(corrupt::Arguments),
    /// Run every step on a simulated sensor: record, calibrate, pack, apply, verify, diagnose.
    Demo(demo::Arguments),
    /// Compare estimators and models on simulated data; print tables.
    Study(study::Arguments),
    /// Find which effect a simulator lacks: where recording and simulation differ, the cause, and the share it explains.
    Diagnose(diagnose::Arguments),
    /// Run sealed trials of the diagnosis, and print how often it was right.
    Blind(blind::Arguments),
    /// Print completions of commands and options for a shell, or write the manual's pages.
    Manual(manual::Arguments),
}

/// How a command ended, when nothing went wrong on the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ending {
    /// Done.
    Done,
    /// The data were read, but the answer is a refusal or a failed check.
    Refused,
    /// Of many inputs, some are unreadable.
    Unreadable,
}

/// Runs the program: 0 done, 1 refused or a check failed, 2 bad usage or unreadable input.
pub fn run() -> ExitCode {
    keep_freed_memory();
    let cli = Cli::parse();
    output::set_volume(cli.volume());
    interrupt::watch();
    let result = match cli.command {
        // On a thread of the pool, which works itself where another one would first wake the pool and wait: its parts are short.
        Command::Calibrate(arguments) => rayon::scope(|_| calibrate::run(&arguments)),
        Command::Batch(arguments) => batch::run(&arguments),
        Command::Capture(arguments) => capture::run(&arguments),
        Command::Apply(arguments) => apply::run(&arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Compose(arguments) => compose::run(&arguments),
        Command::Inspect(arguments) => inspect::run(&arguments),
        Command::Verify(arguments) => verify::run(&arguments),
        Command::Device(arguments) => device::run(&arguments),
        Command::Import(arguments) => import::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Noise(arguments) => noise::run(&arguments),
        Command::Export(arguments) => export::run(&arguments),
        Command::Corrupt(arguments) => corrupt::run(&arguments),
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Study(arguments) => study::run(&arguments),
        Command::Diagnose(arguments) => diagnose::run(&arguments),
        Command::Blind(arguments) => blind::run(&arguments),
        Command::Manual(arguments) => manual::run(&arguments),
    };
    match result {
        Ok(Ending::Done) => ExitCode::SUCCESS,
        Ok(Ending::Refused) => ExitCode::from(1),
        Ok(Ending::Unreadable) => ExitCode::from(2),
        Err(error) => {
            output::report("error", &format_args!("{error:#}"));
            ExitCode::from(2)
        }
    }
}

/// Warns the user on standard error.
fn warn(message: &dyn std::fmt::Display) {
    output::report("warning", message);
}

/// Says on standard error why the answer is no.
fn refuse(refusal: &dyn std::fmt::Display) -> Ending {
    output::report("refused", refusal);
    Ending::Refused
}

/// Loads a calibration; one that can be read but must not be used is the error within.
fn load(path: &Path, reading: Reading) -> anyhow::Result<Result<StoredCalibration, LoadError>> {
    match StoredCalibration::load_within(path, &reading.limits()) {
        Err(damaged @ (LoadError::Record { .. } | LoadError::Unusable { .. })) => Ok(Err(damaged)),
        read => Ok(Ok(read?)),
    }
}

/// The user's own effects; none without a file.
fn own_effects(path: Option<&Path>, limits: &Limits) -> anyhow::Result<Vec<&'static Effect>> {
    match path {
        Some(path) => Ok(effect::user::read(path, limits)?),
        None => Ok(Vec::new()),
    }
}

/// Reads a recording and warns of what is odd in it.
fn read(path: &Path, reading: Reading) -> anyhow::Result<Recording> {
    let recording = Recording::read_within(path, &reading.limits())?;
    for warning in &recording.warnings {
        warn(warning);
    }
    Ok(recording)
}

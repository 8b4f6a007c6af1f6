//! `imucal demo`

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;

use super::{Ending, calibrate::today};
use crate::{
    apply::apply,
    calibrate::{Calibration, Options, calibrate},
    equivalence::{FitEquivalence, SampleEquivalence, fits, samples},
    recording::SensorKind,
    report::{self, table::words},
    simulator::{SimulatedUnit, Tumble, record},
    store::StoredCalibration,
};

/// Attitudes of the demo's tumble.
const RESTS: usize = 30;
/// Seeds of its motion and its noise.
const SEEDS: (u64, u64) = (1, 2);

#[derive(Args, Debug)]
pub(super) struct Arguments {
    /// Folder for what the demo writes
    #[arg(long, value_name = "DIR", default_value = "imucal-demo")]
    out: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let out = &arguments.out;
    std::fs::create_dir_all(out).with_context(|| format!("{}: cannot be made", out.display()))?;
    let unit = SimulatedUnit::mtx();
    println!("1. Record: a simulated MTx, tumbled by hand through {RESTS} attitudes.");
    let recording = record("tumble.csv.gz", &Tumble::new(RESTS, SEEDS.0), &unit, SEEDS.1);
    recording.write(&out.join("tumble.csv.gz"))?;

    println!("\n2. Calibrate.\n");
    let calibration = calibrate(&recording, &Options::default(), &|_| {});
    print!("{}", report::table::table(&calibration));
    let stored = StoredCalibration::of(&calibration, today());
    stored.save_toml(&out.join("calibration.toml"))?;
    stored.save_record(&out.join("calibration.bin"))?;
    let json = serde_json::to_string_pretty(&report::json::calibration(&calibration))?;
    crate::recording::AtomicFile::write_whole(&out.join("calibration.json"), json.as_bytes())?;

    println!("\n3. Compare with the truth, which the calibration never saw.\n");
    let found = against_truth(&calibration, &unit);

    println!("\n4. Apply the record through the f32 core and compare with the f64 reference.\n");
    let device = stored.to_record(out)?;
    let equal = SensorKind::ALL.into_iter().all(|kind| {
        let compared = recording.sensor(kind).zip(stored.triad(kind)).zip(device.triad(kind.into()));
        compared.is_some_and(|((triple, stored), record)| {
            let result = samples::compare(kind, triple, stored, record);
            print_samples(&result);
            result.passes()
        })
    });
    let refitted = calibration
        .sensors
        .iter()
        .all(|outcome| fits::compare(&recording, outcome).is_some_and(|fit| print_fit(&fit)));
    apply(&recording, &stored, &device).write(&out.join("tumble-calibrated.csv.gz"))?;

    println!("\nWritten to {}:", out.display());
    for (file, what) in [
        ("tumble.csv.gz, .toml", "the recording"),
        ("calibration.toml", "the calibration for people"),
        ("calibration.bin", "the record for the device"),
        ("calibration.json", "everything, for programs"),
        ("tumble-calibrated.csv.gz, .toml", "the recording corrected through the core"),
    ] {
        println!("  {file:<32} {what}");
    }
    Ok(if found && equal && refitted { Ending::Done } else { Ending::Refused })
}

/// Largest error in standard errors, sensor by sensor; whether all were accepted.
fn against_truth(calibration: &Calibration, unit: &SimulatedUnit) -> bool {
    SensorKind::ALL.into_iter().all(|kind| {
        let Some(fit) = calibration.sensor(kind).and_then(|outcome| outcome.accepted()) else {
            return false;
        };
        let (found, truth) = (fit.raw_triad(), unit.sensor(kind).truth);
        let (gain_std, bias_std) = fit.raw_std();
        let errors = (found.gain - truth.gain)
            .iter()
            .zip(gain_std.iter())
            .chain((found.bias - truth.bias).iter().zip(bias_std.iter()))
            .filter(|(_, std)| **std > 0.0)
            .map(|(error, std)| error.abs() / std)
            .collect::<Vec<_>>();
        let worst = errors.iter().copied().fold(0.0, f64::max);
        println!("{}: largest error {worst:.1} standard errors, of {} parameters", words(kind), errors.len());
        true
    })
}

fn print_samples(s: &SampleEquivalence) {
    println!(
        "{}: {} samples, largest difference {:.1e} of full scale",
        words(s.kind),
        s.samples,
        s.max / s.full_scale
    );
}

fn print_fit(fit: &FitEquivalence) -> bool {
    let worst = fit.parameters.iter().map(|p| (p.device - p.reference).abs() / p.std).fold(0.0, f64::max);
    println!("{}: fitted again in f32, largest difference {worst:.4} standard errors", words(fit.kind));
    fit.passes()
}

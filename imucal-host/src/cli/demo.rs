//! `imucal demo`

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;

use super::{
    Ending,
    calibrate::today,
    output::{self, say},
};
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
    std::fs::create_dir_all(out).with_context(|| {
        format!(
            "{}: found no folder and cannot make one, expected a place to write to; give another --out",
            out.display()
        )
    })?;
    let unit = SimulatedUnit::mtx();
    say!("1. Record: a simulated MTx, tumbled by hand through {RESTS} attitudes.");
    let recording = record("tumble.csv.gz", &Tumble::new(RESTS, SEEDS.0), &unit, SEEDS.1);
    recording.write(&out.join("tumble.csv.gz"))?;

    say!("\n2. Calibrate.\n");
    let calibration = calibrate(&recording, &Options::default(), &|_| {});
    output::text(&report::table::table(&calibration))?;
    let stored = StoredCalibration::of(&calibration, today());
    stored.save_toml(&out.join("calibration.toml"))?;
    stored.save_record(&out.join("calibration.bin"))?;
    let json = serde_json::to_string_pretty(&report::json::calibration(&calibration))? + "\n";
    output::file(&out.join("calibration.json"), &json)?;

    say!("\n3. Compare with the truth, which the calibration never saw.\n");
    let found = against_truth(&calibration, &unit)?;

    say!("\n4. Apply the record through the f32 core and compare with the f64 reference.\n");
    let device = stored.to_record(out)?;
    let mut equal = true;
    for kind in SensorKind::ALL {
        let compared = recording.sensor(kind).zip(stored.triad(kind)).zip(device.triad(kind.into()));
        let result =
            compared.map(|((triple, stored), record)| samples::compare(kind, triple, stored, record));
        result.iter().try_for_each(print_samples)?;
        equal &= result.is_some_and(|samples| samples.passes());
    }
    for outcome in &calibration.sensors {
        let fit = fits::compare(&recording, outcome);
        fit.iter().try_for_each(print_fit)?;
        equal &= fit.is_some_and(|fit| fit.passes());
    }
    apply(&recording, &stored, &device).write(&out.join("tumble-calibrated.csv.gz"))?;

    say!("\nWritten to {}:", out.display());
    for (file, what) in [
        ("tumble.csv.gz", "the recording"),
        ("tumble.toml", "its manifest: units, site, sensor"),
        ("calibration.toml", "the calibration for people"),
        ("calibration.bin", "the record for the device"),
        ("calibration.json", "everything, for programs"),
        ("tumble-calibrated.csv.gz", "the recording corrected through the core"),
        ("tumble-calibrated.toml", "its manifest"),
    ] {
        say!("  {file:<24} {what}");
    }
    Ok(if found && equal { Ending::Done } else { Ending::Refused })
}

/// Largest error in standard errors, sensor by sensor; whether all were accepted.
fn against_truth(calibration: &Calibration, unit: &SimulatedUnit) -> anyhow::Result<bool> {
    let mut all = true;
    for kind in SensorKind::ALL {
        let Some(fit) = calibration.sensor(kind).and_then(|outcome| outcome.accepted()) else {
            all = false;
            continue;
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
        say!("{}: largest error {worst:.1} standard errors, of {} parameters", words(kind), errors.len());
    }
    Ok(all)
}

fn print_samples(s: &SampleEquivalence) -> anyhow::Result<()> {
    say!(
        "{}: {} samples, largest difference {:.1e} of full scale",
        words(s.kind),
        s.samples,
        s.max / s.full_scale
    );
    Ok(())
}

fn print_fit(fit: &FitEquivalence) -> anyhow::Result<()> {
    let worst = fit.parameters.iter().map(|p| (p.device - p.reference).abs() / p.std).fold(0.0, f64::max);
    say!("{}: fitted again in f32, largest difference {worst:.4} standard errors", words(fit.kind));
    Ok(())
}

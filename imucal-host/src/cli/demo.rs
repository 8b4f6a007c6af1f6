//! `imucal demo`

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use imucal_core::record::{CalibrationRecord, HigherOrder};

use super::{
    Ending,
    calibrate::today,
    html::Html,
    output::{self, say},
    overwrite::{Overwrite, Planned},
};
use crate::{
    apply::apply,
    calibrate::{Calibration, Options, calibrate},
    diagnosis::{self, diagnose},
    effect,
    equivalence::{
        FitEquivalence, SampleEquivalence, fits,
        samples::{self, Samples},
    },
    file::OutputSet,
    page::{self, Provenance},
    recording::{Recording, SensorKind},
    report::{
        self,
        prose::{hanging, listed},
        table::words,
    },
    simulator::{Programme, Simulation},
    store::StoredCalibration,
};

/// The effect that is in the recording but not in the calibration, and its size in multiples of its usual one.
const WITHHELD: (&str, f64) = ("acc.scale_cubic", 3.0);

/// The page of calibration and diagnosis.
const PAGE: &str = "demo.html";

/// What the demo writes, all of it at its end.
const WRITTEN: [(&str, &str); 9] = [
    ("rig.csv.gz", "the recording"),
    ("rig.toml", "its manifest: units, site, sensor"),
    ("calibration.toml", "the calibration for people"),
    ("calibration.bin", "the record for the device"),
    ("calibration.json", "everything, for programs"),
    ("rig-calibrated.csv.gz", "the recording corrected through the core"),
    ("rig-calibrated.toml", "its manifest"),
    ("diagnosis.json", "the diagnosis, for programs"),
    (PAGE, "all of it with drawings, for a browser"),
];

#[derive(Args, Debug)]
#[command(after_help = "Example:\n  imucal demo --out demo")]
pub(super) struct Arguments {
    /// Folder for what the demo writes
    #[arg(long, value_name = "DIR", default_value = "imucal-demo")]
    out: PathBuf,
    #[command(flatten)]
    html: Html,
    #[command(flatten)]
    overwrite: Overwrite,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let out = &arguments.out;
    let mut files = planned(arguments)?;
    say!(
        "1. Record: a simulated Xsens MTx on a three-gimbal rig, at rest in 24 attitudes, six of them twice.\n   \
         One effect is in the recording that no later step knows of."
    );
    let mut simulation =
        Simulation { programme: Programme::MultiPosition, rate: 50.0, ..Simulation::default() };
    if let Some(effect) = effect::find(WITHHELD.0) {
        simulation.add(effect, WITHHELD.1)?;
    }
    let recording = simulation.record("rig.csv.gz")?;
    recording.write_into(&out.join("rig.csv.gz"), &mut files)?;

    say!("\n2. Calibrate, and compare the models by their residual on data left out of the fit.\n");
    let options = Options { compare: true, ..Options::default() };
    let calibration = calibrate(&recording, &options, &|_| {});
    output::text(&report::table::table(&calibration))?;
    let stored = StoredCalibration::of(&calibration, today());
    stored.write_toml(&out.join("calibration.toml"), &mut files)?;
    stored.write_record(&out.join("calibration.bin"), &mut files)?;
    let json = report::json::text(&calibration);
    files.add(&out.join("calibration.json"), json.as_bytes())?;

    say!("\n3. Compare the calibration with the simulated truth.\n");
    let found = against_truth(&calibration, &simulation)?;

    say!("\n4. Apply the record through the f32 core and compare with the f64 reference.\n");
    let device = stored.to_record(out)?;
    let equal = is_equal(&recording, &calibration, &stored, &device)?;
    apply(&recording, &stored, &device)?.write_into(&out.join("rig-calibrated.csv.gz"), &mut files)?;

    say!("\n5. Diagnose: which effect does the model lack, and what share of the gap does it explain?\n");
    let diagnosis = diagnose(&recording, &diagnosis::Options::default(), &|_| {});
    output::text(&report::diagnosis::page(&diagnosis))?;
    let json = serde_json::to_string_pretty(&diagnosis)? + "\n";
    files.add(&out.join("diagnosis.json"), json.as_bytes())?;
    let provenance =
        Provenance::new(today()).with("recording", "rig.csv.gz, simulated").with_recording(&recording);
    let parts =
        [page::calibration::calibration(&calibration, &recording), page::diagnosis::diagnosis(&diagnosis)];
    let page = page::page("imucal demo: a simulated unit on a rig", &provenance, &parts);
    for path in [Some(out.join(PAGE).as_path()), arguments.html.path()].into_iter().flatten() {
        files.add(path, page.as_bytes())?;
    }
    files.commit()?;
    let named = diagnosis.causes.iter().any(|cause| cause.effect == WITHHELD.0);
    say!(
        "{}",
        if named {
            "The diagnosis names the effect that was withheld."
        } else {
            "The diagnosis does not name the effect that was withheld."
        }
    );

    say!("\nWritten to {}:", out.display());
    for (file, what) in WRITTEN {
        say!("  {file:<24} {what}");
    }
    Ok(if found && equal && named { Ending::Done } else { Ending::Refused })
}

/// The files that are written; a folder with all of them holds an earlier demo, which the next one replaces.
fn planned(arguments: &Arguments) -> anyhow::Result<OutputSet> {
    let out = &arguments.out;
    std::fs::create_dir_all(out).with_context(|| {
        format!(
            "{}: found no folder and cannot make one, expected a place to write to; give another --out",
            out.display()
        )
    })?;
    let written = WRITTEN.iter().map(|(file, _)| Planned::new(out.join(file)));
    let planned: Vec<Planned> = written.chain(arguments.html.planned()).collect();
    let earlier = WRITTEN.iter().all(|(file, _)| out.join(file).exists());
    arguments.overwrite.or(earlier).plan(&[], &planned)
}

/// Whether samples and fits through the f32 core are those of the reference; both are printed.
fn is_equal(
    recording: &Recording,
    calibration: &Calibration,
    stored: &StoredCalibration,
    device: &CalibrationRecord<HigherOrder>,
) -> anyhow::Result<bool> {
    let mut equal = true;
    for kind in SensorKind::ALL {
        let compared = Samples::of(recording, kind).zip(stored.triad(kind)).zip(device.triad(kind.into()));
        let result = compared.map(|((samples, stored), record)| samples::compare(samples, stored, record));
        result.iter().try_for_each(print_samples)?;
        equal &= result.is_some_and(|samples| samples.passes());
    }
    for outcome in &calibration.sensors {
        let fit = fits::compare(recording, outcome);
        fit.iter().try_for_each(print_fit)?;
        equal &= fit.is_some_and(|fit| fit.passes());
    }
    Ok(equal)
}

/// Largest error in standard errors by sensor, and what to expect of it; whether all sensors were accepted.
fn against_truth(calibration: &Calibration, simulation: &Simulation) -> anyhow::Result<bool> {
    let unit = simulation.unit_under_test();
    let mut all = true;
    for kind in SensorKind::ALL {
        let Some(fit) = calibration.sensor(kind).and_then(|outcome| outcome.accepted()) else {
            all = false;
            continue;
        };
        let truth = unit.triad(kind).triad;
        let gain = unit.c_t_q.transpose() * truth.gain;
        let ratio = |error: f64, std: f64| error.abs() / std;
        say!(
            "{}: largest error of the gain {:.1} standard errors, of the bias {:.1}",
            words(kind),
            (fit.triad.gain - gain).zip_map(&fit.gain_std, ratio).max(),
            (fit.triad.bias - truth.bias).zip_map(&fit.bias_std, ratio).max()
        );
    }
    for dose in &simulation.doses {
        let sensors: Vec<&str> = dose.effect.sensors.iter().map(|kind| words(*kind)).collect();
        let sensors = listed(&sensors);
        let text = format!(
            "The effect withheld is {}: {} The model of the {sensors} has no term for it, and a standard error covers noise \
             alone: many standard errors are expected there, and at most four elsewhere.",
            dose.effect.id, dose.effect.words.cause
        );
        output::text(&hanging("", &text))?;
    }
    Ok(all)
}

fn print_samples(s: &SampleEquivalence) -> anyhow::Result<()> {
    say!(
        "{}: {} samples corrected; largest difference {:.1e} of full scale",
        words(s.kind),
        s.samples,
        s.max / s.full_scale
    );
    Ok(())
}

fn print_fit(fit: &FitEquivalence) -> anyhow::Result<()> {
    let worst = fit.parameters.iter().map(|p| (p.device - p.reference).abs() / p.std).fold(0.0, f64::max);
    say!(
        "{}: fitted again in f32; largest difference from the f64 reference {worst:.4} standard errors",
        words(fit.kind)
    );
    Ok(())
}

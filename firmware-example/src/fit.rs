//! The lines of an image that calibrates: every model of the device fitted to simulated sets of observations, judged,
//! and written to a record. Figures are written in bits, since host and device must print the same.

use core::fmt::{self, Write};

use imucal_core::{
    link::{FitModel, FitReport, FitTask},
    record::{self, CalibrationRecord, Date, Sensor, SensorIdentity},
};

use crate::{
    drill::{self, observe},
    fitting::{Fitting, Memory},
    scene::Noise,
};

/// The memory of these fits: small enough for a micro:bit, and the same on every machine.
pub type FitMemory = Memory<48, 20, 8, 96, 8>;
type SmallFitting<'a> = Fitting<'a, 48, 20, 8, 96, 8>;

/// Sets of each model.
pub const SETS: u32 = 20;
/// Sets that are searched by a swarm first.
const SEARCHES: u64 = 2;

/// Fits every set and writes what came of it.
///
/// # Errors
///
/// Those of `out`. A fit that is refused is a line, and not an error.
pub fn write(out: &mut impl Write, memory: &mut FitMemory) -> fmt::Result {
    let mut fitting = Fitting::new(memory);
    for seed in 1..=SETS {
        let sensor = SensorIdentity::default();
        let mut record = CalibrationRecord::empty(sensor, Date::from_days(20_000));
        for model in FitModel::ALL {
            one(out, &mut fitting, drill::task(model), seed, &mut record)?;
        }
        write_record(out, &record)?;
        for search in (0..SEARCHES).filter(|search| u64::from(seed) == search + 1) {
            let task = FitTask { search: Some(search), ..drill::task(FitModel::K12) };
            one(out, &mut fitting, task, seed, &mut record)?;
        }
    }
    Ok(())
}

/// Observations of a model.
fn count(model: FitModel) -> usize {
    match model {
        FitModel::I14 => 20,
        FitModel::K12 => 8,
        _ => 40,
    }
}

#[inline(never)]
fn one(
    out: &mut impl Write,
    fitting: &mut SmallFitting<'_>,
    task: FitTask,
    seed: u32,
    record: &mut CalibrationRecord,
) -> fmt::Result {
    let model = task.model;
    let begun = fitting.begin(task);
    if begun.is_err() || !feed(fitting, model, seed) {
        return writeln!(out, "{} {seed} not taken", model.name());
    }
    while !fitting.step() {}
    finish(out, fitting, seed, record)
}

#[inline(never)]
fn feed(fitting: &mut SmallFitting<'_>, model: FitModel, seed: u32) -> bool {
    let mut taken = true;
    observe(model, count(model), &mut Noise(seed), |observation| taken &= fitting.take(&observation).is_ok());
    taken
}

/// Apart from what went before, so that its memory is free again.
#[inline(never)]
fn finish(
    out: &mut impl Write,
    fitting: &SmallFitting<'_>,
    seed: u32,
    record: &mut CalibrationRecord,
) -> fmt::Result {
    let searched = fitting.progress().map_or(0, |progress| progress.searched);
    let Ok(finished) = fitting.finish() else { return writeln!(out, "{seed} not finished") };
    write_report(out, seed, searched, &finished.report)?;
    if let Some((sensor, triad)) = finished.accepted {
        let slot = match sensor {
            Sensor::Accelerometer => &mut record.acc,
            Sensor::Gyroscope => &mut record.gyr,
            Sensor::Magnetometer => &mut record.mag,
        };
        *slot = Some(triad);
    }
    Ok(())
}

#[inline(never)]
fn write_report(out: &mut impl Write, seed: u32, searched: u16, report: &FitReport) -> fmt::Result {
    let name = report.model.name();
    writeln!(
        out,
        "{name} {seed} searched {searched} {} {} iterations {} evaluations {} rows {}",
        report.termination.name(),
        report.iterations,
        report.evaluations,
        report.independent_rows,
        report.refusal.map_or("accepted", |refusal| refusal.reason()),
    )?;
    let figures = [report.cost, report.gradient, report.condition, report.nonlinearity, report.coverage];
    write_bits(out, name, "report", &figures)?;
    write_bits(out, name, "theta", &report.theta)?;
    write_bits(out, name, "covariance", &report.covariance)
}

fn write_bits(out: &mut impl Write, name: &str, what: &str, figures: &[f32]) -> fmt::Result {
    write!(out, "{name} {what}:")?;
    figures.iter().try_for_each(|figure| write!(out, " {:08x}", figure.to_bits()))?;
    writeln!(out)
}

#[inline(never)]
fn write_record(out: &mut impl Write, record: &CalibrationRecord) -> fmt::Result {
    let mut page = [0xFF; record::MAX_LEN];
    let Ok(bytes) = record::encode(record, &mut page) else {
        return writeln!(out, "record not encoded");
    };
    let same = record::decode(bytes).as_ref() == Ok(record);
    write!(out, "record decoded {}:", if same { "alike" } else { "otherwise" })?;
    bytes.iter().try_for_each(|byte| write!(out, " {byte:02x}"))?;
    writeln!(out)
}

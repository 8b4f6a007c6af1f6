//! What a fit found, for the host and for the record.

use heapless::Vec;
use imucal_core::{
    fit::{Criteria, FitSummary, Units},
    link::{FitReport, FitTask, MOST_COVARIANCE},
    record::{RawUnit, Sensor, TriadRecord},
    triad::Triad,
};

/// A fit that was judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Finished {
    /// For the host.
    pub report: FitReport,
    /// For the record, where the fit was accepted.
    pub accepted: Option<(Sensor, TriadRecord)>,
}

/// A list of what there is room for: one that is extended beyond its room panics.
fn list<'a, const N: usize>(figures: impl Iterator<Item = &'a f32>) -> Vec<f32, N> {
    let mut list = Vec::new();
    for figure in figures {
        let _room = list.push(*figure);
    }
    list
}

/// Columns from the top to the diagonal.
#[inline(never)]
fn upper(matrix: &[f32], size: usize) -> Vec<f32, MOST_COVARIANCE> {
    let columns = matrix.chunks_exact(size.max(1)).enumerate();
    list(columns.flat_map(|(k, column)| column.iter().take(k + 1)))
}

/// Parameters and their covariance, of a size that only their fit knows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Figures<'a> {
    /// The parameters.
    pub(super) theta: &'a [f32],
    /// Their covariance by columns; `None` where it is singular.
    pub(super) covariance: Option<&'a [f32]>,
}

/// What a fit comes to.
#[inline(never)]
pub(super) fn finished(
    task: &FitTask,
    figures: Figures<'_>,
    summary: &FitSummary<f32>,
    criteria: &Criteria<'_, f32>,
    triad: &Triad<f32>,
    std: &Triad<f32>,
) -> Finished {
    let sensor = task.model.sensor();
    let calibrated = match sensor {
        Sensor::Accelerometer => RawUnit::MetrePerSecondSquared,
        Sensor::Gyroscope => RawUnit::RadianPerSecond,
        Sensor::Magnetometer => RawUnit::MicroTesla,
    };
    let verdict = summary.check(triad, std, criteria);
    let units = Units { raw: task.unit_in, calibrated, offset: task.offset, per_unit: task.per_unit };
    let record = || (sensor, summary.record(triad, std, task.model.name(), &units));
    let solved = &summary.report;
    let covariance = figures.covariance.map_or_else(Vec::new, |matrix| upper(matrix, figures.theta.len()));
    let report = FitReport {
        model: task.model,
        termination: solved.termination,
        iterations: solved.iterations,
        evaluations: solved.evaluations,
        independent_rows: u32::try_from(solved.independent_rows).unwrap_or(u32::MAX),
        cost: solved.cost,
        gradient: solved.gradient,
        condition: solved.condition,
        nonlinearity: summary.nonlinearity,
        coverage: summary.coverage.share,
        refusal: verdict.err(),
        theta: list(figures.theta.iter()),
        covariance,
    };
    Finished { report, accepted: verdict.is_ok().then(record) }
}

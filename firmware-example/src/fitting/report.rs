//! What a fit found, for the host and for the record.

use heapless::Vec;
use imucal_core::{
    link::{FitReport, FitTask, MOST_COVARIANCE},
    record::{RawUnit, Sensor, TriadRecord},
    triad::Triad,
};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::judgement::{Judgement, Question, Unit};

/// A fit that was judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Finished {
    /// For the host.
    pub report: FitReport,
    /// For the record, where the fit was accepted.
    pub accepted: Option<(Sensor, TriadRecord)>,
}

/// Standard errors of the parameters; zero where there are none, which no accepted fit has.
pub(super) fn errors<const P: usize>(covariance: &Option<SMatrix<f32, P, P>>) -> SVector<f32, P> {
    covariance.as_ref().map_or_else(SVector::zeros, |c| c.diagonal().map(libm::sqrtf))
}

/// Standard errors of gain and bias where the sensitivity K = gain⁻¹ was fitted: by `dG = −G dK G`.
pub(super) fn inverse_errors(gain: &Matrix3<f32>, covariance: &Option<SMatrix<f32, 14, 14>>) -> Triad<f32> {
    let mut std = Triad { gain: Matrix3::zeros(), bias: Vector3::zeros() };
    let Some(covariance) = covariance else { return std };
    for (i, left) in gain.row_iter().enumerate() {
        for (j, right) in gain.column_iter().enumerate() {
            // Derivative of G_ij by K_kl is −G_ik G_lj.
            let mut by = SVector::<f32, 14>::zeros();
            for (slot, factor) in
                by.iter_mut().zip(left.iter().flat_map(|a| right.iter().map(move |b| a * b)))
            {
                *slot = factor;
            }
            if let Some(entry) = std.gain.get_mut((i, j)) {
                *entry = libm::sqrtf((covariance * by).dot(&by));
            }
        }
    }
    let variances = covariance.diagonal();
    for (slot, variance) in std.bias.iter_mut().zip(variances.iter().skip(9)) {
        *slot = libm::sqrtf(*variance);
    }
    std
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

/// What a judgement comes to.
#[inline(never)]
pub(super) fn finished(
    task: &FitTask,
    figures: Figures<'_>,
    judgement: &Judgement,
    question: &Question<'_>,
    triad: &Triad<f32>,
    std: &Triad<f32>,
) -> Finished {
    let sensor = task.model.sensor();
    let calibrated = match sensor {
        Sensor::Accelerometer => RawUnit::MetrePerSecondSquared,
        Sensor::Gyroscope => RawUnit::RadianPerSecond,
        Sensor::Magnetometer => RawUnit::MicroTesla,
    };
    let verdict = judgement.verdict(triad, std, question);
    let unit = Unit { raw: task.unit_in, calibrated, offset: task.offset, per_unit: task.per_unit };
    let record = || (sensor, judgement.record(triad, std, task.model.name(), &unit));
    let solved = &judgement.report;
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
        nonlinearity: judgement.nonlinearity,
        coverage: judgement.coverage.share,
        refusal: verdict.err(),
        theta: list(figures.theta.iter()),
        covariance,
    };
    Finished { report, accepted: verdict.is_ok().then(record) }
}

//! What a fit found, for the host and for the record.

use heapless::Vec;
use imucal_core::{
    link::{FitModel, FitReport, FitTask, MOST_COVARIANCE},
    record::{RawUnit, Sensor, TriadRecord},
    triad::Triad,
};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::judgement::{Judgement, Unit};

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

fn report<const P: usize>(model: FitModel, theta: &SVector<f32, P>, judgement: &Judgement<P>) -> FitReport {
    let mut covariance = Vec::<f32, MOST_COVARIANCE>::new();
    if let Some(matrix) = &judgement.covariance {
        // No larger than the largest: a heapless list that is extended beyond its room panics.
        for (k, column) in matrix.column_iter().enumerate() {
            for entry in column.iter().take(k + 1) {
                let _room = covariance.push(*entry);
            }
        }
    }
    let mut parameters = Vec::new();
    for entry in theta {
        let _room = parameters.push(*entry);
    }
    let report = &judgement.report;
    FitReport {
        model,
        termination: report.termination,
        iterations: report.iterations,
        evaluations: report.evaluations,
        independent_rows: u32::try_from(report.independent_rows).unwrap_or(u32::MAX),
        cost: report.cost,
        gradient: report.gradient,
        condition: report.condition,
        nonlinearity: judgement.nonlinearity,
        coverage: judgement.coverage.share,
        refusal: judgement.verdict.err(),
        theta: parameters,
        covariance,
    }
}

/// What a judgement comes to.
pub(super) fn finished<const P: usize>(
    task: &FitTask,
    theta: &SVector<f32, P>,
    judgement: &Judgement<P>,
    triad: &Triad<f32>,
    std: &Triad<f32>,
) -> Finished {
    let sensor = task.model.sensor();
    let calibrated = match sensor {
        Sensor::Accelerometer => RawUnit::MetrePerSecondSquared,
        Sensor::Gyroscope => RawUnit::RadianPerSecond,
        Sensor::Magnetometer => RawUnit::MicroTesla,
    };
    let unit = Unit { raw: task.unit_in, calibrated, offset: task.offset, per_unit: task.per_unit };
    let record = || (sensor, judgement.record(triad, std, task.model.name(), &unit));
    let accepted = judgement.verdict.is_ok().then(record);
    Finished { report: report(task.model, theta, judgement), accepted }
}

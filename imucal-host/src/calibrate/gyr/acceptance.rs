//! What a gyroscope's fit is judged by, from turns as from motions.

use imucal_core::{
    accept::{self, Limits, Refusal},
    solver::SolveReport,
    triad::Triad,
};
use nalgebra::Vector3;

use crate::calibrate::{fit::gyr_rig_fit::LARGEST_RMS, outcome::FitSummary};

/// Acceptance of a fit of at least so many turns or motions.
pub fn judge(report: &SolveReport<f64>, summary: &FitSummary, least: usize) -> Result<(), Refusal> {
    let limits = Limits { rms: LARGEST_RMS, ..Limits::for_norm(summary.parameters, least) };
    accept::check_report(report)?;
    let std = Triad { gain: summary.gain_std, bias: Vector3::zeros() };
    let error = accept::relative_error(&summary.triad.gain, &std, 1.0);
    accept::check_precision(error, &limits)?;
    accept::check_nonlinearity(summary.nonlinearity, error, &limits)?;
    accept::check_plausibility(&summary.triad, true, summary.rms, &limits)
}

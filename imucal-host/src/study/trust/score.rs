//! A calibration of a hand recording against its truth, in the standard errors it states.

use imucal_core::triad::Triad;
use nalgebra::{Matrix3, Vector3};

use super::Hand;
use crate::{
    calibrate::{Calibration, FitSummary, Options, Status, calibrate},
    recording::SensorKind,
};

/// What became of one sensor of a recording.
#[derive(Clone, Debug)]
pub struct Score {
    /// Which sensor.
    pub kind: SensorKind,
    /// Accepted, suspect or refused.
    pub status: Status,
    /// The refusal's reason, or what a suspect residual follows; empty where accepted.
    pub why: Vec<&'static str>,
    /// Error of each estimated entry in its standard errors; none of a refused sensor. Infinite where the standard
    /// error is zero and the error is not.
    pub errors: Vec<f64>,
}

impl Score {
    /// The largest error, standard errors; 0 of a refused sensor.
    pub fn worst(&self) -> f64 {
        self.errors.iter().fold(0.0, |worst, error| f64::max(worst, error.abs()))
    }
}

/// Calibrates a hand recording as `imucal calibrate` does, and scores each sensor.
pub fn scores(hand: &Hand) -> Vec<Score> {
    let recording = hand.recording("trust.csv");
    against(&calibrate(&recording, &Options::default(), &|_| {}), &hand.truth)
}

/// Scores of a calibration against the truth, nominal SI in, by [`SensorKind::ALL`].
pub fn against(calibration: &Calibration, truth: &[Triad<f64>; 3]) -> Vec<Score> {
    let of = |kind: SensorKind| {
        let outcome = calibration.sensor(kind)?;
        let why = match &outcome.verdict {
            Err(refused) => vec![refused.refusal.reason()],
            Ok(()) => outcome.suspicions.iter().map(|found| found.follows.name()).collect(),
        };
        let errors = outcome.passed().map(|fit| errors(fit, &truth[kind as usize])).unwrap_or_default();
        Some(Score { kind, status: outcome.status(), why, errors })
    };
    SensorKind::ALL.into_iter().filter_map(of).collect()
}

/// Errors of the entries that a fit estimated, in standard errors.
fn errors(fit: &FitSummary, truth: &Triad<f64>) -> Vec<f64> {
    let truth = in_gauge_of(fit, truth);
    let full = fit.parameters == 9 && fit.covariance_of.len() == 9 && !fit.covariance_of.contains(&9);
    let entries = fit.covariance_of.iter().copied().chain(if full { 9..12 } else { 0..0 });
    let error = |entry: u8| match usize::from(entry) {
        k @ 0..9 => {
            (fit.triad.gain[(k / 3, k % 3)] - truth.gain[(k / 3, k % 3)], fit.gain_std[(k / 3, k % 3)])
        }
        k => (fit.triad.bias[k - 9] - truth.bias[k - 9], fit.bias_std[k - 9]),
    };
    entries.map(error).map(|(error, std)| if error == 0.0 { 0.0 } else { error / std }).collect()
}

/// The truth in the axes that the fit is in: a norm alone determines an upper triangular gain.
pub(super) fn in_gauge_of(fit: &FitSummary, truth: &Triad<f64>) -> Triad<f64> {
    let upper = fit.covariance_of.iter().all(|entry| ![3, 6, 7].contains(entry));
    if !upper {
        return *truth;
    }
    let r = truth.gain.qr().r();
    // A row's sign is free: positive diagonals are the gauge.
    let signs = Vector3::from_fn(|k, _| r[(k, k)].signum());
    Triad { gain: Matrix3::from_diagonal(&signs) * r, bias: truth.bias }
}

//! What a session knows of one sensor: its triad, how sure it is, and whether it is accepted.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::{
    accept::Refusal,
    fit::{FitSummary, Units},
    record::TriadRecord,
    triad::Triad,
};

/// What the observations so far say of one sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Gain and bias, nominal SI in.
    pub triad: Triad<f32>,
    /// Their standard errors.
    pub std: Triad<f32>,
    /// Figures of the fit.
    pub summary: FitSummary<f32>,
    /// Error of a calibrated vector to be expected, in axes of the sensor's own, as a share of its length:
    /// [`crate::accept::relative_error`].
    pub error: f32,
    /// Why it is not accepted, if it is not.
    pub verdict: Result<(), Refusal>,
    /// Length of the field where only the sensor shows it, µT, calibrated.
    pub field_norm: Option<f32>,
    /// Largest standard error of the rotation into the accelerometer's axes, rad; `None` in axes of its own.
    pub alignment_error: Option<f32>,
    /// Observations that were left out as outliers.
    pub left_out: u8,
}

impl Estimate {
    /// For a record, under the name of its model.
    #[inline]
    pub fn record(&self, model: &str, units: &Units) -> TriadRecord {
        let mut record = self.summary.record(&self.triad, &self.std, model, units);
        record.quality.field_norm = self.field_norm;
        record
    }
}

/// Gauge of a magnetometer: what its parameters do to its gain. `A' = A / d`, `dA' = (dA − A · ⅓ tr(A⁻¹ dA)) / d`, and the trace is
/// `Σ dA_ii / A_ii`.
pub(super) struct Gauge {
    /// Slopes of the trace by the upper triangular gain and the bias.
    trace: SVector<f32, 9>,
    /// d.
    pub(super) divisor: f32,
}

impl Gauge {
    /// In a field of known length: d = 1.
    #[inline]
    pub(super) fn of_known_field() -> Self {
        Self { trace: SVector::zeros(), divisor: 1.0 }
    }

    /// In a field of unknown length: a gain of determinant 1, d = det(A)^⅓.
    #[inline]
    pub(super) fn of_unknown_field(gain: &Matrix3<f32>) -> Self {
        let (x, y, z) = (1.0 / gain.m11, 1.0 / gain.m22, 1.0 / gain.m33);
        let trace = SVector::<f32, 9>::from([x, 0.0, 0.0, y, 0.0, z, 0.0, 0.0, 0.0]);
        Self { trace, divisor: libm::cbrtf(gain.m11 * gain.m22 * gain.m33) }
    }

    /// Slopes of d times an entry of A', of that value in A, by the parameters, among which it has this place.
    #[inline]
    pub(super) fn slopes(&self, entry: usize, value: f32) -> SVector<f32, 9> {
        let mut by = self.trace * (-value / 3.0);
        if let Some(own) = by.get_mut(entry) {
            *own += 1.0;
        }
        by
    }
}

/// A magnetometer in a field of unknown length, in its gauge. `covariance` is that of the upper triangular gain and the bias; gives
/// the triad, its standard errors and the field's length.
#[inline]
pub(super) fn to_unit_determinant(
    triad: &Triad<f32>,
    covariance: &SMatrix<f32, 9, 9>,
    norm: f32,
) -> (Triad<f32>, Triad<f32>, f32) {
    let gain = &triad.gain;
    let gauge = Gauge::of_unknown_field(gain);
    let d = gauge.divisor;
    let std = |entry: usize, value: f32| {
        let by = gauge.slopes(entry, value);
        libm::sqrtf((covariance * by).dot(&by)) / d
    };
    let mut errors = Matrix3::zeros();
    errors.m11 = std(0, gain.m11);
    errors.m12 = std(1, gain.m12);
    errors.m13 = std(2, gain.m13);
    errors.m22 = std(3, gain.m22);
    errors.m23 = std(4, gain.m23);
    errors.m33 = std(5, gain.m33);
    let mut bias = Vector3::zeros();
    for (slot, variance) in bias.iter_mut().zip(covariance.diagonal().iter().skip(6)) {
        *slot = libm::sqrtf(*variance);
    }
    (Triad { gain: gain / d, bias: triad.bias }, Triad { gain: errors, bias }, norm / d)
}

//! A calibration between SI units, for targets that have gain and bias and nothing else.

use imucal_core::triad::Triad;
use nalgebra::{Matrix3, Rotation3};

use super::{ExportError, Inputs};
use crate::recording::{SensorKind, Unit};

/// An entry off the diagonal that is so many times the one on it is no angle between axes.
const OTHER_AXES: f64 = 0.5;

/// A stored triad in SI units; `None` where the sensor is not calibrated.
pub(super) fn si_triad(
    inputs: &Inputs<'_>,
    kind: SensorKind,
    target: &'static str,
) -> Result<Option<Triad<f64>>, ExportError> {
    let calibration = inputs.calibration.ok_or(ExportError::NoCalibration { target })?;
    let Some(stored) = calibration.triad(kind) else { return Ok(None) };
    let wrong = |found| ExportError::WrongUnit { target, sensor: kind, found, expected: Unit::si(kind) };
    let si = |unit: Unit| unit.per_known_si().ok_or_else(|| wrong(unit));
    let (raw, calibrated) = (si(stored.unit_in)?, si(stored.unit_out)?);
    let triad = stored.triad().in_unit(0.0, 1.0 / raw);
    Ok(Some(Triad { gain: triad.gain / calibrated, ..triad }))
}

/// A gain as a rotation after a symmetric matrix, for targets that have the latter.
pub(super) fn symmetric(
    gain: &Matrix3<f64>,
    sensor: SensorKind,
    target: &'static str,
) -> Result<(Rotation3<f64>, Matrix3<f64>), ExportError> {
    polar(gain).ok_or(ExportError::OtherAxes { target, sensor })
}

/// Refuses a gain that swaps or turns axes, for targets that have a scale for each.
pub(super) fn refuse_other_axes(
    gain: &Matrix3<f64>,
    sensor: SensorKind,
    target: &'static str,
) -> Result<(), ExportError> {
    let keeps_axes = gain.diagonal().min() > 0.0 && skew(gain) < OTHER_AXES;
    if keeps_axes { Ok(()) } else { Err(ExportError::OtherAxes { target, sensor }) }
}

/// G = R S: S keeps all lengths right. `None` for a gain that mirrors.
fn polar(gain: &Matrix3<f64>) -> Option<(Rotation3<f64>, Matrix3<f64>)> {
    let svd = gain.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let symmetric = v_t.transpose() * Matrix3::from_diagonal(&svd.singular_values) * v_t;
    let rotation = u * v_t;
    (rotation.determinant() > 0.0).then(|| (Rotation3::from_matrix_unchecked(rotation), symmetric))
}

/// Largest entry off the diagonal over the diagonal entry of its row: what scales alone leave out, rad.
pub(super) fn skew(gain: &Matrix3<f64>) -> f64 {
    let of = |row: usize, column: usize| (gain[(row, column)] / gain[(row, row)]).abs();
    let pairs =
        (0..3).flat_map(|row| (0..3).filter(move |column| *column != row).map(move |column| (row, column)));
    pairs.map(|(row, column)| of(row, column)).fold(0.0, f64::max)
}

/// Terms of a sensor beyond gain and bias, which such a target lacks.
pub(super) fn higher_terms(inputs: &Inputs<'_>, kind: SensorKind) -> Vec<String> {
    let Some(stored) = inputs.calibration.and_then(|calibration| calibration.triad(kind)) else {
        return Vec::new();
    };
    let mut cannot = Vec::new();
    if let Some(terms) = &stored.temperature {
        cannot.push(format!(
            "the temperature terms of {kind}: gain and bias here hold at {:.1} degC",
            terms.reference
        ));
    }
    if stored.nonlinearity.is_some() {
        cannot.push(format!("the nonlinear terms of {kind}: gain and bias were fitted together with them"));
    }
    cannot
}

/// Standard errors, which such a target lacks.
pub(super) fn no_errors() -> String {
    "how certain the numbers are: `imucal inspect` prints their standard errors".into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gain_is_a_rotation_after_a_symmetric_matrix() {
        let gain = Matrix3::new(1.1, 0.02, -0.01, 0.0, 0.95, 0.03, 0.01, 0.0, 1.02);
        let (rotation, s) = symmetric(&gain, SensorKind::Mag, "t").unwrap();
        assert!((rotation.matrix() * s - gain).norm() < 1e-14);
        assert!((s - s.transpose()).norm() < 1e-14);
        let refused = Err(ExportError::OtherAxes { target: "t", sensor: SensorKind::Mag });
        assert_eq!(symmetric(&-gain, SensorKind::Mag, "t"), refused);
        assert_eq!(refuse_other_axes(&gain, SensorKind::Mag, "t"), Ok(()));
        let swapped = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        assert!(symmetric(&swapped, SensorKind::Mag, "t").is_ok());
        assert_eq!(refuse_other_axes(&swapped, SensorKind::Mag, "t").err(), refused.err());
        assert_eq!(skew(&Matrix3::new(2.0, 0.0, -0.1, 0.0, 1.0, 0.0, 0.0, 0.03, 1.0)), 0.05);
    }
}

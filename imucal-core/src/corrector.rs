//! The per-sample correction: the one part of this library that every device needs.
//!
//! [`crate::triad`] and [`crate::temperature`] hold the formulas; here they are chosen between once, from a record.
//! The cost of a sample is asserted by `tests/firmware_link.rs`.

use nalgebra::Vector3;

use crate::record::TriadRecord;
use crate::scalar::Scalar;
use crate::temperature::TemperatureTerms;
use crate::triad::Triad;

/// Turns raw samples of one triad into calibrated ones. No state: samples may come in any order.
///
/// ```
/// use imucal_core::corrector::Corrector;
/// use imucal_core::triad::Triad;
/// use nalgebra::{Matrix3, Vector3};
///
/// let triad = Triad { gain: Matrix3::from_diagonal_element(0.5), bias: Vector3::new(1.0, 2.0, 3.0) };
/// let corrector = Corrector::new(triad, None);
/// assert_eq!(corrector.apply(&Vector3::new(3.0, 3.0, 3.0)), Vector3::new(1.0, 0.5, 0.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corrector<T: Scalar> {
    triad: Triad<T>,
    temperature: Option<TemperatureTerms<T>>,
}

impl<T: Scalar> Corrector<T> {
    /// From a triad and, where it was calibrated, its dependence on temperature.
    pub fn new(triad: Triad<T>, temperature: Option<TemperatureTerms<T>>) -> Self {
        Self { triad, temperature }
    }

    /// `raw`, sensor axes and raw unit, to calibrated axes and unit, as at the reference temperature.
    #[inline]
    pub fn apply(&self, raw: &Vector3<T>) -> Vector3<T> {
        self.triad.correct(raw)
    }

    /// The same for a sample taken at `temperature` °C.
    ///
    /// As [`apply`](Self::apply) where the record has no temperature terms or `temperature` is not finite.
    #[inline]
    pub fn apply_at(&self, raw: &Vector3<T>, temperature: T) -> Vector3<T> {
        match &self.temperature {
            Some(terms) => terms.correct(&self.triad, raw, temperature),
            None => self.triad.correct(raw),
        }
    }
}

impl<T: Scalar> From<&TriadRecord> for Corrector<T> {
    fn from(record: &TriadRecord) -> Self {
        Self::new(record.triad(), record.temperature.map(|terms| terms.cast()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;

    fn triad() -> Triad<f32> {
        Triad {
            gain: Matrix3::new(2.0, 0.5, 0.0, 0.0, 4.0, 0.25, 0.0, 0.0, 8.0),
            bias: Vector3::new(1.0, 2.0, 3.0),
        }
    }

    #[test]
    fn without_terms_the_temperature_changes_nothing() {
        let corrector = Corrector::new(triad(), None);
        let raw = Vector3::new(5.0, 6.0, 7.0);
        assert_eq!(corrector.apply(&raw), triad().correct(&raw));
        assert_eq!(corrector.apply_at(&raw, 60.0), triad().correct(&raw));
    }

    #[test]
    fn with_terms_only_apply_at_heeds_the_temperature() {
        let terms =
            TemperatureTerms { reference: 20.0, bias_slope: [0.5, 0.0, 0.0], scale_slope: [0.0, 0.0, 0.125] };
        let corrector = Corrector::new(triad(), Some(terms));
        let raw = Vector3::new(5.0, 6.0, 7.0);
        assert_eq!(corrector.apply(&raw), triad().correct(&raw));
        assert_eq!(corrector.apply_at(&raw, f32::NAN), triad().correct(&raw));
        assert_eq!(corrector.apply_at(&raw, 22.0), triad().correct(&raw) + Vector3::new(-2.0, 0.0, 8.0));
    }
}

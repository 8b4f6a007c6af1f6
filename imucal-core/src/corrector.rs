//! The per-sample correction: the one part of this library that every device needs.
//!
//! [`crate::triad`] and [`crate::temperature`] hold the formulas; here they are chosen between once, from a record.
//! The cost of a sample is asserted by `tests/firmware_link.rs`.

use nalgebra::Vector3;

use crate::record::TriadRecord;
use crate::scalar::Scalar;
use crate::temperature::{TemperatureTerms, Warmth};
use crate::triad::Triad;

/// Turns raw samples of one triad into calibrated ones. No state; [`Compensator`] has what a stream can do with one.
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
        // A bias of −0 becomes 0, so that a drift of nothing changes no bit.
        let bias = Vector3::new(triad.bias.x + T::zero(), triad.bias.y + T::zero(), triad.bias.z + T::zero());
        Self { triad: Triad { bias, ..triad }, temperature }
    }

    /// `raw`, sensor axes and raw unit, to calibrated axes and unit, as at the reference temperature.
    #[inline]
    pub fn apply(&self, raw: &Vector3<T>) -> Vector3<T> {
        self.triad.correct(raw)
    }

    /// The same for a sample taken at `temperature` °C.
    ///
    /// As [`apply`](Self::apply) where the record has no temperature terms or `temperature` is not finite. A stream is
    /// corrected at half the cost by a [`Compensator`], to the same bits.
    #[inline]
    pub fn apply_at(&self, raw: &Vector3<T>, temperature: T) -> Vector3<T> {
        Compensator::new(*self).apply_at(raw, temperature)
    }
}

/// A corrector that follows the temperature: what depends on that is computed again only where the reading changes.
///
/// A sensor's thermometer is read less often than the sensor, and rounds to steps that it keeps for many samples. The
/// results are those of [`Corrector::apply_at`], bit for bit, in whatever order samples come.
///
/// ```
/// use imucal_core::corrector::{Compensator, Corrector};
/// use imucal_core::temperature::TemperatureTerms;
/// use imucal_core::triad::Triad;
/// use nalgebra::Vector3;
///
/// let terms = TemperatureTerms { reference: 25.0, bias_slope: [0.5; 3], scale_slope: [0.0; 3] };
/// let mut compensator = Compensator::new(Corrector::new(Triad::identity(), Some(terms)));
/// assert_eq!(compensator.apply_at(&Vector3::repeat(3.0), 27.0), Vector3::repeat(2.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compensator<T: Scalar> {
    corrector: Corrector<T>,
    /// The last reading, °C; not a number before the first.
    temperature: T,
    /// At that temperature.
    warmth: Warmth<T>,
}

impl<T: Scalar> Compensator<T> {
    /// Before the first sample.
    pub fn new(corrector: Corrector<T>) -> Self {
        Self { temperature: T::of(f64::NAN), warmth: Warmth::none(&corrector.triad), corrector }
    }

    /// `raw`, taken at `temperature` °C, as [`Corrector::apply_at`] has it.
    #[inline]
    pub fn apply_at(&mut self, raw: &Vector3<T>, temperature: T) -> Vector3<T> {
        let Corrector { triad, temperature: terms } = &self.corrector;
        if let Some(terms) = terms
            && !temperature.same(self.temperature)
        {
            (self.temperature, self.warmth) = (temperature, terms.at(triad, temperature));
        }
        self.warmth.correct(triad, raw)
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
    use proptest::array::uniform3;
    use proptest::prelude::*;

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

    proptest! {
        #[test]
        fn a_compensator_has_the_bits_of_its_corrector_at_any_temperature(
            samples in prop::collection::vec((uniform3(-4e4f32..4e4), 0usize..7), 1..60),
            bias_slope in uniform3(-9f32..9.0), scale_slope in uniform3(-0.01f32..0.01), with in any::<bool>(),
        ) {
            let readings = [25.0, -40.0, 61.7, 61.75, 0.0, -0.0, f32::NAN];
            let terms = TemperatureTerms { reference: 20.0, bias_slope, scale_slope };
            let corrector = Corrector::new(triad(), with.then_some(terms));
            let mut compensator = Compensator::new(corrector);
            for (raw, reading) in samples {
                let (raw, temperature) = (Vector3::from(raw), readings[reading]);
                let (a, b) = (compensator.apply_at(&raw, temperature), corrector.apply_at(&raw, temperature));
                prop_assert_eq!(a.map(f32::to_bits), b.map(f32::to_bits));
            }
        }
    }
}

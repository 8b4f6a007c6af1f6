//! The per-sample correction: the one part of this library that every device needs.
//!
//! [`crate::triad`], [`crate::temperature`] and [`crate::nonlinearity`] hold the formulas; here they are chosen between
//! once, from a record:
//!
//! | record | corrector | a sample |
//! | --- | --- | --- |
//! | of [`FirstOrder`] | [`Corrector`] | subtractions and a product |
//! | of [`HigherOrder`] | [`FullCorrector`] | the same, and what else the record has |
//!
//! The types keep the two apart: a [`Corrector`] is not made from a record of higher order, whose terms it would leave
//! out. The cost of a sample is asserted by `tests/firmware_link.rs` and `tests/device_cost.rs`.

use nalgebra::Vector3;

use crate::nonlinearity::TooSteep;
use crate::record::{FirstOrder, HigherOrder, TriadRecord};
use crate::scalar::Scalar;
use crate::temperature::{TemperatureTerms, Warmth};
use crate::triad::Triad;

mod full;

pub use full::FullCorrector;

mod sealed {
    pub trait Sealed {}
}

/// A correction that depends on the temperature through [`Warmth`] alone: what a [`Compensator`] keeps.
pub trait Correction<T: Scalar>: sealed::Sealed + Copy {
    /// The triad.
    fn triad(&self) -> &Triad<T>;
    /// What warmth makes of the triad at `temperature` °C; `None` where it makes nothing at any.
    fn warmth(&self, temperature: T) -> Option<Warmth<T>>;
    /// `raw`, sensor axes and raw unit, to calibrated axes and unit.
    fn correct(&self, warmth: &Warmth<T>, raw: &Vector3<T>) -> Vector3<T>;
}

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
pub struct Compensator<T: Scalar, C = Corrector<T>> {
    corrector: C,
    /// The last reading, °C; not a number before the first.
    temperature: T,
    /// At that temperature.
    warmth: Warmth<T>,
}

impl<T: Scalar, C: Correction<T>> Compensator<T, C> {
    /// Before the first sample.
    pub fn new(corrector: C) -> Self {
        Self { temperature: T::of(f64::NAN), warmth: Warmth::none(corrector.triad()), corrector }
    }

    /// `raw`, taken at `temperature` °C, as [`Corrector::apply_at`] has it.
    #[inline]
    pub fn apply_at(&mut self, raw: &Vector3<T>, temperature: T) -> Vector3<T> {
        if !temperature.same(self.temperature)
            && let Some(warmth) = self.corrector.warmth(temperature)
        {
            (self.temperature, self.warmth) = (temperature, warmth);
        }
        self.corrector.correct(&self.warmth, raw)
    }
}

impl<T: Scalar> sealed::Sealed for Corrector<T> {}

impl<T: Scalar> Correction<T> for Corrector<T> {
    #[inline]
    fn triad(&self) -> &Triad<T> {
        &self.triad
    }
    #[inline]
    fn warmth(&self, temperature: T) -> Option<Warmth<T>> {
        self.temperature.as_ref().map(|terms| terms.at(&self.triad, temperature))
    }
    #[inline]
    fn correct(&self, warmth: &Warmth<T>, raw: &Vector3<T>) -> Vector3<T> {
        warmth.correct(&self.triad, raw)
    }
}

impl<T: Scalar> From<&TriadRecord> for Corrector<T> {
    fn from(record: &TriadRecord) -> Self {
        Self::of(record)
    }
}

impl<T: Scalar> Corrector<T> {
    /// What a record has of the first order.
    fn of<O>(record: &TriadRecord<O>) -> Self {
        Self::new(record.triad(), record.temperature.map(|terms| terms.cast()))
    }
}

impl<T: Scalar> From<&TriadRecord> for FullCorrector<T> {
    fn from(record: &TriadRecord<FirstOrder>) -> Self {
        Corrector::from(record).into()
    }
}

impl<T: Scalar> TryFrom<&TriadRecord<HigherOrder>> for FullCorrector<T> {
    type Error = TooSteep;

    /// Refuses none that [`decode_as`](crate::record::decode_as) gives.
    fn try_from(record: &TriadRecord<HigherOrder>) -> Result<Self, TooSteep> {
        let HigherOrder { curvature, nonlinearity, warmth: _ } = &record.order;
        let curvature = curvature.map(|curvature| curvature.terms.cast());
        let nonlinearity = nonlinearity.map(|found| found.nonlinearity().cast());
        Self::new(Corrector::of(record), curvature, nonlinearity)
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

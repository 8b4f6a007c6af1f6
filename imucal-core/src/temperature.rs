//! What warmth does to a triad: a bias that drifts and a scale that drifts, to first order or to second.
//!
//! ```text
//! Δ          = θ − θ₀
//! b          = bias + β·Δ + β₂·Δ²
//! f          = 1 + s·Δ + s₂·Δ²
//! calibrated = f ∘ gain · (raw − b)             correct, on the device
//! raw        = gain⁻¹ · (calibrated ⊘ f) + b    predict, in the simulator
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | θ, θ₀ | the sensor's temperature, and that at which `gain` and `bias` hold, °C |
//! | β | [`bias_slope`](TemperatureTerms::bias_slope) |
//! | s | [`scale_slope`](TemperatureTerms::scale_slope) |
//! | β₂, s₂ | [`bias`](TemperatureCurvature::bias) and [`scale`](TemperatureCurvature::scale) of the curvature; zero to first order |
//! | ∘, ⊘ | product and quotient axis by axis |
//!
//! Both b and f hold for all samples of one temperature: a device keeps them ([`Warmth`]) from one reading of its
//! thermometer to the next. The scale stays outside the gain: as part of it it would spare a product an axis while the
//! temperature stands, and take six more wherever it moves.
//!
//! Source: the temperature terms of IEEE Std 1293, cut after the second order. Not modelled: drift of the axes'
//! directions, hysteresis, and the lag between the thermometer and the sensing element.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::scalar::Scalar;
use crate::triad::Triad;

pub mod course;

/// First-order temperature dependence of a [`Triad`]. Plain arrays, since a record stores them as they stand.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TemperatureTerms<T> {
    /// θ₀, °C: where the triad holds as it is. Usually the mean temperature of the calibration.
    pub reference: T,
    /// β, raw unit per kelvin, sensor axes: growth of the bias.
    pub bias_slope: [T; 3],
    /// s, per kelvin, calibrated axes: relative growth of the corrected value. Well below 0.01 on real sensors.
    pub scale_slope: [T; 3],
}

impl<T: Scalar> TemperatureTerms<T> {
    /// A raw sample, sensor axes and raw unit, taken at `temperature` °C, to calibrated axes and unit.
    ///
    /// A temperature that is not finite counts as the reference: a dead thermometer costs the temperature
    /// correction and not the sample.
    #[inline]
    pub fn correct(&self, triad: &Triad<T>, raw: &Vector3<T>, temperature: T) -> Vector3<T> {
        self.at(triad, temperature).correct(triad, raw)
    }

    /// What warmth makes of a triad at `temperature` °C.
    #[inline]
    pub fn at(&self, triad: &Triad<T>, temperature: T) -> Warmth<T> {
        let change = self.change(temperature);
        let (drift, factor) = (self.drift(change), self.factor(change));
        let bias = Vector3::new(triad.bias.x + drift.x, triad.bias.y + drift.y, triad.bias.z + drift.z);
        Warmth { bias, factor }
    }

    /// The same to second order.
    #[inline]
    pub fn at_curved(
        &self,
        curvature: &TemperatureCurvature<T>,
        triad: &Triad<T>,
        temperature: T,
    ) -> Warmth<T> {
        let Warmth { bias, factor } = self.at(triad, temperature);
        let change = self.change(temperature);
        let (drift, growth) = (curvature.drift(change), curvature.growth(change));
        Warmth {
            bias: Vector3::new(bias.x + drift.x, bias.y + drift.y, bias.z + drift.z),
            factor: Vector3::new(factor.x + growth.x, factor.y + growth.y, factor.z + growth.z),
        }
    }

    /// What the sensor would put out at `temperature` °C for a calibrated value.
    ///
    /// `None` where the gain is singular or the scale has drifted to zero, which nothing can undo.
    pub fn predict(&self, triad: &Triad<T>, calibrated: &Vector3<T>, temperature: T) -> Option<Vector3<T>> {
        let sensed = self.at(triad, temperature).sensed(triad, calibrated)?;
        Some(sensed + triad.bias + self.drift(self.change(temperature)))
    }

    /// Every term is finite.
    pub fn is_finite(&self) -> bool {
        self.reference.finite() && self.bias_slope.iter().chain(&self.scale_slope).all(|x| x.finite())
    }

    /// The same terms in another precision.
    pub fn cast<U: Scalar>(&self) -> TemperatureTerms<U> {
        TemperatureTerms {
            reference: U::of(self.reference.wide()),
            bias_slope: self.bias_slope.map(|x| U::of(x.wide())),
            scale_slope: self.scale_slope.map(|x| U::of(x.wide())),
        }
    }

    /// The same terms for raw values of another affine unit, as [`Triad::in_unit`] has it.
    pub fn in_unit(&self, per_unit: T) -> Self {
        Self { bias_slope: self.bias_slope.map(|slope| slope * per_unit), ..*self }
    }

    /// The same terms from another reference temperature, °C, where the triad is that of this temperature. One that is not finite
    /// leaves the reference as it is.
    #[must_use]
    pub fn from_reference(&self, reference: T) -> Self {
        let factor = self.factor(self.change(reference));
        let [x, y, z] = self.scale_slope;
        let reference = if reference.finite() { reference } else { self.reference };
        Self { reference, scale_slope: [x / factor.x, y / factor.y, z / factor.z], ..*self }
    }

    #[inline]
    fn change(&self, temperature: T) -> T {
        if temperature.finite() { temperature - self.reference } else { T::zero() }
    }

    #[inline]
    fn drift(&self, change: T) -> Vector3<T> {
        let [x, y, z] = self.bias_slope;
        Vector3::new(x * change, y * change, z * change)
    }

    #[inline]
    fn factor(&self, change: T) -> Vector3<T> {
        let [x, y, z] = self.scale_slope;
        Vector3::new(T::one() + x * change, T::one() + y * change, T::one() + z * change)
    }
}

/// What the first order leaves: the coefficients of Δ², from the same reference temperature.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TemperatureCurvature<T> {
    /// β₂, raw unit per kelvin², sensor axes.
    pub bias: [T; 3],
    /// s₂, per kelvin², calibrated axes. Well below 1e-4 on real sensors.
    pub scale: [T; 3],
}

impl<T: Scalar> TemperatureCurvature<T> {
    /// β₂·Δ²: what it adds to the bias `change` kelvin from the reference, raw unit.
    #[inline]
    pub fn drift(&self, change: T) -> Vector3<T> {
        times_square(&self.bias, change)
    }

    /// s₂·Δ²: what it adds to the scale's factor.
    #[inline]
    pub fn growth(&self, change: T) -> Vector3<T> {
        times_square(&self.scale, change)
    }

    /// The same in another precision.
    pub fn cast<U: Scalar>(&self) -> TemperatureCurvature<U> {
        let of = |x: T| U::of(x.wide());
        TemperatureCurvature { bias: self.bias.map(of), scale: self.scale.map(of) }
    }
}

#[inline]
fn times_square<T: Scalar>([x, y, z]: &[T; 3], change: T) -> Vector3<T> {
    let square = change * change;
    Vector3::new(*x * square, *y * square, *z * square)
}

/// A triad's bias and scale at one temperature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Warmth<T: Scalar> {
    /// b, raw unit, sensor axes.
    pub bias: Vector3<T>,
    /// f, calibrated axes.
    pub factor: Vector3<T>,
}

impl<T: Scalar> Warmth<T> {
    /// Of a triad as it is.
    #[inline]
    pub fn none(triad: &Triad<T>) -> Self {
        Self { bias: triad.bias, factor: Vector3::new(T::one(), T::one(), T::one()) }
    }

    /// A raw sample of this temperature, sensor axes and raw unit, to calibrated axes and unit.
    #[inline]
    pub fn correct(&self, triad: &Triad<T>, raw: &Vector3<T>) -> Vector3<T> {
        let value = Triad { gain: triad.gain, bias: self.bias }.correct(raw);
        Vector3::new(value.x * self.factor.x, value.y * self.factor.y, value.z * self.factor.z)
    }

    /// What each axis senses of a calibrated value at this temperature: `gain⁻¹ · (calibrated ⊘ f)`, raw unit, sensor
    /// axes. With the bias it is what the sensor would put out.
    ///
    /// `None` where the gain is singular or the scale has drifted to zero, which nothing can undo.
    pub fn sensed(&self, triad: &Triad<T>, calibrated: &Vector3<T>) -> Option<Vector3<T>> {
        // Component by component: `component_div` indexes, a path to a panic.
        let factor = &self.factor;
        if factor.iter().any(|f| *f == T::zero()) {
            return None;
        }
        let value = Vector3::new(calibrated.x / factor.x, calibrated.y / factor.y, calibrated.z / factor.z);
        Some(triad.sensitivity()? * value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;
    use proptest::array::{uniform3, uniform6};
    use proptest::prelude::*;

    fn triad() -> impl Strategy<Value = Triad<f64>> {
        (uniform3(0.8f64..1.2), uniform6(-0.1f64..0.1), uniform3(-50.0f64..50.0)).prop_map(|(s, k, b)| {
            Triad {
                gain: Matrix3::new(s[0], k[0], k[1], k[2], s[1], k[3], k[4], k[5], s[2]),
                bias: Vector3::from(b),
            }
        })
    }

    /// Terms some ten times worse than sensors have them.
    fn terms() -> impl Strategy<Value = TemperatureTerms<f64>> {
        (0.0f64..50.0, uniform3(-0.5f64..0.5), uniform3(-0.003f64..0.003)).prop_map(
            |(reference, bias_slope, scale_slope)| TemperatureTerms { reference, bias_slope, scale_slope },
        )
    }

    proptest! {
        #[test]
        fn correct_undoes_predict_at_every_temperature(t in triad(), w in terms(),
                x in uniform3(-100.0f64..100.0), temperature in -40.0f64..85.0) {
            let x = Vector3::from(x);
            let raw = w.predict(&t, &x, temperature).unwrap();
            prop_assert!((w.correct(&t, &raw, temperature) - x).norm() < 1e-11 * (1.0 + x.norm()));
        }

        #[test]
        fn a_change_of_unit_changes_no_calibrated_value(t in triad(), w in terms(), x in uniform3(-100.0f64..100.0),
                temperature in -40.0f64..85.0, offset in -4e4f64..4e4, per_unit in 1.0f64..5e3) {
            let x = Vector3::from(x);
            let counts = x * per_unit + Vector3::repeat(offset);
            let a = w.correct(&t, &x, temperature);
            let b = w.in_unit(per_unit).correct(&t.in_unit(offset, per_unit), &counts, temperature);
            prop_assert!((a - b).norm() < 1e-9 * (1.0 + a.norm()));
        }

        #[test]
        fn a_triad_at_another_reference_is_the_same_at_every_temperature(t in triad(), w in terms(),
                x in uniform3(-100.0f64..100.0), other in 0.0f64..50.0, temperature in -40.0f64..85.0) {
            let at = w.at(&t, other);
            let moved = Triad { gain: Matrix3::from_diagonal(&at.factor) * t.gain, bias: at.bias };
            let (a, b) = (w.correct(&t, &Vector3::from(x), temperature),
                w.from_reference(other).correct(&moved, &Vector3::from(x), temperature));
            prop_assert!((a - b).norm() < 1e-10 * (1.0 + a.norm()), "{} {}", a, b);
            prop_assert_eq!(w.from_reference(f64::NAN), w);
        }

        #[test]
        fn at_the_reference_the_terms_change_nothing(t in triad(), w in terms(), raw in uniform3(-100.0f64..100.0)) {
            let raw = Vector3::from(raw);
            prop_assert_eq!(w.correct(&t, &raw, w.reference), t.correct(&raw));
        }
    }

    fn example() -> TemperatureTerms<f32> {
        TemperatureTerms { reference: 25.0, bias_slope: [0.5, 0.0, -0.25], scale_slope: [0.0, 1e-3, -0.1] }
    }

    #[test]
    fn bias_and_scale_drift_with_their_own_signs() {
        let got = example().correct(&Triad::identity(), &Vector3::new(10.0, 10.0, 10.0), 29.0);
        assert!((got - Vector3::new(8.0, 10.04, 6.6)).norm() < 1e-5, "{got}");
    }

    #[test]
    fn a_dead_thermometer_counts_as_the_reference() {
        let raw = Vector3::new(1.0, 2.0, 3.0);
        for dead in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert_eq!(example().correct(&Triad::identity(), &raw, dead), raw);
        }
    }

    #[test]
    fn a_scale_that_has_drifted_to_zero_has_no_prediction() {
        assert!(example().predict(&Triad::identity(), &Vector3::x(), 35.0).is_none());
    }
}

//! The correction with every term that a record can hold.
//!
//! ```text
//! x          = sense(raw − b)                  undoes the nonlinearity; x = raw − b without one
//! calibrated = f ∘ gain · x                    apply, on the device
//! raw        = respond(gain⁻¹ · (calibrated ⊘ f)) + b    predict, in the simulator
//! ```
//!
//! b and f are bias and scale at the sample's temperature ([`crate::temperature`]), sense and respond those of
//! [`crate::nonlinearity`]. Without higher terms the bits are those of a [`Corrector`].

use nalgebra::Vector3;

use super::{Correction, Corrector, sealed::Sealed};
use crate::nonlinearity::{Linearizer, Nonlinearity, TooSteep};
use crate::scalar::Scalar;
use crate::temperature::{TemperatureCurvature, Warmth};
use crate::triad::Triad;

/// Turns raw samples of one triad into calibrated ones by all terms of a record. No state, as [`Corrector`].
///
/// ```
/// use imucal_core::corrector::{Corrector, FullCorrector};
/// use imucal_core::nonlinearity::{NonlinearTerms, Nonlinearity};
/// use imucal_core::triad::Triad;
/// use nalgebra::Vector3;
///
/// let terms = NonlinearTerms { quadratic: [1e-3, 0.0, 0.0], ..NonlinearTerms::none() };
/// let bent = Nonlinearity { terms, range: 20.0 };
/// let corrector = FullCorrector::new(Corrector::new(Triad::identity(), None), None, Some(bent))?;
/// let calibrated = corrector.apply(&Vector3::new(10.1, 0.0, 0.0)); // 10 + 1e-3 · 10²
/// assert!((calibrated.x - 10.0f64).abs() < 20.0 * imucal_core::nonlinearity::TOLERANCE);
/// # Ok::<(), imucal_core::nonlinearity::TooSteep>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FullCorrector<T: Scalar> {
    first: Corrector<T>,
    curvature: Option<TemperatureCurvature<T>>,
    linearizer: Option<Linearizer<T>>,
}

impl<T: Scalar> FullCorrector<T> {
    /// From the first order and what else there is. A curvature without temperature terms has no reference, and
    /// does nothing.
    ///
    /// # Errors
    ///
    /// [`TooSteep`] for a nonlinearity that cannot be undone.
    pub fn new(
        first: Corrector<T>,
        curvature: Option<TemperatureCurvature<T>>,
        nonlinearity: Option<Nonlinearity<T>>,
    ) -> Result<Self, TooSteep> {
        let linearizer = nonlinearity.map(Linearizer::new).transpose()?;
        Ok(Self { first, curvature, linearizer })
    }

    /// `raw`, sensor axes and raw unit, to calibrated axes and unit, as at the reference temperature.
    #[inline]
    pub fn apply(&self, raw: &Vector3<T>) -> Vector3<T> {
        self.correct(&Warmth::none(&self.first.triad), raw)
    }

    /// The same for a sample taken at `temperature` °C.
    ///
    /// As [`apply`](Self::apply) where the record has no temperature terms or `temperature` is not finite. A
    /// [`Compensator`](super::Compensator) corrects a stream at less cost, to the same bits.
    #[inline]
    pub fn apply_at(&self, raw: &Vector3<T>, temperature: T) -> Vector3<T> {
        self.correct(&self.warmth_or_none(temperature), raw)
    }

    /// What the sensor would put out at `temperature` °C for a calibrated value.
    ///
    /// [`apply_at`](Self::apply_at) undoes it to [`TOLERANCE`](crate::nonlinearity::TOLERANCE) of the nonlinearity's
    /// range, times the gain, and to rounding. `None` where the gain is singular or the scale has drifted to zero.
    pub fn predict_at(&self, calibrated: &Vector3<T>, temperature: T) -> Option<Vector3<T>> {
        let warmth = self.warmth_or_none(temperature);
        let sensed = warmth.sensed(&self.first.triad, calibrated)?;
        let output = self.linearizer.map_or(sensed, |undone| undone.nonlinearity().respond(&sensed));
        Some(output + warmth.bias)
    }

    #[inline]
    fn warmth_or_none(&self, temperature: T) -> Warmth<T> {
        self.warmth(temperature).unwrap_or(Warmth::none(&self.first.triad))
    }
}

impl<T: Scalar> From<Corrector<T>> for FullCorrector<T> {
    fn from(first: Corrector<T>) -> Self {
        Self { first, curvature: None, linearizer: None }
    }
}

impl<T: Scalar> Sealed for FullCorrector<T> {}

impl<T: Scalar> Correction<T> for FullCorrector<T> {
    #[inline]
    fn triad(&self) -> &Triad<T> {
        &self.first.triad
    }
    #[inline]
    fn warmth(&self, temperature: T) -> Option<Warmth<T>> {
        let (triad, terms) = (&self.first.triad, self.first.temperature.as_ref()?);
        Some(match &self.curvature {
            Some(curvature) => terms.at_curved(curvature, triad, temperature),
            None => terms.at(triad, temperature),
        })
    }
    #[inline]
    fn correct(&self, warmth: &Warmth<T>, raw: &Vector3<T>) -> Vector3<T> {
        let Some(linearizer) = &self.linearizer else { return warmth.correct(&self.first.triad, raw) };
        let bias = &warmth.bias;
        let sensed = linearizer.sense(&Vector3::new(raw.x - bias.x, raw.y - bias.y, raw.z - bias.z));
        let value = self.first.triad.scaled(sensed.x, sensed.y, sensed.z);
        let factor = &warmth.factor;
        Vector3::new(value.x * factor.x, value.y * factor.y, value.z * factor.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corrector::Compensator;
    use crate::nonlinearity::{NonlinearTerms, TOLERANCE};
    use crate::temperature::TemperatureTerms;
    use nalgebra::Matrix3;
    use proptest::array::{uniform3, uniform9};
    use proptest::prelude::*;

    /// The range of a 16-bit converter about its middle.
    const RANGE: f64 = 32_768.0;

    /// A sensor in counts: skewed, biased, warm or not, bent or not.
    #[derive(Clone, Copy, Debug)]
    struct Sensor {
        triad: Triad<f64>,
        terms: Option<TemperatureTerms<f64>>,
        curvature: Option<TemperatureCurvature<f64>>,
        nonlinearity: Option<Nonlinearity<f64>>,
    }

    impl Sensor {
        fn first(&self) -> Corrector<f64> {
            Corrector::new(self.triad, self.terms)
        }

        fn corrector(&self) -> FullCorrector<f64> {
            FullCorrector::new(self.first(), self.curvature, self.nonlinearity).unwrap()
        }

        /// The same in `f32`.
        fn narrow(&self) -> FullCorrector<f32> {
            let triad = Triad { gain: self.triad.gain.cast(), bias: self.triad.bias.cast() };
            let first = Corrector::new(triad, self.terms.map(|terms| terms.cast()));
            let curvature = self.curvature.map(|terms| terms.cast());
            FullCorrector::new(first, curvature, self.nonlinearity.map(|n| n.cast())).unwrap()
        }
    }

    fn sensor() -> impl Strategy<Value = Sensor> {
        let triad = (uniform3(2e-3f64..3e-3), uniform9(-1e-4f64..1e-4), uniform3(-3e3f64..3e3)).prop_map(
            |(scale, skew, bias)| Triad {
                gain: Matrix3::from_diagonal(&Vector3::from(scale)) + Matrix3::from_row_slice(&skew),
                bias: Vector3::from(bias),
            },
        );
        let terms = (10f64..40.0, uniform3(-20f64..20.0), uniform3(-1e-3f64..1e-3)).prop_map(
            |(reference, bias_slope, scale_slope)| TemperatureTerms { reference, bias_slope, scale_slope },
        );
        let curvature = (uniform3(-0.2f64..0.2), uniform3(-1e-5f64..1e-5))
            .prop_map(|(bias, scale)| TemperatureCurvature { bias, scale });
        // Each row's slope is below 0.1 where no share is above 0.019.
        let share = || uniform3(-0.019f64..0.019);
        let nonlinearity = (share(), share(), uniform3(share())).prop_map(|(quadratic, cubic, cross)| {
            let first = |x: f64| x / (2.0 * RANGE);
            let terms = NonlinearTerms {
                quadratic: quadratic.map(first),
                cubic: cubic.map(|x| x / (3.0 * RANGE * RANGE)),
                cross: cross.map(|row| row.map(first)),
            };
            Nonlinearity { terms, range: RANGE }
        });
        use prop::option::of;
        (triad, of(terms), of(curvature), of(nonlinearity)).prop_map(
            |(triad, terms, curvature, nonlinearity)| Sensor { triad, terms, curvature, nonlinearity },
        )
    }

    proptest! {
        /// Over three times the range, from −40 to 85 °C.
        #[test]
        fn correct_undoes_predict_to_the_tolerance_of_the_range(
            sensor in sensor(), x in uniform3(-200f64..200.0), temperature in -40.0f64..85.0,
        ) {
            let (corrector, x) = (sensor.corrector(), Vector3::from(x));
            let raw = corrector.predict_at(&x, temperature).unwrap();
            let missed = (corrector.apply_at(&raw, temperature) - x).amax();
            // In raw units TOLERANCE · RANGE an axis; a row of the gain is below 3.4e-3, the scale's factor below 1.3.
            let most = TOLERANCE * RANGE * 3.4e-3 * 1.3 + 1e-9;
            prop_assert!(missed <= most, "{missed:e} of {most:e}");
        }

        #[test]
        fn without_higher_terms_the_bits_are_those_of_a_corrector(
            sensor in sensor(), raw in uniform3(-4e4f64..4e4), temperature in -40.0f64..85.0,
        ) {
            let (first, raw) = (sensor.first(), Vector3::from(raw));
            let full = FullCorrector::from(first);
            let both = [(first.apply(&raw), full.apply(&raw)),
                (first.apply_at(&raw, temperature), full.apply_at(&raw, temperature))];
            for (a, b) in both {
                prop_assert_eq!(a.map(f64::to_bits), b.map(f64::to_bits));
            }
        }

        #[test]
        fn a_compensator_has_the_bits_of_its_full_corrector_at_any_temperature(
            sensor in sensor(), samples in prop::collection::vec((uniform3(-4e4f32..4e4), 0usize..6), 1..40),
        ) {
            let readings = [25.0, -40.0, 61.7, 61.75, f32::NAN, 0.0];
            let corrector = sensor.narrow();
            let mut compensator = Compensator::new(corrector);
            for (raw, reading) in samples {
                let (raw, temperature) = (Vector3::from(raw), readings[reading]);
                let (a, b) = (compensator.apply_at(&raw, temperature), corrector.apply_at(&raw, temperature));
                prop_assert_eq!(a.map(f32::to_bits), b.map(f32::to_bits));
            }
        }

        #[test]
        fn a_dead_thermometer_counts_as_the_reference(sensor in sensor(), raw in uniform3(-4e4f64..4e4)) {
            let (corrector, raw) = (sensor.corrector(), Vector3::from(raw));
            for dead in [f64::NAN, f64::INFINITY] {
                prop_assert_eq!(corrector.apply_at(&raw, dead), corrector.apply(&raw));
            }
        }

        /// Written out from the equation, with the inverse by bisection where axes do not mix.
        #[test]
        fn one_axis_is_corrected_as_the_equation_has_it(
            q in -0.01f64..0.01, c in -0.01f64..0.01, u in -1f64..1.0, change in -60f64..60.0,
        ) {
            let terms = TemperatureTerms { reference: 20.0, bias_slope: [3.0, 0.0, 0.0], scale_slope: [1e-3, 0.0, 0.0] };
            let curvature = TemperatureCurvature { bias: [-0.05, 0.0, 0.0], scale: [2e-6, 0.0, 0.0] };
            let bent = NonlinearTerms {
                quadratic: [q / RANGE, 0.0, 0.0], cubic: [c / (RANGE * RANGE), 0.0, 0.0], ..NonlinearTerms::none()
            };
            let triad = Triad { gain: Matrix3::identity() * 2.5e-3, bias: Vector3::new(100.0, 0.0, 0.0) };
            let nonlinearity = Some(Nonlinearity { terms: bent, range: 1.2 * RANGE });
            let corrector =
                FullCorrector::new(Corrector::new(triad, Some(terms)), Some(curvature), nonlinearity).unwrap();
            let raw = u * RANGE;
            let output = raw - (100.0 + 3.0 * change - 0.05 * change * change);
            let (mut low, mut high) = (-1.2 * RANGE, 1.2 * RANGE);
            for _ in 0..200 {
                let x = 0.5 * (low + high);
                let puts_out = x + q / RANGE * x * x + c / (RANGE * RANGE) * x * x * x;
                if puts_out < output { low = x } else { high = x }
            }
            let expected = low * 2.5e-3 * (1.0 + 1e-3 * change + 2e-6 * change * change);
            let got = corrector.apply_at(&Vector3::new(raw, 0.0, 0.0), 20.0 + change).x;
            prop_assert!((got - expected).abs() <= TOLERANCE * 1.2 * RANGE * 2.5e-3 * 1.1, "{got} {expected}");
        }
    }

    #[test]
    fn terms_that_cannot_be_undone_make_no_corrector() {
        let terms = NonlinearTerms { quadratic: [0.1, 0.0, 0.0], ..NonlinearTerms::none() };
        let first = Corrector::new(Triad::identity(), None);
        let refused = FullCorrector::new(first, None, Some(Nonlinearity { terms, range: 1.0 }));
        assert_eq!(refused, Err(TooSteep { slope: 0.2f64 as f32 }));
    }
}

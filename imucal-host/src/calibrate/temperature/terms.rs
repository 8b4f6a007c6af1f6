//! Terms of temperature as a fit finds them, and what they make of an observation: reduced to the reference temperature.
//!
//! ```text
//! m' = G⁻¹ (f ∘ G (m − b(θ))) + b,   f = 1 + s Δ + s₂ Δ²,   b(θ) = b + β Δ + β₂ Δ²
//! ```
//!
//! A reduced observation is what the sensor would have put out at the reference temperature: everything that is made of
//! observations after the terms are known is made of these, and knows nothing of temperature.

use imucal_core::{
    model::thermal::UNIT,
    temperature::{TemperatureTerms, Warmth},
    triad::Triad,
};
use nalgebra::{DVector, Matrix3, Vector3};

use super::{groups::Group, problem::ThermalProblem};

/// Terms of first and second order, nominal SI; or their standard errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terms {
    /// θ₀, β and s.
    pub linear: TemperatureTerms<f64>,
    /// β₂, unit per K²; zero where it is not estimated.
    pub bias_quadratic: Vector3<f64>,
    /// s₂, per K²; zero where it is not estimated.
    pub scale_quadratic: Vector3<f64>,
}

impl Terms {
    /// None, at a reference temperature, °C.
    pub fn none(reference: f64) -> Self {
        Self {
            linear: TemperatureTerms { reference, bias_slope: [0.0; 3], scale_slope: [0.0; 3] },
            bias_quadratic: Vector3::zeros(),
            scale_quadratic: Vector3::zeros(),
        }
    }

    /// Of a fit's parameters, or of their standard errors.
    pub fn of(problem: &dyn ThermalProblem, values: &DVector<f64>, reference: f64) -> Self {
        let term = |group| problem.term(values, group) / UNIT;
        Self {
            linear: TemperatureTerms {
                reference,
                bias_slope: term(Group::Bias).into(),
                scale_slope: term(Group::Scale).into(),
            },
            bias_quadratic: term(Group::BiasQuadratic) / UNIT,
            scale_quadratic: term(Group::ScaleQuadratic) / UNIT,
        }
    }

    /// The bias of these and the scale of those.
    #[must_use]
    pub fn with_scale_of(&self, other: &Self) -> Self {
        Self {
            linear: TemperatureTerms { scale_slope: other.linear.scale_slope, ..self.linear },
            scale_quadratic: other.scale_quadratic,
            ..*self
        }
    }

    /// Whether there are terms of second order.
    pub fn is_quadratic(&self) -> bool {
        self.bias_quadratic != Vector3::zeros() || self.scale_quadratic != Vector3::zeros()
    }

    /// What the bias has grown by, unit.
    pub fn drift(&self, temperature: f64) -> Vector3<f64> {
        let change = self.change(temperature);
        Vector3::from(self.linear.bias_slope) * change + self.bias_quadratic * (change * change)
    }

    /// The triad's bias and factor at a temperature, °C.
    pub fn at(&self, triad: &Triad<f64>, temperature: f64) -> Warmth<f64> {
        let Warmth { bias, factor } = self.linear.at(triad, temperature);
        let change = self.change(temperature);
        let square = change * change;
        Warmth { bias: bias + self.bias_quadratic * square, factor: factor + self.scale_quadratic * square }
    }

    /// As [`TemperatureTerms`] has it: a temperature that is not measured counts as the reference.
    fn change(&self, temperature: f64) -> f64 {
        if temperature.is_finite() { temperature - self.linear.reference } else { 0.0 }
    }

    /// G⁻¹ F G: what the sensed value is multiplied by; the identity where the gain is singular.
    pub fn stretch(&self, gain: &Matrix3<f64>, temperature: f64) -> Matrix3<f64> {
        let factor = self.at(&Triad { gain: *gain, bias: Vector3::zeros() }, temperature).factor;
        gain.try_inverse()
            .map_or_else(Matrix3::identity, |inverse| inverse * Matrix3::from_diagonal(&factor) * gain)
    }

    /// A raw value of a temperature, °C, as it would be at the reference.
    pub fn reduced(&self, triad: &Triad<f64>, raw: &Vector3<f64>, temperature: f64) -> Vector3<f64> {
        let bias = self.at(triad, temperature).bias;
        self.stretch(&triad.gain, temperature) * (raw - bias) + triad.bias
    }
}

/// A triad and what warmth makes of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WarmTriad {
    /// At the reference temperature, nominal SI.
    pub triad: Triad<f64>,
    /// Its terms, where there are some.
    pub terms: Option<Terms>,
}

impl WarmTriad {
    /// A raw value as it would be at the reference temperature; as it is where there are no terms.
    pub fn reduced(&self, raw: &Vector3<f64>, temperature: f64) -> Vector3<f64> {
        self.terms.map_or(*raw, |terms| terms.reduced(&self.triad, raw, temperature))
    }

    /// Calibrated value of a raw one of a temperature, °C.
    pub fn correct(&self, raw: &Vector3<f64>, temperature: f64) -> Vector3<f64> {
        self.triad.correct(&self.reduced(raw, temperature))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reduced_value_is_corrected_without_a_thermometer_to_what_the_terms_make_of_the_raw_one() {
        let triad = Triad {
            gain: Matrix3::new(1.02, 0.01, -0.02, 0.03, 0.98, 0.015, 0.0, -0.01, 1.01),
            bias: Vector3::new(0.2, -0.1, 0.3),
        };
        let terms = Terms {
            linear: TemperatureTerms {
                reference: 25.0,
                bias_slope: [4e-3, 0.0, 1e-3],
                scale_slope: [2e-4; 3],
            },
            bias_quadratic: Vector3::new(0.0, 1e-5, 0.0),
            scale_quadratic: Vector3::new(0.0, 0.0, 1e-6),
        };
        let raw = Vector3::new(1.0, -9.0, 3.0);
        let at = terms.at(&triad, 60.0).correct(&triad, &raw);
        assert!((triad.correct(&terms.reduced(&triad, &raw, 60.0)) - at).norm() < 1e-12);
        assert_eq!(
            terms.reduced(&triad, &raw, 25.0).map(|x| (x * 1e9).round()),
            raw.map(|x| (x * 1e9).round())
        );
    }
}

//! Quadratic, cubic and cross terms of a triad as a fit found them, in the form that a record holds.
//!
//! ```text
//! m − b = y + n(y),   y = K v            imucal_core::nonlinearity, model::unified
//! raw = p m + offset:   q → q/p,  c → c/p²,  P → P/p,  range → |p| range
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | y | what each axis senses, nominal SI, sensor axes, without bias |
//! | n | the terms: quadratic q, cubic c, products of two axes P |
//! | p | raw units per nominal SI unit |
//!
//! The polynomial is that of the record, so that nothing is fitted again and nothing is approximated. A term that the
//! poses do not determine is zero, and so is its standard error. Not modelled: what the terms do beyond the largest
//! value seen, where the record holds them at their value there.

use imucal_core::{
    accept::{Limits, Quantity, Refusal},
    model::{rig::Pose, unified::UnifiedParameters},
    nonlinearity::{Linearizer, NonlinearTerms, Nonlinearity, STEEPEST},
};
use nalgebra::Vector3;

use super::fit::rig_fit::RigFit;
use crate::observe::pose::Poses;

/// First entries of the unified model's quadratic, cubic and cross terms, with the name of each kind.
const KINDS: [(&str, u8); 3] = [("quadratic", 23), ("cubic", 26), ("cross-axis", 29)];

/// Nonlinear terms, their standard errors, and where they hold.
#[derive(Clone, Debug)]
pub struct NonlinearFinding {
    /// The coefficients, 1/SI and 1/SI².
    pub terms: NonlinearTerms<f64>,
    /// Their standard errors; zero for one that is not estimated.
    pub std: NonlinearTerms<f64>,
    /// Largest |y| of an axis at any pose, SI.
    pub range: f64,
    /// Most that the terms change a calibrated vector at a pose, calibrated unit.
    pub largest: f64,
}

impl NonlinearFinding {
    /// What a fit found; `None` where it estimates no such term, or K has no inverse.
    pub fn of(fit: &RigFit, poses: &Poses) -> Option<Self> {
        let any = KINDS.iter().any(|(_, from)| fit.entries.contains(from));
        let now = &fit.parameters;
        let gain = now.sensitivity.try_inverse().filter(|_| any)?;
        let none = Vector3::zeros();
        let linear = UnifiedParameters { quadratic: none, cubic: none, cross_product: none, ..*now };
        let (mut range, mut largest) = (0.0f64, 0.0f64);
        for pose in &poses.poses {
            let at = pose.rotations(&poses.axes);
            let sensed = linear.predict(&at);
            range = range.max((sensed - now.bias).amax());
            largest = largest.max((gain * (now.predict(&at) - sensed)).norm());
        }
        let std = |from: u8| Vector3::from_fn(|k, _| fit.std(from + k as u8).unwrap_or(0.0));
        Some(Self {
            terms: terms([now.quadratic, now.cubic, now.cross_product]),
            std: terms(KINDS.map(|(_, from)| std(from))),
            range,
            largest,
        })
    }

    /// Each kind that is estimated: name, one coefficient an axis, and its standard errors.
    pub fn by_kind(&self) -> impl Iterator<Item = (&'static str, Vector3<f64>, Vector3<f64>)> {
        let value = coefficients(&self.terms);
        KINDS
            .iter()
            .zip(value)
            .zip(coefficients(&self.std))
            .filter_map(|(((name, _), value), std)| (std.amax() > 0.0).then_some((*name, value, std)))
    }

    /// The same of raw values, of which `per_unit` make one nominal SI unit. `largest` is of calibrated values, and stays.
    pub fn in_unit(&self, per_unit: f64) -> Self {
        let scaled = |terms: &NonlinearTerms<f64>, per: f64| NonlinearTerms {
            quadratic: terms.quadratic.map(|q| q / per),
            cubic: terms.cubic.map(|c| c / (per * per)),
            cross: terms.cross.map(|row| row.map(|p| p / per)),
        };
        Self {
            terms: scaled(&self.terms, per_unit),
            std: scaled(&self.std, per_unit.abs()),
            range: self.range * per_unit.abs(),
            ..self.clone()
        }
    }

    /// A device can undo the terms, and they are known well enough to be worth it.
    ///
    /// # Errors
    /// implausible, with the slope; ill-conditioned, with the error of a calibrated vector.
    pub fn check(&self, limits: &Limits) -> Result<(), Refusal> {
        let steep = Linearizer::new(Nonlinearity { terms: self.terms, range: self.range });
        if let Err(steep) = steep {
            let value = steep.slope.into();
            return Err(Refusal::Implausible { what: Quantity::Slope, value, limit: STEEPEST });
        }
        // The slope of the terms' errors bounds twice the error of a value, as a share of it.
        let error = self.std.slope(self.range) / 2.0;
        if error.is_nan() || error > limits.error {
            return Err(Refusal::Imprecise { error, limit: limits.error });
        }
        Ok(())
    }
}

/// By kind; of the products each axis has the one of the two others.
fn terms([quadratic, cubic, product]: [Vector3<f64>; 3]) -> NonlinearTerms<f64> {
    let (x, y, z) = (product.x, product.y, product.z);
    NonlinearTerms {
        quadratic: quadratic.into(),
        cubic: cubic.into(),
        cross: [[0.0, x, 0.0], [0.0, 0.0, y], [z, 0.0, 0.0]],
    }
}

/// The inverse of [`terms`].
fn coefficients(terms: &NonlinearTerms<f64>) -> [Vector3<f64>; 3] {
    let [[_, x, _], [_, _, y], [z, _, _]] = terms.cross;
    [terms.quadratic.into(), terms.cubic.into(), Vector3::new(x, y, z)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found() -> NonlinearFinding {
        let none = Vector3::zeros();
        let (quadratic, cubic) = (Vector3::new(1e-4, -2e-4, 3e-4), Vector3::new(1e-5, 2e-5, -1e-5));
        NonlinearFinding {
            terms: terms([quadratic, cubic, Vector3::new(4e-4, 5e-4, -6e-4)]),
            std: terms([quadratic.abs() / 50.0, cubic.abs() / 50.0, none]),
            range: 9.8,
            largest: 0.04,
        }
    }

    #[test]
    fn in_another_unit_the_same_reading_is_undone_to_the_same_value() {
        let (own, sensed) = (found(), Vector3::new(3.0, -7.0, 5.0));
        let nonlinearity = |of: &NonlinearFinding| Nonlinearity { terms: of.terms, range: of.range };
        let output = nonlinearity(&own).respond(&sensed);
        for per_unit in [612.0, -0.37] {
            let linearizer = Linearizer::new(nonlinearity(&own.in_unit(per_unit))).expect("gentle terms");
            let back = linearizer.sense(&(output * per_unit)) / per_unit;
            assert!((back - sensed).amax() < 1e-6, "{per_unit}: {back}");
        }
    }

    #[test]
    fn only_kinds_that_were_estimated_are_listed() {
        let names: Vec<_> = found().by_kind().map(|(name, ..)| name).collect();
        assert_eq!(names, ["quadratic", "cubic"]);
    }

    #[test]
    fn terms_that_are_too_steep_or_hardly_known_are_refused_with_the_figure() {
        let limits = Limits::for_norm(12, 6);
        assert_eq!(found().check(&limits), Ok(()));
        let steep = NonlinearFinding { range: 200.0, ..found() };
        let refusal = steep.check(&limits).expect_err("steep");
        assert!(
            matches!(refusal, Refusal::Implausible { what: Quantity::Slope, value, .. } if value > STEEPEST)
        );
        let std = terms([Vector3::repeat(0.01), Vector3::zeros(), Vector3::zeros()]);
        let refusal = NonlinearFinding { std, ..found() }.check(&limits).expect_err("hardly known");
        assert!(
            matches!(refusal, Refusal::Imprecise { error, .. } if (error - 0.098).abs() < 1e-9),
            "{refusal}"
        );
    }
}

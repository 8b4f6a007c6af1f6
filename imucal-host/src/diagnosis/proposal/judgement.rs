//! Formulas by their evidence, each with the sensor's noise estimated again with it.
//!
//! ```text
//! gain = ln p(y | formula) − ln p(y) − ln N      each with the noise that is likeliest with it
//! ```
//!
//! A drift that was estimated without a formula has taken a part of it up, and would let others seem as good.

use nalgebra::DMatrix;

use super::{
    entry,
    problem::{FormulaColumns, Problem, Weighed},
    term::Formulated,
};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        library::nonlinear::{self, Backdrop},
        mixed_model::{design::Design, noise::Noise},
        residual::base_run::Reference,
    },
    effect::Effect,
};

/// A formula that was judged with a noise of its own.
#[derive(Clone, Debug)]
pub struct Judged {
    /// The formula.
    pub formula: Formulated,
    /// Its columns.
    pub columns: FormulaColumns,
    /// The fit with it.
    pub weighed: Weighed,
    /// ln of the evidence that it adds, before the number of formulas that were tried is counted.
    pub gain: f64,
    /// Fitted amplitudes and their standard errors, term by term, axis by axis.
    pub amounts: Vec<(f64, f64)>,
    /// Whitened squared size of what it explains, less what noise would give.
    pub explained: f64,
}

/// Judges a formula on a residual; `before` is the fit without it. `None` where it has no value in the recording.
///
/// # Errors
///
/// [`DiagnosisError::Score`].
pub fn judged(
    problem: &Problem<'_, '_>,
    residual: &Design,
    before: &Weighed,
    formula: &Formulated,
    start: &Noise,
) -> Result<Option<Judged>, DiagnosisError> {
    let Some(columns) = problem.columns(formula, start) else { return Ok(None) };
    let weighed = problem.weighed(residual, &[&columns.signatures], start)?;
    let projected = problem.projected(&weighed.normal)?;
    let places: Vec<usize> = (0..columns.sizes.len()).collect();
    let Some((amplitudes, covariance)) = projected.estimate(&places) else { return Ok(None) };
    let error = |covariance: &DMatrix<f64>, at: usize| covariance[(at, at)].max(0.0).sqrt();
    let amount = |at: &usize| {
        let size = columns.sizes[*at];
        (size * amplitudes[*at], size * error(&covariance, *at))
    };
    Ok(Some(Judged {
        gain: weighed.log_evidence - before.log_evidence,
        amounts: places.iter().map(amount).collect(),
        explained: projected.explained(&places) - places.len() as f64,
        formula: formula.clone(),
        columns,
        weighed,
    }))
}

impl Judged {
    /// With the shape that is likeliest in its noise, and the standard error of that.
    ///
    /// # Errors
    ///
    /// [`DiagnosisError`], where no shape can be scored.
    pub fn refined(
        self,
        problem: &Problem<'_, '_>,
        reference: &Reference<'_>,
        before: &Weighed,
    ) -> Result<Self, DiagnosisError> {
        if self.formula.shape.is_none() {
            return Ok(self);
        }
        let text = entry::toml(problem.kind, &self.formula, &[0, 1, 2], &self.amounts, "");
        let [effect] = &entry::effects(&text)[..] else { return Ok(self) };
        let effect: &'static Effect = effect;
        let noise = &self.weighed.noise;
        let precisions = problem.linear.weighing.precisions(&problem.design, noise);
        let every: Vec<usize> = (0..problem.fitted.len()).collect();
        let backdrop = Backdrop::new(problem.linear.scene, &problem.design, &every, &precisions);
        let start = effect.neutral(problem.linear.scene.duration());
        let (values, errors) = nonlinear::refine(effect, &start, reference, &backdrop)?;
        let (Some(value), Some(error)) = (values.last(), errors.last()) else { return Ok(self) };
        let mut formula = self.formula.with_shape(*value);
        if let Some(shape) = &mut formula.shape {
            shape.std_error = Some(*error);
        }
        let refined = judged(problem, &problem.design, before, &formula, noise)?;
        Ok(refined.filter(|refined| refined.gain >= self.gain).unwrap_or(self))
    }

    /// Axes on which an amplitude is so many standard errors from zero.
    pub fn axes(&self, errors: f64) -> Vec<usize> {
        let is_far = |axis: &usize| {
            let of_axis = self.amounts.iter().skip(*axis).step_by(3);
            of_axis.clone().any(|(value, error)| *error > 0.0 && value.abs() >= errors * error)
        };
        (0..3).filter(is_far).collect()
    }

    /// Amplitudes and their standard errors on some axes, term by term.
    pub fn of_axes(&self, axes: &[usize]) -> Vec<(f64, f64)> {
        self.amounts.chunks(3).flat_map(|term| axes.iter().map(|axis| term[*axis])).collect()
    }
}

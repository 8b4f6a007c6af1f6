//! The problem about a fit that has a formula among its effects, with the formula taken out again.
//!
//! A fit without a formula has taken up in scale and misalignment what resembles them in a strong one, and what the axes sense,
//! of which the formula is a function, is wrong by as much. About this fit it is right to the first order.

use super::{entry, judgement::Judged};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        mixed_model::noise::Noise,
        search::{
            refit::{Fit, refit},
            stepwise::Solution,
        },
    },
    effect::Effect,
    recording::SensorKind,
    simulator::Dose,
};

/// An amplitude's error beyond which nothing is known of it, as a multiple of the largest amplitude that is known.
const LOOSE: f64 = 10.0;

/// The fit of the baseline, a set and a formula of a sensor, without the formula: its residual holds all that the formula says.
///
/// # Errors
///
/// [`DiagnosisError`], where it cannot be fitted.
pub fn without(
    explained: &Solution<'_>,
    set: &[&'static Effect],
    kind: SensorKind,
    best: &Judged,
) -> Result<Fit, DiagnosisError> {
    let sure = best.axes(explained.linear.scene.settings.proposal.kept_errors);
    let axes = known(&best.amounts, &sure);
    let text = entry::toml(kind, &best.formula, &axes, &best.of_axes(&axes), "");
    without_effects(explained, set, &entry::effects(&text), &best.weighed.noise)
}

/// Likewise, of a formula as effects with fitted values.
///
/// # Errors
///
/// As [`without`].
pub fn without_effects(
    explained: &Solution<'_>,
    set: &[&'static Effect],
    formula: &[&'static Effect],
    noise: &Noise,
) -> Result<Fit, DiagnosisError> {
    let (scene, candidates) = (explained.linear.scene, explained.linear.candidates);
    let is_kept = |dose: &&Dose| candidates.has_term(dose.effect) || set.contains(&dose.effect);
    let mut doses: Vec<Dose> = explained.fit.doses.iter().filter(is_kept).cloned().collect();
    doses.extend(formula.iter().filter_map(|effect| entry::fitted(effect)));
    let mut fit = refit(scene, Fit::of(scene, doses)?, Some(noise))?;
    fit.doses.retain(|dose| !formula.contains(&dose.effect));
    Fit::of(scene, fit.doses)
}

/// Axes of which something is known. One whose amplitude is lost in its error counts, since it may act by way of another axis:
/// a cube of z on y seems to be a misalignment, and is not where x is a cube of y. One that hardly varies, such as one along
/// gravity behind a soft limit, may take any amplitude, and does not count.
fn known(amounts: &[(f64, f64)], sure: &[usize]) -> Vec<usize> {
    let of_axis = |axis: &usize| amounts.iter().skip(*axis).step_by(3);
    let largest = sure.iter().flat_map(of_axis).fold(0.0f64, |most, (value, _)| most.max(value.abs()));
    (0..3).filter(|axis| of_axis(axis).all(|(_, error)| *error <= LOOSE * largest)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_amplitude_that_is_lost_in_its_error_counts_and_one_that_may_take_any_value_does_not() {
        // A cube of a field that hardly varies, and a hyperbolic tangent of gravity.
        let cube = [(-8.2e-6, 1.9e-7), (-3.0e-6, 1.0e-5), (-2.1e-6, 1.9e-7)];
        assert_eq!(known(&cube, &[0, 2]), [0, 1, 2]);
        let soft_limit = [(-0.13, 0.01), (-0.25, 0.01), (-5.1e4, 4.6e4)];
        assert_eq!(known(&soft_limit, &[0, 1]), [0, 1]);
        let sinusoid = [(0.2, 0.01), (0.0, 0.01), (0.0, 0.01), (0.1, 0.01), (0.0, 9.0), (0.0, 0.01)];
        assert_eq!(known(&sinusoid, &[0]), [0, 2]);
    }
}

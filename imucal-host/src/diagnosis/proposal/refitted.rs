//! The problem about a fit that has a formula among its effects, with the formula taken out again.
//!
//! A fit without a formula has taken up in scale and misalignment what resembles them in a strong one, and what the axes sense,
//! of which the formula is a function, is wrong by as much. About this fit it is right to the first order.

use super::{entry, judgement::Judged};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        search::{
            refit::{Fit, refit},
            stepwise::Solution,
        },
    },
    effect::Effect,
    recording::SensorKind,
    simulator::Dose,
};

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
    let (scene, candidates) = (explained.linear.scene, explained.linear.candidates);
    let is_kept = |dose: &&Dose| candidates.has_term(dose.effect) || set.contains(&dose.effect);
    let mut doses: Vec<Dose> = explained.fit.doses.iter().filter(is_kept).cloned().collect();
    let text = entry::toml(kind, &best.formula, &[0, 1, 2], &best.amounts, "");
    let formula: Vec<Dose> = entry::effects(&text).into_iter().filter_map(entry::fitted).collect();
    doses.extend(formula.iter().cloned());
    let mut fit = refit(scene, doses, Some(&best.weighed.noise))?;
    fit.doses.retain(|dose| formula.iter().all(|own| own.effect != dose.effect));
    fit.residual = scene.residual(&fit.doses)?;
    Ok(fit)
}

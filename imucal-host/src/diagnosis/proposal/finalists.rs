//! The formulas that a sensor's residual follows best, one after the other: screened, judged, their shapes refined.

use super::{
    equivalents,
    judgement::{self, Judged},
    problem::{Problem, Weighed},
    screening,
    term::Formulated,
};
use crate::diagnosis::{error::DiagnosisError, mixed_model::noise::Noise, residual::base_run::Reference};

/// Formulas that are judged, of those that a noise favours.
const JUDGED: usize = 5;
/// Of the judged ones, those whose shapes are refined.
const REFINED: usize = 5;

/// The simplest of the best formulas, and those that are the same.
#[derive(Clone, Debug)]
pub struct Finalist {
    /// The formula.
    pub best: Judged,
    /// Formulas that the recording cannot distinguish from it.
    pub equivalents: Vec<Judged>,
}

/// The best formula for a problem; `before` is the fit without it. `None` where none has a value.
///
/// # Errors
///
/// [`DiagnosisError`], where nothing can be scored.
pub fn best(
    problem: &Problem<'_, '_>,
    reference: &Reference<'_>,
    before: &Weighed,
    formulas: &[Formulated],
) -> Result<Option<Finalist>, DiagnosisError> {
    let noise = &before.noise;
    let mut chosen: Vec<usize> = Vec::new();
    // What hides in the drift shows in a quieter noise.
    for screened in screening::screen(problem, formulas, &[noise, &noise.quieter()], &[])? {
        let own = first(formulas, &screened.gains, JUDGED);
        let is_new = |at: &usize| !chosen.contains(at);
        let own: Vec<usize> = own.into_iter().filter(is_new).collect();
        chosen.extend(own);
    }
    let mut judged: Vec<Judged> = Vec::new();
    for at in chosen {
        judged.extend(judgement::judged(problem, &problem.design, before, &formulas[at], noise)?);
    }
    judged.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    // One of a kind: its shape is refined anyway.
    let mut names: Vec<String> = Vec::new();
    judged.retain(|own| {
        let is_new = !names.contains(&own.formula.name);
        names.push(own.formula.name.clone());
        is_new
    });
    let rest = judged.split_off(REFINED.min(judged.len()));
    let refined = judged.into_iter().map(|own| own.refined(problem, reference, before));
    let mut all = refined.collect::<Result<Vec<_>, _>>()?;
    all.extend(rest);
    let simplest = equivalents::simplest(problem, all)?;
    Ok(simplest.map(|(best, equivalents)| Finalist { best, equivalents }))
}

/// What the best of some formulas adds to a residual in a given noise, judged with a noise of its own.
///
/// # Errors
///
/// [`DiagnosisError`], where nothing can be scored.
pub fn next(
    problem: &Problem<'_, '_>,
    formulas: &[Formulated],
    noise: &Noise,
) -> Result<Option<Judged>, DiagnosisError> {
    let screened = screening::screen(problem, formulas, &[noise], &[])?;
    let before = problem.weighed(&problem.design, &[], noise)?;
    let best = screened.first().map(|screened| first(formulas, &screened.gains, 1));
    match best.as_deref() {
        Some([at]) => judgement::judged(problem, &problem.design, &before, &formulas[*at], noise),
        _ => Ok(None),
    }
}

/// The places of so many formulas that gain most, of those that differ in their shape alone the best.
fn first(formulas: &[Formulated], gains: &[f64], most: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..gains.len()).filter(|at| gains[*at].is_finite()).collect();
    order.sort_by(|a, b| gains[*b].total_cmp(&gains[*a]));
    let mut chosen: Vec<usize> = Vec::new();
    for at in order {
        if chosen.len() < most && chosen.iter().all(|other| formulas[*other].name != formulas[at].name) {
            chosen.push(at);
        }
    }
    chosen
}

//! Formulas that a recording cannot distinguish: they gain as much, and what they add is the same.

use super::{judgement::Judged, problem::Problem};
use crate::diagnosis::{
    error::DiagnosisError,
    mixed_model::{augmented_normal::AugmentedNormal, design::Signature},
};

/// A formula that gains so much less than the best may be it as well, ln of odds.
const NEAR: f64 = 5.0;
/// Correlation of what two formulas add, the baseline projected out, from which on they are the same.
pub const SAME: f64 = 0.95;

/// The simplest of the formulas that are the same as the best, and the others among them. `None` without one.
///
/// # Errors
///
/// [`DiagnosisError::Score`].
pub fn simplest(
    problem: &Problem<'_, '_>,
    mut judged: Vec<Judged>,
) -> Result<Option<(Judged, Vec<Judged>)>, DiagnosisError> {
    judged.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let Some(best) = judged.first().cloned() else { return Ok(None) };
    let mut same = Vec::new();
    for other in judged {
        let is_near = other.gain >= best.gain - NEAR && other.formula != best.formula;
        if is_near && correlation(problem, &best, &other)? > SAME {
            same.push(other);
        }
    }
    same.push(best);
    // Of equally simple ones that which gains most.
    same.sort_by(|a, b| a.formula.complexity.cmp(&b.formula.complexity).then(b.gain.total_cmp(&a.gain)));
    let simplest = same.remove(0);
    same.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    Ok(Some((simplest, same)))
}

/// Correlation of what two formulas add as they were fitted, in the noise of the first.
fn correlation(problem: &Problem<'_, '_>, one: &Judged, other: &Judged) -> Result<f64, DiagnosisError> {
    let precisions = problem.linear.weighing.precisions(&problem.design, &one.weighed.noise);
    let every: Vec<usize> = (0..problem.fitted.len()).collect();
    let augmented = AugmentedNormal::new(&problem.design, &precisions, &every);
    let all: Vec<Signature> =
        one.columns.signatures.iter().chain(&other.columns.signatures).cloned().collect();
    let projected = problem.projected(&augmented.with(&all))?;
    let first = one.columns.signatures.len();
    let amplitudes: Vec<f64> = [one, other].into_iter().flat_map(standardised).collect();
    let product = |rows: std::ops::Range<usize>, columns: std::ops::Range<usize>| -> f64 {
        let pairs = rows.flat_map(|row| columns.clone().map(move |column| (row, column)));
        pairs.map(|at| amplitudes[at.0] * projected.information[at] * amplitudes[at.1]).sum()
    };
    let count = amplitudes.len();
    let square = product(0..first, 0..first) * product(first..count, first..count);
    Ok(if square > 0.0 { product(0..first, first..count) / square.sqrt() } else { 0.0 })
}

/// Fitted amplitudes in multiples of the columns.
fn standardised(judged: &Judged) -> impl Iterator<Item = f64> {
    let pairs = judged.amounts.iter().zip(&judged.columns.sizes);
    pairs.map(|((amount, _), size)| if *size > 0.0 { amount / size } else { 0.0 })
}

//! Which formulas a sensor's residual may follow, by linear algebra in a given noise.

use std::ops::Range;

use nalgebra::{DVector, Vector3};
use rayon::prelude::*;

use super::{
    problem::{Factors, FormulaColumns, Problem},
    term::Formulated,
};
use crate::diagnosis::{
    error::DiagnosisError,
    location::score_test::RETAINED,
    mixed_model::{
        augmented_normal::AugmentedNormal,
        design::{Normal, Signature},
        noise::Noise,
    },
    residual::block::Means,
};
use crate::noise::precision::ChannelPrecision;

/// Formulas that are multiplied out at once.
const BATCH: usize = 10;

/// What each formula adds, ln of evidence; `-∞` where the recording cannot show it.
#[derive(Clone, Debug)]
pub struct Screening {
    /// To the residual.
    pub gains: Vec<f64>,
    /// To each of the further residuals.
    pub of_further: Vec<Vec<f64>>,
}

/// Screens formulas on a sensor's residual, and on further residuals that it might have had, in each of some noises; by what the
/// formulas multiply at a few nodes a block.
///
/// # Errors
///
/// [`DiagnosisError::Score`].
pub fn screen(
    problem: &Problem<'_, '_>,
    formulas: &[Formulated],
    noises: &[&Noise],
    further: &[Vec<Vector3<f64>>],
) -> Result<Vec<Screening>, DiagnosisError> {
    let first = problem.fitted.len();
    let kept: Vec<usize> = (0..first).collect();
    // A further residual is one column more: its scores are its products with the formulas.
    let residuals: Vec<Signature> = further.iter().map(|residual| signature(problem, residual)).collect();
    let design = problem.design.extended(&kept, Vec::new(), &residuals);
    let every: Vec<usize> = (0..design.size).collect();
    let precisions: Vec<Vec<ChannelPrecision>> =
        noises.iter().map(|noise| problem.linear.weighing.precisions(&design, noise)).collect();
    let augmented: Vec<AugmentedNormal<'_>> =
        precisions.iter().map(|precisions| AugmentedNormal::new(&design, precisions, &every)).collect();
    let none = Screening { gains: Vec::new(), of_further: vec![Vec::new(); further.len()] };
    let mut screenings = vec![none; noises.len()];
    for batch in formulas.chunks(BATCH) {
        let factors: Vec<Option<Factors>> =
            batch.par_iter().map(|formula| problem.sparse_factors(formula)).collect();
        for ((noise, augmented), screening) in noises.iter().zip(&augmented).zip(&mut screenings) {
            let columns: Vec<Option<FormulaColumns>> =
                factors.iter().map(|factors| Some(problem.scaled(factors.as_ref()?, noise))).collect();
            let signatures: Vec<Signature> =
                columns.iter().flatten().flat_map(|columns| columns.signatures.iter().cloned()).collect();
            let (normal, places) = (augmented.with(&signatures), places(&columns));
            screening.gains.extend(gains(problem, &without(&normal, first, further.len(), None), &places)?);
            for (at, own) in screening.of_further.iter_mut().enumerate() {
                let normal = without(&normal, first, further.len(), Some(at));
                own.extend(gains(problem, &normal, &places)?);
            }
        }
    }
    Ok(screenings)
}

/// Places of each formula's columns among those of a batch.
fn places(columns: &[Option<FormulaColumns>]) -> Vec<Option<Range<usize>>> {
    let mut from = 0;
    let of = |columns: &Option<FormulaColumns>| {
        let count = columns.as_ref()?.signatures.len();
        from += count;
        Some(from - count..from)
    };
    columns.iter().map(of).collect()
}

fn signature(problem: &Problem<'_, '_>, residual: &[Vector3<f64>]) -> Signature {
    let mut means: Means = Default::default();
    means[problem.kind as usize] = Some(residual.to_vec());
    means.into()
}

/// Normal equations without the columns of further residuals, of which one takes the residual's place.
fn without(normal: &Normal, first: usize, further: usize, residual: Option<usize>) -> Normal {
    let kept: Vec<usize> = (0..first).chain(first + further..normal.score.len()).collect();
    let score = |at: &usize| match residual {
        Some(residual) => normal.information[(*at, first + residual)],
        None => normal.score[*at],
    };
    Normal {
        information: normal.information.select_rows(&kept).select_columns(&kept),
        score: DVector::from_iterator(kept.len(), kept.iter().map(score)),
        ..normal.clone()
    }
}

fn gains(
    problem: &Problem<'_, '_>,
    normal: &Normal,
    places: &[Option<Range<usize>>],
) -> Result<Vec<f64>, DiagnosisError> {
    let projected = problem.projected(normal)?;
    let gain = |places: &Option<Range<usize>>| {
        let shown = |place: &usize| {
            let (left, before) = (projected.information[(*place, *place)], projected.before[*place]);
            left > RETAINED * before && before > 0.0
        };
        let shown: Vec<usize> = places.clone().into_iter().flatten().filter(shown).collect();
        if shown.is_empty() { f64::NEG_INFINITY } else { projected.log_bayes_factor(&[&shown]) }
    };
    Ok(places.iter().map(gain).collect())
}

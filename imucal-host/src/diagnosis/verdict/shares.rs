//! How large the gap is, and how far it shrinks on data that the fit has not seen.
//!
//! Blocks are dealt to folds in stretches. For each fold, baseline and effects are fitted to the others, and
//!
//! ```text
//! closed      = Σ_folds E(baseline) − E(baseline and effects)      E: whitened energy of the fold's residual
//! explainable = closed + what the fits' own errors cost + what a driver still follows
//! φ           = closed / explainable
//! ```
//!
//! A difference of energies needs no noise floor, so that white noise known to a few per cent does no harm. The
//! interval is that of a jackknife over the folds, widened by what no test would have seen: below it stands the share
//! that would be closed if the gap held an effect more that just escapes the search. Its size follows from the
//! size of what is closed in the whole recording, since drift that ties one fold to the next makes a slow effect seem
//! larger in each.

use nalgebra::{DMatrix, DVector};

use crate::{
    diagnosis::{
        error::DiagnosisError,
        finding::Gap,
        library::evidence::Projected,
        mixed_model::{
            design::{Channel, Design, LOOSE, Normal},
            noise::Noise,
        },
        search::linearisation::Linearisation,
    },
    effect::{Effect, si},
    recording::SensorKind,
};

/// Folds.
pub const FOLDS: usize = 8;
/// Standard deviation of an effect's prior, in usual sizes: an amplitude that few blocks determine must stay bounded on the others.
const LARGE: f64 = 30.0;
/// Standard deviation of a driver's statistic where there is nothing to follow: √(2·18).
const SCATTER: f64 = 6.0;
/// What follows a driver equals what is left to within this share of it: it is another function than the one that is there.
const VAGUE: f64 = 0.15;

/// A share of the explainable gap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Share {
    /// φ.
    pub value: f64,
    /// 95 % interval, within 0 and 1.
    pub interval: [f64; 2],
}

impl Share {
    /// With the values that are `left` when one fold is left out, a further variance, and the whitened squared sizes of the
    /// gap and of an effect that the search may miss.
    pub fn new(value: f64, left: &[f64], further: f64, whole: f64, unseen: f64) -> Self {
        let n = left.len() as f64;
        let mean = left.iter().sum::<f64>() / n;
        let variance = (n - 1.0) / n * left.iter().map(|l| (l - mean).powi(2)).sum::<f64>();
        let wide = 1.96 * (variance + further).sqrt();
        // Where all that is explainable lies in one fold, the others say nothing.
        let wide = if wide.is_finite() { wide } else { 1.0 };
        let bound = |x: f64| x.clamp(0.0, 1.0);
        let least = bound(value - wide) * whole / (whole + unseen);
        Self { value: bound(value), interval: [least, bound(value + wide)] }
    }
}

/// What was closed on held-out blocks.
#[derive(Clone, Debug)]
pub struct Closed {
    /// By all effects.
    pub total: Share,
    /// By each effect, the others being there.
    pub each: Vec<Share>,
    /// Whitened squared size of the explainable gap.
    pub explainable: f64,
}

/// Shares that a set closes; `remainder` is the whitened size of what a driver still follows.
pub fn closed(
    linear: &Linearisation<'_>,
    set: &[&'static Effect],
    noise: &Noise,
    remainder: f64,
) -> Result<Closed, DiagnosisError> {
    let folds = folds(linear, &linear.design, noise, &linear.fitted(set));
    closed_in(linear, Folds { fitted: &folds, judged: &folds }, set, noise, remainder)
}

/// Share that each effect closes of what its own sensors show: compared with a quiet sensor's gap that of another looks small.
/// All sensors are fitted, since a clock that they share is not known from one of them.
pub fn closed_of_own(
    linear: &Linearisation<'_>,
    set: &[&'static Effect],
    noise: &Noise,
) -> Result<Vec<Share>, DiagnosisError> {
    let fitted = linear.fitted(set);
    let all = folds(linear, &linear.design, noise, &fitted);
    let of = |(k, effect): (usize, &&'static Effect)| {
        let mut design = linear.design.clone();
        design.channels.retain(|channel| linear.scene.reach(effect).contains(&channel.kind));
        let own = folds(linear, &design, noise, &fitted);
        Ok(closed_in(linear, Folds { fitted: &all, judged: &own }, set, noise, 0.0)?.each[k])
    };
    set.iter().enumerate().map(of).collect()
}

/// Shares of what one sensor shows that a set closes; `remainder` is the whitened size of what its residual still follows.
pub fn closed_of_sensor(
    linear: &Linearisation<'_>,
    kind: SensorKind,
    set: &[&'static Effect],
    noise: &Noise,
    remainder: f64,
) -> Result<Closed, DiagnosisError> {
    let fitted = linear.fitted(set);
    let all = folds(linear, &linear.design, noise, &fitted);
    let own = folds(linear, &of_sensor(linear, kind), noise, &fitted);
    closed_in(linear, Folds { fitted: &all, judged: &own }, set, noise, remainder)
}

/// The channels of one sensor.
fn of_sensor(linear: &Linearisation<'_>, kind: SensorKind) -> Design {
    let mut design = linear.design.clone();
    design.channels.retain(|channel| channel.kind == kind);
    design
}

/// Normal equations of each fold: those that are fitted, and those of the channels on which the fit is judged.
#[derive(Clone, Copy)]
struct Folds<'f> {
    fitted: &'f [Normal],
    judged: &'f [Normal],
}

fn closed_in(
    linear: &Linearisation<'_>,
    folds: Folds<'_>,
    set: &[&'static Effect],
    noise: &Noise,
    remainder: f64,
) -> Result<Closed, DiagnosisError> {
    let by = &linear.scene.settings.verdict;
    let fitted = linear.fitted(set);
    let baseline = linear.baseline.len();
    let without = |left_out: Option<usize>| -> Vec<usize> {
        (0..fitted.len())
            .filter(|at| {
                let column = linear.design.columns[fitted[*at]];
                *at < baseline || left_out.is_none_or(|k| !column.is_of(set[k]))
            })
            .collect()
    };
    let before = held_out(folds, &(0..baseline).collect::<Vec<_>>(), baseline)?;
    let after = held_out(folds, &without(None), baseline)?;
    let gain = |after: &[Fold]| -> Vec<f64> {
        before.iter().zip(after).map(|(before, after)| before.energy - after.energy).collect()
    };
    let costs: f64 = before.iter().zip(&after).map(|(before, after)| after.cost - before.cost).sum();
    let closed = gain(&after);
    let explainable = (closed.iter().sum::<f64>() + costs + remainder).max(f64::MIN_POSITIVE);
    let whole = (size(linear, set, noise)? + remainder).clamp(1.0, explainable.max(1.0));
    let share = |gains: &[f64]| {
        let value = gains.iter().sum::<f64>() / explainable;
        let n = FOLDS as f64;
        // Of the ratio, leaving one fold out of both sums.
        let left: Vec<f64> = (0..FOLDS)
            .map(|fold| {
                let rest = |gains: &[f64]| gains.iter().sum::<f64>() - gains[fold];
                rest(gains) / (rest(&closed) + (costs + remainder) * (n - 1.0) / n).max(f64::MIN_POSITIVE)
            })
            .collect();
        let vague = VAGUE * remainder / explainable;
        Share::new(value, &left, (SCATTER / whole).powi(2) + vague * vague, whole, by.unseen)
    };
    let total = share(&closed);
    let mut each = Vec::new();
    for k in 0..set.len() {
        let rest = held_out(folds, &without(Some(k)), baseline)?;
        let gains: Vec<f64> =
            rest.iter().zip(&after).map(|(rest, after)| rest.energy - after.energy).collect();
        each.push(share(&gains));
    }
    Ok(Closed { total, each, explainable })
}

/// Share of what a sensor shows beyond the baseline that a prediction closes which was made without this recording;
/// `predicted` is the problem less the prediction, `remainder` the whitened size of what it leaves.
///
/// # Errors
///
/// [`DiagnosisError::CrossValidation`].
pub fn closed_by_prediction(
    linear: &Linearisation<'_>,
    predicted: &Linearisation<'_>,
    kind: SensorKind,
    noise: &Noise,
    remainder: f64,
) -> Result<Share, DiagnosisError> {
    let places: Vec<usize> = (0..linear.baseline.len()).collect();
    let left = |linear: &Linearisation<'_>| {
        let fitted = folds(linear, &linear.design, noise, &linear.baseline);
        let judged = folds(linear, &of_sensor(linear, kind), noise, &linear.baseline);
        held_out(Folds { fitted: &fitted, judged: &judged }, &places, places.len())
    };
    let (before, after) = (left(linear)?, left(predicted)?);
    let closed: Vec<f64> = before.iter().zip(&after).map(|(b, a)| b.energy - a.energy).collect();
    let whole = closed.iter().sum::<f64>();
    let share = |closed: f64, part: f64| closed / (closed + part * remainder).max(f64::MIN_POSITIVE);
    let without = (FOLDS as f64 - 1.0) / FOLDS as f64;
    let each: Vec<f64> = closed.iter().map(|fold| share(whole - fold, without)).collect();
    let explainable = (whole + remainder).max(1.0);
    let further = (SCATTER / explainable).powi(2) + (VAGUE * remainder / explainable).powi(2);
    Ok(Share::new(share(whole, 1.0), &each, further, explainable, linear.scene.settings.verdict.unseen))
}

/// Normal equations of some columns, of each fold's blocks alone.
fn folds(linear: &Linearisation<'_>, design: &Design, noise: &Noise, fitted: &[usize]) -> Vec<Normal> {
    let stretch = linear.scene.settings.verdict.fold_stretch;
    let normal = |fold: usize| {
        let time = |block: usize| linear.scene.blocks[block].time / stretch;
        // A row that holds no samples is a convention, and belongs to every fold.
        let empty = |block: usize| linear.scene.blocks[block].rows.is_empty();
        let inside = |block: usize| empty(block) || time(block) as usize % FOLDS == fold;
        design.normal(&linear.weighing.precisions_within(design, noise, &inside), fitted)
    };
    (0..FOLDS).map(normal).collect()
}

/// Whitened squared size of what a set explains beyond the baseline, less what noise alone would give.
pub fn size(
    linear: &Linearisation<'_>,
    set: &[&'static Effect],
    noise: &Noise,
) -> Result<f64, DiagnosisError> {
    let fitted = linear.fitted(set);
    let normal = linear.design.normal(&linear.precisions(noise), &fitted);
    let every: Vec<usize> = (0..fitted.len()).collect();
    let (baseline, own) = every.split_at(linear.baseline.len());
    let projected = Projected::new(&normal, baseline, own)?;
    let places: Vec<usize> = (0..own.len()).collect();
    Ok((projected.explained(&places) - own.len() as f64).max(0.0))
}

/// A fold that was not fitted.
struct Fold {
    /// Whitened energy of its residual.
    energy: f64,
    /// What of that the fit's own errors cost on average.
    cost: f64,
}

/// Each fold's residual after a fit of columns to the others; the first `baseline` columns are the baseline's.
fn held_out(folds: Folds<'_>, places: &[usize], baseline: usize) -> Result<Vec<Fold>, DiagnosisError> {
    let part = |normal: &Normal| {
        let n = places.len();
        let g = DMatrix::from_fn(n, n, |i, j| normal.information[(places[i], places[j])]);
        (g, DVector::from_fn(n, |i, _| normal.score[places[i]]))
    };
    let parts: Vec<(DMatrix<f64>, DVector<f64>)> = folds.fitted.iter().map(part).collect();
    let n = places.len();
    let precision = |place: &usize| if *place < baseline { LOOSE.powi(-2) } else { LARGE.powi(-2) };
    let loose = DMatrix::from_diagonal(&DVector::from_iterator(n, places.iter().map(precision)));
    folds
        .judged
        .iter()
        .enumerate()
        .map(|(fold, judged)| {
            let mut information = loose.clone();
            let mut score = DVector::zeros(n);
            for (_, (g, z)) in parts.iter().enumerate().filter(|(other, _)| *other != fold) {
                information += g;
                score += z;
            }
            let factor =
                information.cholesky().ok_or(DiagnosisError::CrossValidation { fold, columns: n })?;
            let fitted = factor.solve(&score);
            let (g, z) = part(judged);
            Ok(Fold {
                energy: judged.energy - 2.0 * fitted.dot(&z) + fitted.dot(&(&g * &fitted)),
                cost: factor.solve(&g).trace(),
            })
        })
        .collect()
}

/// A channel's block means, before and after a set is fitted with the baseline.
pub struct Left {
    /// What the baseline leaves.
    pub before: DVector<f64>,
    /// What baseline and set leave.
    pub after: DVector<f64>,
}

/// What is left of each channel, in the design's order.
pub fn left(
    linear: &Linearisation<'_>,
    set: &[&'static Effect],
    noise: &Noise,
) -> Result<Vec<Left>, DiagnosisError> {
    let precisions = linear.precisions(noise);
    let solve = |fitted: &[usize]| {
        let amounts = linear.design.normal(&precisions, fitted).amounts();
        amounts.ok_or(DiagnosisError::Score { columns: fitted.len() })
    };
    let all = linear.fitted(set);
    let (before, after) = (solve(&linear.baseline)?, solve(&all)?);
    let of = |channel: &Channel| Left {
        before: channel.less(&linear.baseline, &before),
        after: channel.less(&all, &after),
    };
    Ok(linear.design.channels.iter().map(of).collect())
}

/// Root mean squares of each channel's block means, before and after, and what noise alone would leave.
pub fn table(
    linear: &Linearisation<'_>,
    set: &[&'static Effect],
    noise: &Noise,
) -> Result<Vec<Gap>, DiagnosisError> {
    let left = left(linear, set, noise)?;
    let gaps = linear.design.channels.iter().zip(&left).map(|(channel, left)| {
        let counts = &linear.scene.counts[channel.kind as usize];
        let rms = |residual: &DVector<f64>| weighted(counts, |block| residual[block] * residual[block]);
        Gap {
            sensor: channel.kind.prefix().to_owned(),
            axis: linear.scene.axis(channel.kind, channel.axis).to_owned(),
            unit: si(channel.kind),
            rms_before: rms(&left.before),
            rms_after: rms(&left.after),
            noise_floor: weighted(counts, |block| linear.weighing.variance(channel, noise, block)),
        }
    });
    Ok(gaps.collect())
}

fn weighted(counts: &[usize], square: impl Fn(usize) -> f64) -> f64 {
    let (sum, count) = counts
        .iter()
        .enumerate()
        .filter(|(_, count)| **count > 0)
        .fold((0.0, 0.0), |(s, n), (block, count)| (s + *count as f64 * square(block), n + *count as f64));
    (sum / count.max(1.0)).sqrt()
}

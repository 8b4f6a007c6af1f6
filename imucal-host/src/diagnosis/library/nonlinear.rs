//! Where to look for effects whose signature has a shape: time constants, instants, arms.
//!
//! A menu of shapes for each, the best by evidence, and from there a search by halved steps.

use crate::noise::precision::ChannelPrecision;
use rayon::prelude::*;

use super::{
    evidence::Projected,
    grid_posterior::{GridPosterior, Scanned},
};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        mixed_model::{
            augmented_normal::AugmentedNormal,
            design::{Design, Signature},
        },
        residual::{base_run::Reference, forward_model::ForwardModel},
    },
    effect::{Act, Effect, Parameter, Role},
};

/// About the best instants, a menu this many times as dense.
const CLOSER: i32 = 8;
/// Factors of a usual duration that are scanned with an instant; about the best of those, further ones, two of which
/// are as far apart.
const BROAD: [f64; 2] = [0.7, 2.0];
const DURATIONS: [f64; 3] = [0.6, 1.0, 1.7];
const DENSER: f64 = 2.0;
/// A duration is between a usual one divided by this and times it two times of three.
const WITHIN: f64 = 2.0;
/// Values of a formula's shape are so far apart, as a factor, and at most so many.
const FACTOR: f64 = 2.0;
const MOST_STEPS: f64 = 8.0;
/// Signatures judged at once.
const BATCH: usize = 12;

/// What a shape is judged against: the columns fitted in any case, and the noise.
pub struct Backdrop<'a> {
    /// The recording's scene.
    pub scene: &'a ForwardModel<'a>,
    /// Number of those columns.
    fitted: usize,
    augmented: AugmentedNormal<'a>,
}

impl<'a> Backdrop<'a> {
    /// Of columns of a design, and the whitening of its channels.
    pub fn new(
        scene: &'a ForwardModel<'a>,
        design: &'a Design,
        fitted: &[usize],
        precisions: &'a [ChannelPrecision],
    ) -> Self {
        Self { scene, fitted: fitted.len(), augmented: AugmentedNormal::new(design, precisions, fitted) }
    }
}

/// The most evident shape of an effect. `None` where no shape can be judged.
pub fn best(
    effect: &'static Effect,
    reference: &Reference<'_>,
    backdrop: &Backdrop<'_>,
) -> Result<GridPosterior, DiagnosisError> {
    let (scene, none) = (backdrop.scene, || DiagnosisError::Grid { effect: &effect.id });
    if is_episode(effect) {
        return episode(effect, reference, backdrop);
    }
    let judged = |menu: Vec<Vec<f64>>| {
        let mut values = Vec::with_capacity(menu.len());
        for shapes in menu.chunks(BATCH) {
            values.extend(judge(effect, shapes, reference, backdrop)?);
        }
        let priors = menu.iter().map(|shape| prior(effect, shape)).collect();
        Ok::<_, DiagnosisError>(Scanned { shapes: menu, values, priors })
    };
    let whole = judged(menu(effect, scene))?;
    let (near, dense) = closer(effect, &whole.shapes[whole.best().ok_or_else(none)?], scene);
    let (values, spread) = whole.refined(&judged(near)?, dense).ok_or_else(none)?;
    Ok(GridPosterior { values, spread })
}

/// ln of a shape's prior, but for a constant: durations are lognormal, all else is as likely here as there, and so are
/// the shapes of a user's formula within their range.
fn prior(effect: &Effect, shape: &[f64]) -> f64 {
    if is_formula(effect) {
        return 0.0;
    }
    let durations = effect.parameters.iter().zip(shape).filter(|(parameter, _)| parameter.range.0 >= 0.0);
    let squares = durations.filter_map(|(parameter, value)| match parameter.role {
        Role::Shape { usual } => Some(((value / usual).ln() / WITHIN.ln()).powi(2)),
        _ => None,
    });
    -0.5 * squares.sum::<f64>()
}

/// Shapes about one of a menu, itself among them, and how many of them lie within a cell of the menu.
fn closer(effect: &Effect, about: &[f64], scene: &ForwardModel<'_>) -> (Vec<Vec<f64>>, f64) {
    let mut menu = vec![about.to_vec()];
    let mut dense = 1.0;
    if !is_timed(effect) {
        return (menu, dense);
    }
    for (at, parameter) in effect.parameters.iter().enumerate() {
        let (values, more): (Vec<f64>, f64) = match parameter.role {
            Role::Instant { .. } => (instants(about[at], scene), f64::from(CLOSER)),
            Role::Shape { .. } if parameter.range.0 >= 0.0 => {
                (DURATIONS.iter().map(|factor| about[at] * factor).collect(), DENSER)
            }
            _ => continue,
        };
        menu = vary(&menu, at, &values);
        dense *= more;
    }
    (menu, dense)
}

/// Instants about one of a menu, s.
fn instants(about: f64, scene: &ForwardModel<'_>) -> Vec<f64> {
    let step = grid(scene) / f64::from(CLOSER);
    let closer = (1 - CLOSER..CLOSER).map(|k| about + step * f64::from(k));
    closer.filter(|time| (0.0..scene.duration()).contains(time)).collect()
}

/// Distance of instants in a menu, s.
fn grid(scene: &ForwardModel<'_>) -> f64 {
    let (least, share) = scene.settings.library.grid;
    least.max(share * scene.duration())
}

fn is_formula(effect: &Effect) -> bool {
    matches!(effect.act, Act::Formula(..))
}

/// Values of a formula's shape over its range and its usual one: by factors where all are positive, else evenly.
fn over_range(parameter: &Parameter, usual: f64) -> Vec<f64> {
    let (low, high) = parameter.range;
    let mut values: Vec<f64> = if low > 0.0 {
        let steps = (libm::log(high / low) / libm::log(FACTOR)).ceil().clamp(2.0, MOST_STEPS);
        (0..=steps as usize).map(|k| low * libm::pow(high / low, k as f64 / steps)).collect()
    } else {
        (0..=MOST_STEPS as usize).map(|k| low + (high - low) * k as f64 / MOST_STEPS).collect()
    };
    values.push(usual);
    values.iter_mut().for_each(|value| *value = value.clamp(low, high));
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
}

/// A first step of the search for a better value of a shape.
fn stride(effect: &Effect, parameter: &Parameter, usual: f64, value: f64) -> f64 {
    match parameter.range {
        (low, high) if low < 0.0 && is_formula(effect) => 0.5 * (high - low) / MOST_STEPS,
        (low, _) => 0.5 * if low < 0.0 { usual.abs() } else { value.abs() },
    }
}

fn is_timed(effect: &Effect) -> bool {
    effect.parameters.iter().any(|p| matches!(p.role, Role::Instant { .. }))
}

/// It begins and ends.
pub fn is_episode(effect: &Effect) -> bool {
    effect.parameters.iter().filter(|p| matches!(p.role, Role::Instant { .. })).count() == 2
}

/// Number of shapes that an effect's grid holds: a choice among them that costs evidence.
pub fn choices(effect: &Effect, scene: &ForwardModel<'_>) -> usize {
    let single = menu(effect, scene).len();
    // Of two instants the second comes after the first.
    if is_episode(effect) { single / 2 } else { single }
}

/// ln BF of each shape.
pub fn judge(
    effect: &'static Effect,
    shapes: &[Vec<f64>],
    reference: &Reference<'_>,
    backdrop: &Backdrop<'_>,
) -> Result<Vec<f64>, DiagnosisError> {
    let (projected, each) = project(effect, shapes, reference, backdrop)?;
    Ok((0..shapes.len()).map(|k| projected.log_bayes_factor(&[&places(k, each)])).collect())
}

fn places(shape: usize, each: usize) -> Vec<usize> {
    (shape * each..(shape + 1) * each).collect()
}

fn project(
    effect: &'static Effect,
    shapes: &[Vec<f64>],
    reference: &Reference<'_>,
    backdrop: &Backdrop<'_>,
) -> Result<(Projected, usize), DiagnosisError> {
    let own: Vec<usize> = effect.amplitudes().collect();
    let asked: Vec<(&Vec<f64>, usize)> =
        shapes.iter().flat_map(|shape| own.iter().map(move |parameter| (shape, *parameter))).collect();
    let of = |(shape, parameter): &(&Vec<f64>, usize)| {
        Ok(Signature::from(reference.signature(effect, *parameter, shape)?))
    };
    let signatures: Vec<Signature> = asked.par_iter().map(of).collect::<Result<_, DiagnosisError>>()?;
    let normal = backdrop.augmented.with(&signatures);
    let first: Vec<usize> = (0..backdrop.fitted).collect();
    let others: Vec<usize> = (backdrop.fitted..normal.score.len()).collect();
    Ok((Projected::new(&normal, &first, &others)?, own.len()))
}

/// Shapes to try: positive ones by factors, others along their axes, instants along the recording.
fn menu(effect: &Effect, scene: &ForwardModel<'_>) -> Vec<Vec<f64>> {
    let duration = scene.duration();
    let mut menu = vec![effect.neutral(duration)];
    let either: Vec<usize> = (0..effect.parameters.len())
        .filter(|at| {
            let parameter = &effect.parameters[*at];
            matches!(parameter.role, Role::Shape { .. }) && parameter.range.0 < 0.0 && !is_formula(effect)
        })
        .collect();
    if !either.is_empty() {
        // An arm along each axis: its signature is linear in the arm, and the axes span all of them.
        menu = either
            .iter()
            .map(|at| {
                let mut shape = effect.neutral(duration);
                either.iter().filter(|other| *other != at).for_each(|other| shape[*other] = 0.0);
                shape
            })
            .collect();
    }
    for (at, parameter) in effect.parameters.iter().enumerate() {
        menu = match parameter.role {
            Role::Shape { usual } if is_formula(effect) => vary(&menu, at, &over_range(parameter, usual)),
            Role::Shape { usual } if parameter.range.0 >= 0.0 => {
                // What is placed in time as well is scanned broadly and refined afterwards.
                let factors: &[f64] = if is_timed(effect) { &BROAD } else { &[0.2, 0.5, 1.0, 2.0, 5.0] };
                let values: Vec<f64> = factors.iter().map(|factor| usual * factor).collect();
                vary(&menu, at, &values)
            }
            Role::Instant { .. } => {
                let step = grid(scene);
                let instants: Vec<f64> = (1..(duration / step) as usize).map(|k| step * k as f64).collect();
                vary(&menu, at, &instants)
            }
            _ => menu,
        };
    }
    menu
}

fn vary(menu: &[Vec<f64>], at: usize, values: &[f64]) -> Vec<Vec<f64>> {
    menu.iter()
        .flat_map(|shape| {
            values.iter().map(move |value| {
                let mut varied = shape.clone();
                varied[at] = *value;
                varied
            })
        })
        .collect()
}

/// An episode is what began less what began at its end: one signature for each instant serves all pairs. Looked for all
/// over the recording, and then closer about the best pair.
fn episode(
    effect: &'static Effect,
    reference: &Reference<'_>,
    backdrop: &Backdrop<'_>,
) -> Result<GridPosterior, DiagnosisError> {
    let (scene, duration) = (backdrop.scene, backdrop.scene.duration());
    let none = || DiagnosisError::Grid { effect: &effect.id };
    let step = grid(scene);
    let all: Vec<f64> = (1..(duration / step) as usize).map(|k| step * k as f64).collect();
    let whole = pairs(effect, reference, backdrop, &all, &all)?;
    let (start, end) = whole.shapes[whole.best().ok_or_else(none)?];
    let lasts = end.is_finite();
    let ends = if lasts { instants(end, scene) } else { Vec::new() };
    let near = pairs(effect, reference, backdrop, &instants(start, scene), &ends)?;
    let dense = f64::from(CLOSER).powi(if lasts { 2 } else { 1 });
    let ((start, end), spread) = whole.refined(&near.lasting(lasts), dense).ok_or_else(none)?;
    Ok(GridPosterior { values: placed(effect, duration, start, end), spread })
}

impl Scanned<(f64, f64)> {
    /// Those that end, or those that never do.
    fn lasting(self, ends: bool) -> Self {
        let is_asked = |((_, end), _): &((f64, f64), f64)| end.is_finite() == ends;
        let (shapes, values): (Vec<_>, Vec<_>) =
            self.shapes.into_iter().zip(self.values).filter(is_asked).unzip();
        Self { priors: vec![0.0; shapes.len()], shapes, values }
    }
}

/// Its parameters with these instants, s.
fn placed(effect: &Effect, duration: f64, start: f64, end: f64) -> Vec<f64> {
    let mut shape = effect.neutral(duration);
    let instants =
        shape.iter_mut().zip(&effect.parameters).filter(|(_, p)| matches!(p.role, Role::Instant { .. }));
    instants.zip([start, end]).for_each(|((value, _), instant)| *value = instant);
    shape
}

/// Each beginning with each end of those given that comes after it, and with none.
fn pairs(
    effect: &'static Effect,
    reference: &Reference<'_>,
    backdrop: &Backdrop<'_>,
    starts: &[f64],
    ends: &[f64],
) -> Result<Scanned<(f64, f64)>, DiagnosisError> {
    let mut times: Vec<f64> = starts.iter().chain(ends).copied().collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let shapes: Vec<Vec<f64>> =
        times.iter().map(|time| placed(effect, backdrop.scene.duration(), *time, f64::INFINITY)).collect();
    let (projected, each) = project(effect, &shapes, reference, backdrop)?;
    let own: Vec<usize> = (0..each).collect();
    let mut asked: Vec<(usize, Option<usize>)> = Vec::new();
    for (i, _) in times.iter().enumerate().filter(|(_, time)| starts.contains(time)) {
        let later = (i + 1..times.len()).filter(|j| ends.contains(&times[*j]));
        asked.extend(later.map(Some).chain([None]).map(|j| (i, j)));
    }
    let value = |(i, j): &(usize, Option<usize>)| {
        let end = j.map(|j| places(j, each));
        projected.combined(&places(*i, each), end.as_deref()).log_bayes_factor(&[&own])
    };
    let shape = |(i, j): &(usize, Option<usize>)| (times[*i], j.map_or(f64::INFINITY, |j| times[j]));
    Ok(Scanned {
        shapes: asked.iter().map(shape).collect(),
        values: asked.par_iter().map(value).collect(),
        priors: vec![0.0; asked.len()],
    })
}

/// Improves a shape by steps that are halved, and finds how far each parameter may move before the evidence falls by a
/// half: its standard error. Both in the order of the effect's parameters; zero for amplitudes.
pub fn refine(
    effect: &'static Effect,
    start: &[f64],
    reference: &Reference<'_>,
    backdrop: &Backdrop<'_>,
) -> Result<(Vec<f64>, Vec<f64>), DiagnosisError> {
    let steps: Vec<f64> = effect
        .parameters
        .iter()
        .zip(start)
        .map(|(parameter, value)| match parameter.role {
            Role::Instant { .. } if value.is_finite() => 0.5 * grid(backdrop.scene),
            Role::Shape { usual } => stride(effect, parameter, usual, *value),
            _ => 0.0,
        })
        .collect();
    let mut best = start.to_vec();
    let mut most = judge(effect, std::slice::from_ref(&best), reference, backdrop)?[0];
    let mut errors = vec![0.0; best.len()];
    for halving in 0..6 {
        for at in (0..best.len()).filter(|at| steps[*at] > 0.0) {
            let step = steps[at] * 0.5f64.powi(halving);
            let tried: Vec<Vec<f64>> = [-step, step]
                .into_iter()
                .map(|by| {
                    let mut tried = best.clone();
                    tried[at] = (tried[at] + by)
                        .clamp(effect.parameters[at].range.0, effect.parameters[at].range.1.min(1e9));
                    tried
                })
                .collect();
            let values = judge(effect, &tried, reference, backdrop)?;
            let fall = most - 0.5 * (values[0] + values[1]);
            if fall > 0.0 {
                errors[at] = step / (2.0 * fall).sqrt();
            }
            for (value, tried) in values.into_iter().zip(tried) {
                if value > most {
                    (most, best) = (value, tried);
                }
            }
        }
    }
    Ok((best, errors))
}

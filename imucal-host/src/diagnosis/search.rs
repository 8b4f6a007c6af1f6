//! Which set of effects explains the gap: evidence, with the noise estimated anew for each set.
//!
//! Starting from none, effects are added, replaced and taken out while the evidence rises. Sets are judged by linear
//! algebra first; the few best are judged again with the noise that suits them, since steps and sways hide in a drift
//! that was estimated without them. After each change baseline and effects are fitted anew through the simulator.

use std::sync::{Arc, Mutex, PoisonError};

use super::{
    candidates::{Candidates, is_shaped},
    design::{Design, Normal},
    evidence::Projected,
    noise::{FAR, NEAR, Noise, Weighing},
    refit::{Fit, columns, refit, signatures},
    scene::{Reference, Scene},
    shape::{self, Backdrop},
    start,
    whitening::Whitening,
};
use crate::{
    effect::{Effect, class::class},
    recording::SensorKind,
    simulator::Dose,
};

/// Most effects in a set; where no rig guides the sensor, the latter: a hand and a reference add gaps of their own.
const MOST: (usize, usize) = (3, 5);
/// An addition must raise the evidence by this, beyond its share of the prior: odds of twenty.
const GAIN: f64 = 3.0;
/// Sets judged with a noise of their own at each turn: of the likeliest, and of those that a quieter noise would have.
const JUDGED: (usize, usize) = (6, 3);
/// Normal equations that are kept.
const KEPT: usize = 2;
/// Fits of the baseline, each with the noise that the last one left, where no rig guides the sensor.
const SETTLING: usize = 2;

/// A set of effects and how it was judged.
#[derive(Clone, Debug)]
pub struct Judged {
    /// The effects.
    pub set: Vec<&'static Effect>,
    /// The noise that suits it.
    pub noise: Noise,
    /// ln of its probability, but for a constant.
    pub log_evidence: f64,
}

/// The problem about a fit, with all its effects put back into the residual.
pub struct Linear<'s> {
    /// The scene.
    pub scene: &'s Scene<'s>,
    /// What there is to choose from.
    pub candidates: &'s Candidates,
    /// All columns and the residual of the baseline alone.
    pub design: Design,
    /// Weighs the blocks.
    pub weighing: Weighing<'s>,
    /// Columns of the baseline.
    pub baseline: Vec<usize>,
    /// Parameters of each candidate at which its signature was taken.
    pub shapes: Vec<Vec<f64>>,
    normals: Normals,
}

/// Normal equations of all columns under the noises asked for last.
type Normals = Mutex<Vec<(Noise, Arc<Normal>)>>;

/// A search that has come to its end.
pub struct Explained<'s> {
    /// The best set, with its noise.
    pub best: Judged,
    /// No effect at all, with its noise.
    pub none: Judged,
    /// The fit of the best set.
    pub fit: Fit,
    /// The problem about that fit.
    pub linear: Linear<'s>,
}

impl<'s> Linear<'s> {
    /// About a fit; shapes of candidates that it does not hold are those best under `noise`. Without a noise, about the
    /// fitted columns alone: nothing can be added.
    pub fn new(
        scene: &'s Scene<'s>,
        candidates: &'s Candidates,
        fit: &Fit,
        noise: Option<&Noise>,
    ) -> Option<Self> {
        let reference = scene.reference(fit.doses.clone(), &scene.fine)?;
        let weighing = Weighing::new(scene, SensorKind::ALL.map(|kind| reference.output(kind)));
        let (shapes, all): (Vec<Vec<f64>>, Vec<&'static Effect>) = match noise {
            Some(noise) => (
                best_shapes(&reference, candidates, fit, &weighing, noise)?,
                candidates.baseline.iter().chain(&candidates.effects).copied().collect(),
            ),
            None => (
                candidates.effects.iter().map(|effect| effect.neutral(scene.duration())).collect(),
                fit.doses.iter().map(|dose| dose.effect).collect(),
            ),
        };
        let columns = columns(&all);
        let means = signatures(&reference, &columns, &|effect| candidates.shape(&shapes, effect))?;
        let mut design = Design::new(scene, columns, &means, &fit.residual);
        let chosen = fit.doses.iter().filter(|dose| !candidates.has_term(dose.effect));
        let restored: Vec<(usize, f64)> = chosen
            .flat_map(|dose| design.of(dose.effect).into_iter().map(move |id| (id, dose)))
            .map(|(id, dose)| {
                let at = design.columns[id].parameter;
                (id, dose.values[at] / dose.effect.parameters[at].prior_scale)
            })
            .collect();
        design.restore(&restored);
        let baseline = candidates.baseline.iter().flat_map(|term| design.of(term)).collect();
        Some(Self { scene, candidates, design, weighing, baseline, shapes, normals: Normals::default() })
    }

    /// The same problem, with shapes of candidates that are best under another noise; `None` as well where those are the
    /// same.
    fn reshaped(&self, fit: &Fit, noise: &Noise) -> Option<Self> {
        let reference = self.scene.reference(fit.doses.clone(), &self.scene.fine)?;
        let shapes = best_shapes(&reference, self.candidates, fit, &self.weighing, noise)?;
        let others: Vec<&'static Effect> = self
            .candidates
            .effects
            .iter()
            .zip(self.shapes.iter().zip(&shapes))
            .filter(|(_, (own, other))| own != other)
            .map(|(effect, _)| *effect)
            .collect();
        if others.is_empty() {
            return None;
        }
        let changed = columns(&others);
        let means = signatures(&reference, &changed, &|effect| self.candidates.shape(&shapes, effect))?;
        let is_kept = |id: &usize| !others.iter().any(|effect| self.design.columns[*id].is_of(effect));
        let kept: Vec<usize> = (0..self.design.columns.len()).filter(is_kept).collect();
        let columns = kept.iter().map(|id| self.design.columns[*id]).chain(changed).collect();
        let design = self.design.extended(&kept, columns, &means);
        let baseline = self.candidates.baseline.iter().flat_map(|term| design.of(term)).collect();
        let (scene, candidates) = (self.scene, self.candidates);
        let weighing = Weighing::new(scene, self.weighing.given.clone());
        Some(Self { scene, candidates, design, weighing, baseline, shapes, normals: Normals::default() })
    }

    fn shape_of(&self, effect: &Effect) -> Vec<f64> {
        self.candidates.shape(&self.shapes, effect)
    }

    /// Columns of the baseline and of a set.
    pub fn fitted(&self, set: &[&'static Effect]) -> Vec<usize> {
        let of = |effect: &&'static Effect| self.design.of(effect);
        self.baseline.iter().copied().chain(set.iter().flat_map(of)).collect()
    }

    /// Noise and evidence of a set; the noise is estimated anew for the sensors that `anew` reaches.
    pub fn judge(
        &self,
        set: &[&'static Effect],
        start: &Noise,
        anew: &[SensorKind],
        steps: &[f64],
    ) -> Option<Judged> {
        let fitted = self.fitted(set);
        let mut noise = start.clone();
        for kind in self.scene.kinds.iter().filter(|kind| anew.contains(kind)) {
            noise.sensors[*kind as usize] = self.weighing.fit(&self.design, *kind, &fitted, start, steps);
        }
        let whitenings = self.weighing.whitenings(&self.design, &noise);
        let normal = self.design.normal(&whitenings, &fitted);
        let log_evidence = log_evidence(&normal, self.baseline.len(), &self.groups(set, &fitted))?
            - set.iter().map(|effect| self.surprise(effect)).sum::<f64>();
        Some(Judged { set: set.to_vec(), noise, log_evidence })
    }

    /// Places of each effect's columns among the fitted.
    pub fn groups(&self, set: &[&'static Effect], fitted: &[usize]) -> Vec<Vec<usize>> {
        let of = |effect: &&'static Effect| -> Vec<usize> {
            (0..fitted.len()).filter(|at| self.design.columns[fitted[*at]].is_of(effect)).collect()
        };
        set.iter().map(of).collect()
    }

    /// −ln of an effect's prior: one of the candidates, in one of its shapes.
    fn surprise(&self, effect: &Effect) -> f64 {
        let shapes = shape::choices(effect, self.scene.duration());
        ((self.candidates.effects.len() * shapes) as f64).ln()
    }

    /// Σ⁻¹ of each channel.
    pub fn whitenings(&self, noise: &Noise) -> Vec<Whitening> {
        self.weighing.whitenings(&self.design, noise)
    }

    /// Normal equations of all columns.
    pub fn normal(&self, noise: &Noise) -> Arc<Normal> {
        let known = |normals: &Vec<(Noise, Arc<Normal>)>| {
            normals.iter().find(|(other, _)| other == noise).map(|(_, normal)| Arc::clone(normal))
        };
        let locked = || self.normals.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(normal) = known(&locked()) {
            return normal;
        }
        let every: Vec<usize> = (0..self.design.columns.len()).collect();
        let normal = Arc::new(self.design.normal(&self.whitenings(noise), &every));
        let mut normals = locked();
        normals.truncate(KEPT - 1);
        normals.insert(0, (noise.clone(), Arc::clone(&normal)));
        normal
    }

    /// Scores of all columns but the baseline's, with the baseline projected out.
    pub fn projected(&self, noise: &Noise) -> Option<(Projected, Vec<usize>)> {
        let every = 0..self.design.columns.len();
        let others: Vec<usize> = every.filter(|id| !self.baseline.contains(id)).collect();
        Some((Projected::new(&self.normal(noise), &self.baseline, &others)?, others))
    }

    /// Candidates by ln BF of a set with each of them added, best first; the set itself has the value returned beside.
    pub fn ranked(
        &self,
        set: &[&'static Effect],
        noise: &Noise,
    ) -> Option<(f64, Vec<(f64, &'static Effect)>)> {
        let (projected, others) = self.projected(noise)?;
        let places = |effect: &Effect| -> Vec<usize> {
            (0..others.len()).filter(|at| self.design.columns[others[*at]].is_of(effect)).collect()
        };
        let own: Vec<Vec<usize>> = set.iter().map(|effect| places(effect)).collect();
        let value = |more: Option<&Vec<usize>>| {
            let parts: Vec<&[usize]> = own.iter().chain(more).map(Vec::as_slice).collect();
            projected.log_bayes_factor(&parts)
        };
        let mut ranked: Vec<(f64, &'static Effect)> = self
            .candidates
            .effects
            .iter()
            // Two of a class explain each other's noise and not the gap.
            .filter(|effect| !set.iter().any(|other| class(&other.id) == class(&effect.id)))
            .map(|effect| (value(Some(&places(effect))) - self.surprise(effect), *effect))
            .collect();
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
        Some((value(None), ranked))
    }

    /// The best set with one effect more, judged with its own noise; of `among`.
    fn added(&self, from: &Judged, among: &dyn Fn(&'static Effect) -> bool) -> Option<Option<Judged>> {
        let mut shortlist: Vec<&'static Effect> = Vec::new();
        // Less noise than is true makes evidence, never takes it.
        for (noise, most) in [(&from.noise, JUDGED.0), (&from.noise.quieter(), JUDGED.1)] {
            let (own, ranked) = self.ranked(&from.set, noise)?;
            let likely = ranked.into_iter().filter(|(value, effect)| *value > own && among(effect));
            for (_, effect) in likely.take(most) {
                if !shortlist.iter().any(|other| std::ptr::eq(*other, effect)) {
                    shortlist.push(effect);
                }
            }
        }
        let sets = shortlist.into_iter().map(|effect| {
            let mut set = from.set.clone();
            set.push(effect);
            (set, self.scene.reach(effect).to_vec())
        });
        Some(self.best_of(sets.collect(), &from.noise))
    }

    /// The best of some sets, the noise of the sensors beside each estimated anew.
    fn best_of(&self, sets: Vec<(Vec<&'static Effect>, Vec<SensorKind>)>, noise: &Noise) -> Option<Judged> {
        sets.iter()
            .filter_map(|(set, anew)| self.judge(set, noise, anew, &NEAR))
            .max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))
    }

    /// The best set with one effect replaced or taken out.
    fn changed(&self, from: &Judged) -> Option<Option<Judged>> {
        let mut sets = Vec::new();
        for at in 0..from.set.len() {
            let mut fewer = from.set.clone();
            let taken = fewer.remove(at);
            let (_, ranked) = self.ranked(&fewer, &from.noise)?;
            let others = ranked.into_iter().filter(|(_, effect)| !std::ptr::eq(*effect, taken));
            for (_, effect) in others.take(JUDGED.1) {
                let mut set = fewer.clone();
                set.push(effect);
                sets.push((set, either(taken.sensors, effect.sensors)));
            }
            sets.push((fewer, taken.sensors.to_vec()));
        }
        Some(self.best_of(sets, &from.noise))
    }
}

fn either(one: &[SensorKind], other: &[SensorKind]) -> Vec<SensorKind> {
    SensorKind::ALL.into_iter().filter(|kind| one.contains(kind) || other.contains(kind)).collect()
}

/// The shape of each candidate that is best under a noise beside a fit; that of the fit for those it holds.
fn best_shapes(
    reference: &Reference<'_>,
    candidates: &Candidates,
    fit: &Fit,
    weighing: &Weighing<'_>,
    noise: &Noise,
) -> Option<Vec<Vec<f64>>> {
    let scene = reference.scene;
    let fitted = columns(&fit.doses.iter().map(|dose| dose.effect).collect::<Vec<_>>());
    let means = signatures(reference, &fitted, &|_| Vec::new())?;
    let design = Design::new(scene, fitted, &means, &fit.residual);
    let every: Vec<usize> = (0..design.columns.len()).collect();
    let whitenings = weighing.whitenings(&design, noise);
    let coarse = scene.reference(fit.doses.clone(), &scene.coarse)?;
    // Where no rig guides the sensor, what a hand adds hides when an episode began and ended.
    let quiet = match scene.swings {
        Some(_) => None,
        None => Some(weighing.whitenings(&design, &noise.quieter().even())),
    };
    let shape =
        |effect: &&'static Effect| match fit.doses.iter().find(|dose| std::ptr::eq(dose.effect, *effect)) {
            Some(dose) => Some(dose.values.clone()),
            None if is_shaped(effect) => {
                let quiet = quiet.as_ref().filter(|_| shape::is_episode(effect));
                let whitenings = quiet.unwrap_or(&whitenings);
                let backdrop = Backdrop { scene, design: &design, fitted: &every, whitenings };
                let best = shape::best(effect, &coarse, &backdrop)?;
                match quiet {
                    Some(_) => Some(shape::refine(effect, &best, &coarse, &backdrop)?.0),
                    None => Some(best),
                }
            }
            None => Some(effect.neutral(scene.duration())),
        };
    candidates.effects.iter().map(shape).collect()
}

/// ln of the probability of the data, but for a constant: columns of the baseline come first, then `groups` of columns,
/// each an effect or what may stand for one.
pub fn log_evidence(normal: &Normal, baseline: usize, groups: &[Vec<usize>]) -> Option<f64> {
    let first: Vec<usize> = (0..baseline).collect();
    let others: Vec<usize> = (baseline..normal.score.len()).collect();
    let projected = Projected::new(normal, &first, &others)?;
    let places: Vec<Vec<usize>> =
        groups.iter().map(|group| group.iter().map(|column| column - baseline).collect()).collect();
    let parts: Vec<&[usize]> = places.iter().map(Vec::as_slice).collect();
    let alone = Normal {
        information: normal.information.view((0, 0), (baseline, baseline)).into_owned(),
        score: normal.score.rows(0, baseline).into_owned(),
        ..normal.clone()
    };
    Some(projected.log_bayes_factor(&parts) - 0.5 * super::noise::restricted(&alone))
}

/// Searches. `None` where the simulator fails.
pub fn search<'s>(
    scene: &'s Scene<'s>,
    candidates: &'s Candidates,
    trace: &dyn Fn(&str),
) -> Option<Explained<'s>> {
    let doses: Vec<Dose> = candidates
        .baseline
        .iter()
        .map(|effect| Dose { effect, values: vec![0.0; effect.parameters.len()] })
        .collect();
    let mut fit = match scene.swings {
        Some(_) => refit(scene, doses, None)?,
        None => start::start(scene, doses)?,
    };
    trace("baseline fitted");
    let mut linear = Linear::new(scene, candidates, &fit, None)?;
    let white = linear.weighing.white(&fit.residual);
    let mut none = linear.judge(&[], &white, &SensorKind::ALL, &FAR)?;
    trace(&format!("none: {:.1} {:?}", none.log_evidence, none.noise));
    // Where no rig guides the sensor, the first noise holds much of the misfit that the first fit began with.
    for _ in 0..if scene.swings.is_none() { SETTLING } else { 0 } {
        fit = refit(scene, fit.doses, Some(&none.noise))?;
        linear = Linear::new(scene, candidates, &fit, None)?;
        let start = with_white(&none.noise, &linear.weighing.white(&fit.residual));
        none = linear.judge(&[], &start, &SensorKind::ALL, &FAR)?;
        trace(&format!("none again: {:.1} {:?}", none.log_evidence, none.noise));
    }
    let most = if scene.swings.is_some() { MOST.0 } else { MOST.1 };
    let mut best = none.clone();
    linear = Linear::new(scene, candidates, &fit, Some(&best.noise))?;
    trace("shapes");
    let mut seen = Vec::new();
    loop {
        best = linear.judge(&best.set, &best.noise, &SensorKind::ALL, &FAR)?;
        let mut next: Option<Judged> = None;
        if best.set.len() < most {
            next = linear
                .added(&best, &|_| true)?
                .filter(|judged| judged.log_evidence > best.log_evidence + GAIN);
        }
        if next.is_none() && best.set.len() > 1 {
            next = linear.changed(&best)?.filter(|judged| judged.log_evidence > best.log_evidence + 0.5);
        }
        let mut from_quiet = None;
        if next.is_none() && best.set.len() < most {
            // A step or a sway that stands in the drift is not where that drift would have it.
            from_quiet = linear.reshaped(&fit, &best.noise.quieter());
            if let Some(quiet) = &from_quiet {
                let moved = |effect: &'static Effect| quiet.shape_of(effect) != linear.shape_of(effect);
                next = quiet
                    .added(&best, &moved)?
                    .filter(|judged| judged.log_evidence > best.log_evidence + GAIN);
            }
        }
        // Two sets may each be better than the other with the noise that the other leaves.
        let Some(next) = next.filter(|judged| !seen.contains(&key(&judged.set))) else { break };
        seen.push(key(&next.set));
        let names: Vec<&str> = next.set.iter().map(|effect| effect.id.as_str()).collect();
        trace(&format!("{:.1} → {:.1} {names:?}", best.log_evidence, next.log_evidence));
        (fit, linear, best) = advance(scene, candidates, &fit, from_quiet.as_ref().unwrap_or(&linear), next)?;
        trace("refitted");
    }
    Some(Explained { best, none, fit, linear })
}

/// A set, whatever the order of its effects.
fn key(set: &[&'static Effect]) -> Vec<&'static str> {
    let mut key: Vec<&'static str> = set.iter().map(|effect| effect.id.as_str()).collect();
    key.sort_unstable();
    key
}

/// Fits a set through the simulator and looks at all candidates from there.
fn advance<'s>(
    scene: &'s Scene<'s>,
    candidates: &'s Candidates,
    fit: &Fit,
    linear: &Linear<'s>,
    mut next: Judged,
) -> Option<(Fit, Linear<'s>, Judged)> {
    let kept = |effect: &'static Effect| fit.doses.iter().find(|dose| std::ptr::eq(dose.effect, effect));
    let mut doses: Vec<Dose> = candidates.baseline.iter().filter_map(|term| kept(term).cloned()).collect();
    let fresh: Vec<&'static Effect> =
        next.set.iter().copied().filter(|effect| kept(effect).is_none()).collect();
    doses.extend(next.set.iter().filter_map(|effect| kept(effect).cloned()));
    for effect in fresh {
        let at = candidates.effects.iter().position(|other| std::ptr::eq(*other, effect))?;
        let values = linear.shapes[at].clone();
        let values = if is_shaped(effect) {
            // Refined against what is fitted without it.
            let rest: Vec<&'static Effect> =
                next.set.iter().copied().filter(|other| !std::ptr::eq(*other, effect)).collect();
            let fitted = linear.fitted(&rest);
            let whitenings = linear.whitenings(&next.noise);
            let backdrop =
                Backdrop { scene, design: &linear.design, fitted: &fitted, whitenings: &whitenings };
            let reference = scene.reference(doses.clone(), &scene.fine)?;
            shape::refine(effect, &values, &reference, &backdrop).map_or(values, |(refined, _)| refined)
        } else {
            values
        };
        doses.push(Dose { effect, values });
    }
    let fit = refit(scene, doses, Some(&next.noise))?;
    let white = linear.weighing.white(&fit.residual);
    next.noise = with_white(&next.noise, &white);
    let linear = Linear::new(scene, candidates, &fit, Some(&next.noise))?;
    Some((fit, linear, next))
}

/// A noise with the white noise of another, where that is less: a misfit that a fit has gone through is no noise.
fn with_white(noise: &Noise, white: &Noise) -> Noise {
    let least = white.clone().at_most(noise);
    let mut noise = noise.clone();
    for (own, least) in noise.sensors.iter_mut().zip(least.sensors) {
        (own.white, own.moving) = (least.white, least.moving);
    }
    noise
}

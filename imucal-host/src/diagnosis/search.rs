//! Which set of effects explains the gap: evidence, with the noise estimated anew for each set.
//!
//! Starting from none, effects are added, replaced and taken out while the evidence rises. Sets are judged by linear
//! algebra first; the few best are judged again with the noise that suits them, since steps and sways hide in a drift
//! that was estimated without them. After each change baseline and effects are fitted anew through the simulator.

use super::{
    candidates::{Candidates, is_shaped},
    linear::{Judged, Linear},
    noise::{FAR, NEAR, Noise},
    refit::{Fit, refit},
    scene::Scene,
    shape::{self, Backdrop},
    start,
};
use crate::{effect::Effect, recording::SensorKind, simulator::Dose};

/// Most effects in a set; where no rig guides the sensor, the latter: a hand and a reference add gaps of their own.
const MOST: (usize, usize) = (3, 5);
/// An addition must raise the evidence by this, beyond its share of the prior: odds of seven. False
/// alarms are fewer by far than one in seven (`imucal blind`), since the noise is estimated for each set.
const GAIN: f64 = 2.0;
/// Sets judged with a noise of their own at each turn: of the likeliest, and of those that a quieter noise would have.
const JUDGED: (usize, usize) = (6, 3);
/// Fits of the baseline, each with the noise that the last one left, where no rig guides the sensor.
const SETTLING: usize = 2;

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

impl Linear<'_> {
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

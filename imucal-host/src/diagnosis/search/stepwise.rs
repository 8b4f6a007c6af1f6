//! Which set of effects explains the gap: evidence, with the noise estimated again for each set.
//!
//! Starting from none, effects are added, replaced and taken out while the evidence rises. Sets are judged by linear
//! algebra first; the few best are judged again with the noise that suits them, since steps and sways hide in a drift
//! that was estimated without them. After each change baseline and effects are fitted again through the simulator.

use super::{
    held_back,
    hypothesis::Scored,
    linearisation::Linearisation,
    refit::{Fit, refit},
    staged_start,
};
use crate::{
    diagnosis::{
        error::DiagnosisError, library::candidates::Candidates, mixed_model::noise::FAR,
        residual::forward_model::ForwardModel,
    },
    effect::Effect,
    recording::SensorKind,
    simulator::Dose,
};

/// A search that has come to its end.
pub struct Solution<'s> {
    /// The best set, with its noise.
    pub best: Scored,
    /// No effect at all, with its noise.
    pub none: Scored,
    /// The fit of the best set.
    pub fit: Fit,
    /// The problem about that fit.
    pub linear: Linearisation<'s>,
    /// Effects that were left out in the end, since a fit took them at no size.
    pub idle: Vec<&'static Effect>,
}

/// Searches. `None` where the simulator fails.
pub fn search<'s>(
    scene: &'s ForwardModel<'s>,
    candidates: &'s Candidates,
    trace: &dyn Fn(&str),
) -> Result<Solution<'s>, DiagnosisError> {
    let doses: Vec<Dose> = candidates
        .baseline
        .iter()
        .map(|effect| Dose { effect, values: vec![0.0; effect.parameters.len()] })
        .collect();
    let by = &scene.settings.search;
    let mut fit = if by.staged_start {
        staged_start::start(scene, doses)?
    } else {
        refit(scene, Fit::of(scene, doses)?, None)?
    };
    trace("baseline fitted");
    let mut linear = Linearisation::fitted_alone(scene, candidates, &fit)?;
    let white = linear.weighing.white(&fit.residual);
    let mut none = linear.judge(&[], &white, &SensorKind::ALL, &FAR)?;
    trace(&format!("without an effect: log evidence {:.1}", none.log_evidence));
    // The first noise may hold much of the misfit that the first fit began with.
    for _ in 0..by.settling {
        fit = refit(scene, fit, Some(&none.noise))?;
        linear = Linearisation::fitted_alone(scene, candidates, &fit)?;
        let start = none.noise.clone().at_most(&linear.weighing.white(&fit.residual));
        none = linear.judge(&[], &start, &SensorKind::ALL, &FAR)?;
        trace(&format!("the same with the noise estimated again: {:.1}", none.log_evidence));
    }
    linear = Linearisation::new(scene, candidates, &fit, &none.noise, None)?;
    trace("shapes of the effects scanned");
    let mut at = Solution { best: none.clone(), none, fit, linear, idle: Vec::new() };
    let mut likeliest: Option<Solution<'s>> = None;
    let mut seen = vec![Vec::new()];
    loop {
        at = at.settled()?;
        let Some(Step { to, found_in }) = improved(&at)? else {
            let again = held_back::begun_again(&at.linear, &at.fit, &at.best);
            let Some((best, fit, linear)) = again else { break };
            trace("begun again from a perfect sensor, with what its noise held back");
            at = Solution { best, fit, linear, ..at };
            continue;
        };
        // Two sets may each be better than the other with the noise that the other leaves; a set may be better once in
        // shapes of another place.
        let visits = if found_in.is_some() { 2 } else { 1 };
        let comes_round = seen.iter().filter(|set| **set == key(&to.set)).count() >= visits;
        if comes_round && to.set.len() >= at.best.set.len() {
            break;
        }
        seen.push(key(&to.set));
        let names: Vec<&str> = to.set.iter().map(|effect| effect.id.as_str()).collect();
        let (before, after) = (at.best.log_evidence, to.log_evidence);
        trace(&format!("effects tried: {}; log evidence {before:.1} to {after:.1}", names.join(", ")));
        let next = at.advanced(found_in.as_ref().unwrap_or(&at.linear), to)?;
        trace("fitted again with them");
        if comes_round {
            // The fit with one effect more would rather be without it: it has not kept what linear algebra promised.
            return next.settled()?.without_idle();
        }
        let left = std::mem::replace(&mut at, next);
        if likeliest.as_ref().is_none_or(|most| left.is_likelier(most)) {
            likeliest = Some(left);
        }
    }
    // What a move promises by linear algebra the fit through the simulator need not keep.
    likeliest.filter(|most| most.is_likelier(&at)).unwrap_or(at).without_idle()
}

impl<'s> Solution<'s> {
    /// Without the effects that the fit has left at no size: what they would explain has the sign that they cannot have, and what
    /// was fitted next to them has made room for them. Nothing takes their place, since it would be named for that room.
    fn without_idle(mut self) -> Result<Self, DiagnosisError> {
        loop {
            let acts = |effect: &&'static Effect| {
                !self.fit.doses.iter().any(|dose| dose.effect == *effect && !dose.acts())
            };
            let (set, idle): (Vec<&'static Effect>, Vec<_>) = self.best.set.iter().copied().partition(acts);
            if idle.is_empty() {
                return Ok(self);
            }
            self.idle.extend(idle);
            let rest = self.linear.judge(&set, &self.best.noise, &SensorKind::ALL, &FAR)?;
            self = self.advanced(&self.linear, rest)?.settled()?;
        }
    }

    /// With the noise that suits its set.
    fn settled(mut self) -> Result<Self, DiagnosisError> {
        self.best = self.linear.judge(&self.best.set, &self.best.noise, &SensorKind::ALL, &FAR)?;
        if self.best.set.is_empty() {
            self.none = self.best.clone();
        }
        Ok(self)
    }

    fn is_likelier(&self, other: &Self) -> bool {
        self.best.log_evidence > other.best.log_evidence
    }

    /// Fits a set, found in a problem that may have other shapes than the own, through the simulator, and looks at all
    /// candidates from there.
    fn advanced(&self, found_in: &Linearisation<'s>, mut next: Scored) -> Result<Self, DiagnosisError> {
        let Linearisation { scene, candidates, .. } = *found_in;
        // An effect whose shape that problem has changed begins again.
        let kept = |effect: &'static Effect| {
            let is_same =
                |dose: &&Dose| candidates.has_term(effect) || found_in.shape_of(effect) == dose.values;
            self.fit.doses.iter().find(|dose| dose.effect == effect).filter(is_same)
        };
        let all = candidates.baseline.iter().chain(&next.set);
        let mut doses: Vec<Dose> = all.filter_map(|effect| kept(effect).cloned()).collect();
        for effect in next.set.iter().copied().filter(|effect| kept(effect).is_none()) {
            let rest: Vec<&'static Effect> =
                next.set.iter().copied().filter(|other| *other != effect).collect();
            let values = found_in.refined(effect, &doses, &rest, &next.noise)?;
            doses.push(Dose { effect, values });
        }
        let fit = refit(scene, self.fit.clone().with(scene, doses)?, Some(&next.noise))?;
        next.noise = next.noise.at_most(&found_in.weighing.white(&fit.residual));
        let fit = match held_back::released(found_in, &fit, &next.noise) {
            Some((free, lower)) => {
                next.noise = lower;
                free
            }
            None => fit,
        };
        next.noise = found_in.weighing.drift_begun_again(next.noise, &fit.residual);
        let linear = Linearisation::new(scene, candidates, &fit, &next.noise, Some(&self.linear))?;
        Ok(Self { best: next, none: self.none.clone(), fit, linear, idle: self.idle.clone() })
    }
}

/// A likelier set, and the problem in which it was found where that is not the one it was sought from.
struct Step<'s> {
    to: Scored,
    found_in: Option<Linearisation<'s>>,
}

impl Step<'_> {
    fn to(to: Scored) -> Self {
        Self { to, found_in: None }
    }
}

/// The cheapest step that gains.
fn improved<'s>(at: &Solution<'s>) -> Result<Option<Step<'s>>, DiagnosisError> {
    let Solution { linear, fit, best, .. } = at;
    let gains = |judged: &Scored, least: f64| judged.log_evidence > best.log_evidence + least;
    let by = &linear.scene.settings.search;
    let gain = if best.set.is_empty() { by.first_gain } else { by.further_gain };
    // What the data would rather be without is not asserted: fewer effects need not gain.
    let change = |judged: &Scored| if judged.set.len() < best.set.len() { 0.0 } else { by.change_gain };
    let room = by.most.saturating_sub(best.set.len());
    if by.settles_classes
        && let Some(next) = linear.exchanged_in_class(best)?.filter(|next| gains(next, by.change_gain))
    {
        return Ok(Some(Step::to(next)));
    }
    if room > 0
        && let Some(next) = linear.added(best, &|_| true)?.filter(|next| gains(next, gain))
    {
        return Ok(Some(Step::to(next)));
    }
    if !best.set.is_empty()
        && let Some(next) = linear.changed(best)?.filter(|next| gains(next, change(next)))
    {
        return Ok(Some(Step::to(next)));
    }
    // A step or a sway that stands in the drift is not where that drift would have it.
    let quiet = if room > 0 { linear.reshaped(fit, &best.noise.quieter(), &[]) } else { None };
    let moved = |effect: &'static Effect| {
        quiet.as_ref().is_some_and(|quiet| quiet.shape_of(effect) != linear.shape_of(effect))
    };
    let from_quiet = match &quiet {
        Some(quiet) => quiet.added(best, &moved)?.filter(|next| gains(next, gain)),
        None => None,
    };
    if let Some(to) = from_quiet {
        return Ok(Some(Step { to, found_in: quiet }));
    }
    if room > 1
        && let paired = quiet.as_ref().unwrap_or(linear).paired(best)?
        && let Some(to) = paired.filter(|next| gains(next, gain + by.further_gain))
    {
        return Ok(Some(Step { to, found_in: quiet }));
    }
    let reshaped = linear.changed_with_new_shapes(fit, best)?.filter(|(_, next)| gains(next, by.change_gain));
    Ok(reshaped.map(|(reshaped, to)| Step { to, found_in: Some(reshaped) }))
}

/// A set, whatever the order of its effects.
fn key(set: &[&'static Effect]) -> Vec<&'static str> {
    let mut key: Vec<&'static str> = set.iter().map(|effect| effect.id.as_str()).collect();
    key.sort_unstable();
    key
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect;

    #[test]
    fn a_set_is_the_same_in_whatever_order_it_was_found() {
        let set: Vec<&'static Effect> = effect::CATALOGUE.iter().take(3).collect();
        let turned: Vec<&'static Effect> = set.iter().rev().copied().collect();
        assert_eq!(key(&set), key(&turned));
        assert_ne!(key(&set), key(&set[..2]));
    }
}

//! Which set of effects explains the gap: evidence, with the noise estimated again for each set.
//!
//! Starting from none, effects are added, replaced and taken out while the evidence rises. Sets are judged by linear
//! algebra first; the few best are judged again with the noise that suits them, since steps and sways hide in a drift
//! that was estimated without them. After each change baseline and effects are fitted again through the simulator.

use super::{
    hypothesis::Scored,
    linearisation::Linearisation,
    refit::{Fit, refit},
    staged_start,
};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        library::{candidates::Candidates, nonlinear, nonlinear::Backdrop},
        mixed_model::noise::{FAR, Noise},
        residual::{base_run::Reference, forward_model::ForwardModel},
    },
    effect::Effect,
    recording::SensorKind,
    simulator::Dose,
};

/// In so much of a noise, effects are as large as the data alone would have them.
const RELEASED: f64 = 0.01;
/// A fit leaves far less that leaves less than this share of the noise.
const FAR_LESS: f64 = 0.5;

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
        let start = with_white(&none.noise, &linear.weighing.white(&fit.residual));
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
        let Some(Step { to, found_in }) = improved(&at)? else { break };
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
            let values = refined(effect, found_in, &doses, &rest, &next.noise)?;
            doses.push(Dose { effect, values });
        }
        let fit = refit(scene, self.fit.clone().with(scene, doses)?, Some(&next.noise))?;
        next.noise = with_white(&next.noise, &found_in.weighing.white(&fit.residual));
        let fit = match released(found_in, &fit, &next.noise)? {
            Some((free, lower)) => {
                next.noise = lower;
                free
            }
            None => fit,
        };
        let linear = Linearisation::new(scene, candidates, &fit, &next.noise, Some(&self.linear))?;
        Ok(Self { best: next, none: self.none.clone(), fit, linear, idle: self.idle.clone() })
    }
}

/// A fit whose effects are not held at their usual sizes, and its noise; `None` unless the noise holds a misfit of which that fit leaves
/// far less. In a noise as large as what an effect does, the data say little against its usual size. The fit begins without the effects
/// and with a perfect sensor, whose gain a fit without them may have made many times too large.
fn released(
    found_in: &Linearisation<'_>,
    fit: &Fit,
    noise: &Noise,
) -> Result<Option<(Fit, Noise)>, DiagnosisError> {
    let held = SensorKind::ALL.map(|kind| found_in.weighing.holds_misfit(noise, kind));
    if !held.contains(&true) {
        return Ok(None);
    }
    let begins_again = |dose: &Dose| matches!(dose.effect.sensors, [kind] if held[*kind as usize]);
    let begun = |dose: &Dose| if begins_again(dose) { dose.without_amplitudes() } else { dose.clone() };
    let doses = fit.doses.iter().map(begun).collect();
    let start = fit.clone().with(found_in.scene, doses)?;
    let free = refit(found_in.scene, start, Some(&noise.clone().scaled(RELEASED)))?;
    let lower = with_white(noise, &found_in.weighing.white(&free.residual));
    let is_far_less = |kind| lower.largest(kind) < FAR_LESS * noise.largest(kind);
    Ok(SensorKind::ALL.into_iter().any(is_far_less).then_some((free, lower)))
}

/// An effect's parameters at which its signature was taken; a shape is refined against what is fitted without it.
fn refined(
    effect: &'static Effect,
    linear: &Linearisation<'_>,
    doses: &[Dose],
    rest: &[&'static Effect],
    noise: &Noise,
) -> Result<Vec<f64>, DiagnosisError> {
    let (scene, values) = (linear.scene, linear.shape_of(effect));
    if !effect.is_shaped() {
        return Ok(values);
    }
    let fitted = linear.fitted(rest);
    let precisions = linear.precisions(noise);
    let backdrop = Backdrop::new(scene, &linear.design, &fitted, &precisions);
    let reference = Reference::new(scene, doses.to_vec(), &scene.fine)?;
    Ok(nonlinear::refine(effect, &values, &reference, &backdrop).map_or(values, |(refined, _)| refined))
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

/// A noise with the white noise of another, where that is less: a misfit that a fit has gone through is no noise.
fn with_white(noise: &Noise, white: &Noise) -> Noise {
    let least = white.clone().at_most(noise);
    let mut noise = noise.clone();
    for (own, least) in noise.sensors.iter_mut().zip(least.sensors) {
        (own.white, own.moving) = (least.white, least.moving);
    }
    noise
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        diagnosis::{
            Source, library::candidates::Setting, mixed_model::noise::SensorNoise,
            screening::preparation::Preparation, settings::Settings,
        },
        effect,
        recording::Stream,
        simulator::robot::{RobotKind, RobotScene},
    };

    fn noise(white: f64, drift: f64) -> Noise {
        let sensor = SensorNoise {
            white: [white; 3],
            moving: [2.0 * white; 3],
            drift: [drift; 2],
            slow: 120.0,
            scatter: 0.0,
            breadth: 0.0,
        };
        Noise { sensors: [sensor; 3] }
    }

    #[test]
    fn a_set_is_the_same_in_whatever_order_it_was_found() {
        let set: Vec<&'static Effect> = effect::CATALOGUE.iter().take(3).collect();
        let turned: Vec<&'static Effect> = set.iter().rev().copied().collect();
        assert_eq!(key(&set), key(&turned));
        assert_ne!(key(&set), key(&set[..2]));
    }

    #[test]
    fn white_noise_is_lowered_by_a_better_fit_and_never_raised() {
        let (old, better, worse) = (noise(1.0, 0.5), noise(0.25, 0.1), noise(4.0, 9.0));
        let found = with_white(&old, &better).sensors[0];
        assert_eq!((found.white, found.moving, found.drift), ([0.25; 3], [0.5; 3], [0.5; 2]));
        assert_eq!(with_white(&old, &worse), old);
    }

    #[test]
    fn an_arm_that_its_usual_length_holds_back_is_released_where_the_noise_holds_a_misfit() {
        let lever = effect::find("acc.lever_arm").unwrap();
        let arm = [1.0, 0.5, -0.5];
        let doses = vec![Dose { effect: lever, values: arm.to_vec() }];
        let flight =
            RobotScene { kind: RobotKind::Flying, duration: 60.0, doses, seed: 2, ..RobotScene::default() };
        let pair = flight.record("arm").unwrap();
        let (stream, settings) = (Stream::of(&pair.simulated), Settings::preset(Source::Simulator));
        let preparation = Preparation::new(&pair.real, stream.as_ref(), None, &settings).unwrap();
        let (usable, movement) = (preparation.usable.clone(), &*preparation.movement);
        let scene = ForwardModel::new(&pair.real, usable, movement, preparation.triads, &settings);
        let setting = Setting {
            kinds: &scene.kinds,
            thermometer: false,
            calibrated: &[],
            provided: settings.source,
            field_known: true,
        };
        let candidates = Candidates::new(&setting, &[], &[]);
        // A gain that a fit without the arm has made far too large, and an arm of the usual length.
        let value = |effect: &Effect| if effect.id == "acc.scale" { 8.0 } else { 0.0 };
        let of =
            |effect: &&'static Effect| Dose { effect, values: vec![value(effect); effect.parameters.len()] };
        let held = Dose { effect: lever, values: vec![0.02, 0.01, -0.01] };
        let doses = candidates.baseline.iter().map(of).chain([held]).collect();
        let fit = Fit::of(&scene, doses).unwrap();
        let linear = Linearisation::fitted_alone(&scene, &candidates, &fit).unwrap();
        let mut noise = linear.weighing.white(&fit.residual);
        let acc = &mut noise.sensors[SensorKind::Acc as usize];
        (acc.white, acc.moving) = ([30.0; 3], [30.0; 3]);
        let (free, lower) = released(&linear, &fit, &noise).unwrap().expect("it leaves far less");
        let found = &free.doses.iter().find(|dose| dose.effect == lever).unwrap().values;
        // The unit's axes are off by up to a degree.
        assert!(found.iter().zip(arm).all(|(found, arm)| (found - arm).abs() < 0.04), "{found:?}");
        assert!(lower.largest(SensorKind::Acc) < 1.0, "{lower:?}");
        assert!(released(&linear, &free, &lower).unwrap().is_none(), "nothing is held any more");
    }
}

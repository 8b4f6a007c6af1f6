//! The diagnosis, put together once from what the search has found.

use rayon::prelude::*;

use super::{
    confounded_episode, credible, cross_validation,
    decision::Evidence,
    detectability, estimates, experiment, fault, model_error,
    reference_clock::{self, Clock},
    shares::{self, Closed},
};
use crate::{
    diagnosis::{
        finding::{self, Cause, Diagnosis, Place, Verdict},
        location::{covariate::Covariate, covariates, score_test, score_test::Following},
        reference::movement,
        screening::preparation::Preparation,
        search::stepwise::Solution,
    },
    effect::Effect,
    recording::Recording,
};

/// A driver is followed when noise alone would do as much less often than this, all tests counted.
const FOLLOWED: f64 = 0.01;

/// A diagnosis that could not be made, and why.
pub fn untestable(recording: &Recording, why: String) -> Diagnosis {
    Diagnosis {
        format: finding::FORMAT.to_owned(),
        recording: recording.name.clone(),
        verdict: Verdict::NotTestable,
        remarks: vec![why],
        warnings: recording.warnings.iter().map(ToString::to_string).collect(),
        gap: Vec::new(),
        places: Vec::new(),
        causes: Vec::new(),
        credible_set: Vec::new(),
        gap_closed_total: None,
        gap_closed_total_ci95: None,
        held_out: false,
        absent: Vec::new(),
        not_testable: Vec::new(),
        next_experiment: Vec::new(),
    }
}

/// What was asked of the best set of effects.
struct Tested {
    drivers: Vec<Covariate>,
    /// Covariates that the residual of the best set may depend on.
    after: Vec<Following>,
    closed: Closed,
    standings: Vec<credible::Standing>,
}

impl Tested {
    fn of(Solution { linear, best, .. }: &Solution<'_>, progress: &dyn Fn(&str)) -> Option<Self> {
        let drivers = covariates::drivers(linear.scene, &linear.weighing.given);
        let after = score_test::score_tests_refitted(linear, &best.set, &best.noise, &drivers)?;
        progress("drivers tested");
        let remainder = most_followed(&after).map_or(0.0, |following| following.size);
        let closed = shares::closed(linear, &best.set, &best.noise, remainder)?;
        progress("held out");
        let standing = |cause: &&'static Effect| credible::standing(linear, best, cause);
        let standings = best.set.par_iter().map(standing).collect::<Option<_>>()?;
        progress("alternatives judged");
        Some(Self { drivers, after, closed, standings })
    }

    fn left(&self) -> Option<&Following> {
        most_followed(&self.after)
    }
}

/// The diagnosis of a recording; `None` where a matrix of the fit is singular.
pub fn answer(
    recording: &Recording,
    preparation: &Preparation,
    explained: &Solution<'_>,
    progress: &dyn Fn(&str),
) -> Option<Diagnosis> {
    let tested = Tested::of(explained, progress)?;
    let mut causes = causes(explained, &tested)?;
    let mut remarks = refuted(&mut causes, explained)?;
    causes.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    let apart = reference_clock::candidates(explained.linear.candidates);
    let remainder = tested.left().map_or(0.0, |left| left.size);
    let clock = match &apart {
        Some(apart) => reference_clock::clock(explained, apart, preparation.moved, remainder)?,
        None => None,
    };
    let closed = clock.as_ref().map_or(&tested.closed, |clock| &clock.closed);
    let (mut gap, places) = located(explained, &tested, clock.as_ref(), causes.is_empty())?;
    let mut credible_set = credible_set(explained, &tested)?;
    let is_refuted = !remarks.is_empty();
    if is_refuted {
        credible_set
            .retain(|id| causes.iter().any(|cause| cause.effect == *id || cause.equivalents.contains(id)));
    }
    let found = causes.clone();
    remarks.extend(within_model(&mut causes, &mut credible_set, preparation));
    let evidence = Evidence {
        causes: &found,
        clock: clock.as_ref().map(|clock| &clock.cause),
        closed: if found.is_empty() { closed } else { &tested.closed },
        left: tested.left(),
        refuted: is_refuted,
        within_model: causes.len() < found.len() && causes.is_empty() && clock.is_none(),
        faulty: !preparation.findings.is_empty(),
    };
    let is_closed = (!found.is_empty() || clock.is_some()) && !evidence.within_model;
    let mut total = is_closed.then_some(closed.total);
    if let Some(clock) = &clock {
        put_first(clock, &mut causes, &mut credible_set);
    }
    for finding in preparation.findings.iter().rev() {
        causes.insert(0, fault::cause(finding));
        credible_set.insert(0, finding.effect.id.clone());
    }
    let faults = fault::faults(recording, &preparation.findings, explained);
    fault::add(&faults, closed.explainable, &mut causes, &mut gap, &mut total);
    remarks.extend(preparation.remarks.iter().cloned());
    // Neither is worth the diagnosis where it cannot be computed.
    let next_experiment = next_experiment(recording, explained, &tested).unwrap_or_default();
    let (absent, not_testable) =
        detectability::testable(&explained.linear, &explained.best.set, &explained.best.noise)
            .unwrap_or_default();
    Some(Diagnosis {
        verdict: evidence.verdict(),
        remarks,
        gap,
        places,
        causes,
        credible_set,
        gap_closed_total: total.map(|share| share.value),
        gap_closed_total_ci95: total.map(|share| share.interval),
        held_out: true,
        absent,
        not_testable,
        next_experiment,
        ..untestable(recording, String::new())
    })
}

/// The effects of the best set with their estimates and what each closes of the gap.
fn causes(explained: &Solution<'_>, tested: &Tested) -> Option<Vec<Cause>> {
    let set = explained.best.set.iter().zip(estimates::amounts(explained)?);
    let mut causes = Vec::new();
    for (((effect, amounts), standing), share) in set.zip(&tested.standings).zip(&tested.closed.each) {
        causes.push(Cause {
            effect: effect.id.clone(),
            probability: standing.probability,
            equivalents: standing.equivalents.iter().map(|other| other.id.clone()).collect(),
            material: estimates::is_material(effect, &amounts),
            parameters: amounts,
            gap_closed: Some(share.value),
            gap_closed_ci95: Some(share.interval),
        });
    }
    Some(causes)
}

/// Takes out the causes that held-out data do not confirm, where no rig guides the sensor; remarks on them.
fn refuted(causes: &mut Vec<Cause>, Solution { linear, best, .. }: &Solution<'_>) -> Option<Vec<String>> {
    if linear.scene.swings.is_some() {
        return Some(Vec::new());
    }
    let mut remarks = cross_validation::leave_out(causes, linear, &best.set, &best.noise)?;
    remarks.extend(confounded_episode::leave_out(causes, &linear.scene.blocks));
    Some(remarks)
}

/// Takes out the causes that are no more than errors of the given model; remarks on them.
fn within_model(
    causes: &mut Vec<Cause>,
    credible_set: &mut Vec<String>,
    preparation: &Preparation,
) -> Vec<String> {
    let is_within = |cause: &mut Cause| model_error::errs_as_much(&preparation.model, cause);
    let remark = |cause: Cause| {
        credible_set.retain(|id| *id != cause.effect && !cause.equivalents.contains(id));
        format!("not asserted: {} is within the model's own standard errors", cause.effect)
    };
    causes.extract_if(.., is_within).map(remark).collect()
}

/// The table of the gap, and the covariates that it depends on: before the causes are added, or where there is none, still.
fn located(
    explained: &Solution<'_>,
    tested: &Tested,
    clock: Option<&Clock<'_>>,
    none_found: bool,
) -> Option<(Vec<finding::Gap>, Vec<Place>)> {
    let (linear, set) = match clock {
        Some(clock) => (&clock.linear, &clock.set),
        None => (&explained.linear, &explained.best.set),
    };
    let noise = &explained.best.noise;
    let before = if clock.is_none() && (none_found || explained.best.set.is_empty()) {
        tested.after.clone()
    } else {
        score_test::following(linear, &[], noise, &tested.drivers)?
    };
    Some((shares::table(linear, set, noise)?, places(&before, shares::size(linear, set, noise)?)))
}

/// Ids of the effects that the data leave possible, each once.
fn credible_set(Solution { linear, best, .. }: &Solution<'_>, tested: &Tested) -> Option<Vec<String>> {
    let suspects = if best.set.is_empty() { credible::suspects(linear, best)? } else { Vec::new() };
    let mut ids: Vec<String> = Vec::new();
    for effect in tested.standings.iter().flat_map(|standing| &standing.set).chain(&suspects) {
        if !ids.contains(&effect.id) {
            ids.push(effect.id.clone());
        }
    }
    Some(ids)
}

/// Names the offset of a reference's clock first: the other causes were judged with it in the baseline, and what they
/// close is now a share of the gap that it is a part of.
fn put_first(clock: &Clock<'_>, causes: &mut Vec<Cause>, credible_set: &mut Vec<String>) {
    for cause in causes.iter_mut() {
        let mut shares = clock.set.iter().zip(&clock.closed.each);
        let share = shares.find(|(effect, _)| effect.id == cause.effect).map(|(_, share)| *share);
        (cause.gap_closed, cause.gap_closed_ci95) = (share.map(|s| s.value), share.map(|s| s.interval));
    }
    causes.insert(0, clock.cause.clone());
    credible_set.insert(0, clock.cause.effect.clone());
}

/// What to record next to part a cause from those that could stand in its place, on a rig.
fn next_experiment(
    recording: &Recording,
    explained: &Solution<'_>,
    tested: &Tested,
) -> Option<Vec<finding::Experiment>> {
    let axes = movement::axes(recording).ok()?;
    let mut pairs: Vec<(&'static Effect, &'static Effect)> = Vec::new();
    for (cause, standing) in explained.best.set.iter().zip(&tested.standings) {
        pairs.extend(standing.equivalents.iter().map(|other| (*cause, *other)));
    }
    experiment::next(explained, axes, &pairs)
}

fn is_followed(following: &Following, tests: usize) -> bool {
    following.p_value * tests as f64 <= FOLLOWED
}

fn most_followed(all: &[Following]) -> Option<&Following> {
    all.iter().find(|following| is_followed(following, all.len()))
}

/// Covariates that are followed; `explained` is the size of what the causes explain.
fn places(following: &[Following], explained: f64) -> Vec<Place> {
    let explainable = following.iter().map(|f| f.size).fold(explained.max(f64::MIN_POSITIVE), f64::max);
    let place = |f: &Following| Place {
        sensor: f.kind.prefix().to_owned(),
        driver: f.driver.clone(),
        share: (f.size / explainable).min(1.0),
        p_value: (f.p_value * following.len() as f64).min(1.0),
        detail: f.detail.clone(),
    };
    let mut places: Vec<Place> =
        following.iter().filter(|f| is_followed(f, following.len())).map(place).collect();
    places.sort_by(|a, b| b.share.total_cmp(&a.share));
    places
}

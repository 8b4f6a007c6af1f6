//! The diagnosis, put together once from what the search has found.

use rayon::prelude::*;

use super::{
    confounded_episode, credible, cross_validation,
    decision::Evidence,
    detectability, estimates, experiment, fault, model_error, profile,
    reference_clock::{self, Clock},
    reference_error,
    shares::{self, Closed},
};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        finding::{self, Cause, Diagnosis, Place, Verdict},
        library::candidates::Candidates,
        location::{covariate::Covariate, covariates, score_test, score_test::Following},
        reference::{model::Model, movement},
        screening::preparation::Preparation,
        search::{linearisation::Linearisation, stepwise::Solution},
        settings::{LocationSettings, VerdictSettings},
    },
    effect::Effect,
    recording::{Recording, SensorKind},
};

/// A diagnosis that could not be made, and why.
pub fn untestable(recording: &Recording, why: String) -> Diagnosis {
    Diagnosis {
        format: finding::FORMAT.to_owned(),
        recording: recording.name.clone(),
        verdict: Verdict::NotTestable,
        reference: None,
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
        user_effects: Vec::new(),
        proposals: Vec::new(),
        watch: None,
        profiles: Vec::new(),
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
    fn of(
        Solution { linear, best, .. }: &Solution<'_>,
        progress: &dyn Fn(&str),
    ) -> Result<Self, DiagnosisError> {
        let drivers = covariates::drivers(linear.scene, &linear.weighing.given);
        let after = score_test::score_tests_refitted(linear, &best.set, &best.noise, &drivers)?;
        progress("drivers tested");
        let remainder =
            most_followed(&after, &linear.scene.settings.location).map_or(0.0, |following| following.size);
        let closed = shares::closed(linear, &best.set, &best.noise, remainder)?;
        progress("held out");
        let standing = |cause: &&'static Effect| credible::standing(linear, best, cause);
        let standings = best.set.par_iter().map(standing).collect::<Result<_, _>>()?;
        progress("alternatives judged");
        Ok(Self { drivers, after, closed, standings })
    }

    fn left(&self, by: &LocationSettings) -> Option<&Following> {
        most_followed(&self.after, by)
    }

    /// Sensors whose residual follows something.
    fn following(&self, by: &LocationSettings) -> Vec<SensorKind> {
        let follows = |kind: &SensorKind| {
            let mut of_sensor = self.after.iter().filter(|following| following.kind == *kind);
            of_sensor.any(|following| is_followed(following, self.after.len(), by))
        };
        SensorKind::ALL.into_iter().filter(follows).collect()
    }
}

/// The causes that are asserted, and what is said of the others.
struct Asserted {
    causes: Vec<Cause>,
    credible_set: Vec<String>,
    remarks: Vec<String>,
    /// Held-out data have refuted a cause of the search.
    refuted: bool,
}

impl Asserted {
    fn of(explained: &Solution<'_>, tested: &Tested) -> Result<Self, DiagnosisError> {
        let mut causes = causes(explained, tested)?;
        let mut remarks = refuted(&mut causes, explained)?;
        if explained.linear.scene.settings.verdict.outweighs_remainder {
            remarks.extend(outweighed(&mut causes, explained, tested));
        }
        let errors = explained.linear.scene.settings.verdict.reference_errors;
        remarks.extend(reference_error::leave_out(&mut causes, explained, errors));
        causes.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        let mut credible_set = credible_set(explained, tested)?;
        let refuted = !remarks.is_empty();
        if refuted {
            credible_set.retain(|id| {
                causes.iter().any(|cause| cause.effect == *id || cause.equivalents.contains(id))
            });
        }
        Ok(Self { causes, credible_set, remarks, refuted })
    }

    /// Takes out the causes that are no more than errors of the given model.
    fn take_out_errors(&mut self, model: &Model, by: &VerdictSettings) {
        let is_within = |cause: &mut Cause| model_error::errs_as_much(model, cause, by.detectable);
        let credible_set = &mut self.credible_set;
        let remark = |cause: Cause| {
            credible_set.retain(|id| *id != cause.effect && !cause.equivalents.contains(id));
            format!("not asserted: {} is within the model's own standard errors", cause.effect)
        };
        self.remarks.extend(self.causes.extract_if(.., is_within).map(remark));
    }

    /// Takes out the causes that close less than a share of the gap once the clock's terms are a part of it, or perhaps nothing:
    /// errors of a reference go with the attitude, too. Terms that were taken out of the baseline stay: every sensor has them.
    fn take_out_smallest(&mut self, least: f64, candidates: &Candidates) {
        let was_taken_out = |id: &str| candidates.taken_out.iter().any(|term| term.id == id);
        let is_small = |cause: &mut Cause| {
            let may_be_nothing = least > 0.0 && cause.gap_closed_ci95.is_some_and(|[from, _]| from <= 0.0);
            (may_be_nothing || cause.gap_closed.is_some_and(|share| share < least))
                && !was_taken_out(&cause.effect)
        };
        let credible_set = &mut self.credible_set;
        let remark = |cause: Cause| {
            credible_set.retain(|id| *id != cause.effect && !cause.equivalents.contains(id));
            small(&cause.effect, cause.gap_closed.unwrap_or(0.0), cause.gap_closed_ci95)
        };
        self.remarks.extend(self.causes.extract_if(.., is_small).map(remark));
    }

    /// Puts a cause before all others.
    fn put_first(&mut self, cause: Cause) {
        self.credible_set.insert(0, cause.effect.clone());
        self.causes.insert(0, cause);
    }

    /// A part of the diagnosis, or a remark on why it is left out.
    fn part<T: Default>(&mut self, name: &str, part: Result<T, DiagnosisError>) -> T {
        part.unwrap_or_else(|why| {
            self.remarks.push(format!("{name} is left out: {why}"));
            T::default()
        })
    }
}

/// A diagnosis, and what it leaves.
pub struct Answer {
    /// The diagnosis.
    pub diagnosis: Diagnosis,
    /// Sensors whose residual still follows something.
    pub following: Vec<SensorKind>,
}

/// The diagnosis of a recording.
///
/// # Errors
///
/// The stage that failed; a table or a next experiment that cannot be computed is left out with a remark.
pub fn answer(
    recording: &Recording,
    preparation: &Preparation,
    explained: &Solution<'_>,
    progress: &dyn Fn(&str),
) -> Result<Answer, DiagnosisError> {
    let tested = Tested::of(explained, progress)?;
    let settings = explained.linear.scene.settings;
    let left = tested.left(&settings.location);
    let mut asserted = Asserted::of(explained, &tested)?;
    let found = asserted.causes.clone();
    let remainder = left.map_or(0.0, |left| left.size);
    let terms = reference_clock::terms(explained, preparation.clock)?;
    let apart = reference_clock::candidates(explained.linear.candidates, &terms);
    let clock = match &apart {
        Some(apart) => reference_clock::clock(explained, apart, &terms, &found, remainder)?,
        None => None,
    };
    let closed = clock.as_ref().map_or(&tested.closed, |clock| &clock.closed);
    let places = located(explained, &tested, clock.as_ref(), found.is_empty())?;
    let mut gap = asserted.part("the table of the gap", table(explained, clock.as_ref()));
    let profiles =
        asserted.part("the profile of the gap", profiles(explained, &tested, clock.as_ref(), &places));
    asserted.take_out_errors(&preparation.model, &settings.verdict);
    let evidence = Evidence {
        causes: &found,
        clock: clock.as_ref().map_or(&[], |clock| &clock.causes),
        closed: if found.is_empty() { closed } else { &tested.closed },
        // Along a stream, which holds what is sensed itself, the clock's share hides the rest; a reference on the body has errors
        // of its own, which are small against it.
        explainable: match settings.source.followed || !found.is_empty() {
            true => tested.closed.explainable,
            false => closed.explainable,
        },
        left,
        refuted: asserted.refuted,
        within_model: !found.is_empty() && asserted.causes.is_empty() && clock.is_none(),
        faulty: !preparation.findings.is_empty(),
    };
    let is_closed = (!found.is_empty() || clock.is_some()) && !evidence.within_model;
    let mut total = is_closed.then_some(closed.total);
    if let Some(clock) = &clock {
        share_with(clock, &mut asserted.causes);
        asserted.take_out_smallest(settings.verdict.least_of_all, explained.linear.candidates);
        clock.causes.iter().rev().for_each(|cause| asserted.put_first(cause.clone()));
    }
    preparation.findings.iter().rev().for_each(|finding| asserted.put_first(fault::cause(finding)));
    let faults = fault::faults(recording, &preparation.findings, explained);
    fault::add(&faults, closed.explainable, &mut asserted.causes, &mut gap, &mut total);
    asserted.remarks.extend(preparation.remarks.iter().cloned());
    let (linear, best) = (&explained.linear, &explained.best);
    let testable = detectability::testable(linear, &best.set, &best.noise);
    let (absent, not_testable) = asserted.part("what is absent or not testable", testable);
    let diagnosis = Diagnosis {
        verdict: evidence.verdict(&settings.verdict),
        remarks: asserted.remarks,
        gap,
        places,
        profiles,
        causes: asserted.causes,
        credible_set: asserted.credible_set,
        gap_closed_total: total.map(|share| share.value),
        gap_closed_total_ci95: total.map(|share| share.interval),
        held_out: true,
        absent,
        not_testable,
        next_experiment: next_experiment(recording, explained, &tested).unwrap_or_default(),
        ..untestable(recording, String::new())
    };
    Ok(Answer { diagnosis, following: tested.following(&settings.location) })
}

/// The effects of the best set with their estimates and what each closes of the gap.
fn causes(explained: &Solution<'_>, tested: &Tested) -> Result<Vec<Cause>, DiagnosisError> {
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
    Ok(causes)
}

/// Takes out the causes that held-out data do not confirm, where these are asked; remarks on them.
fn refuted(
    causes: &mut Vec<Cause>,
    Solution { linear, best, .. }: &Solution<'_>,
) -> Result<Vec<String>, DiagnosisError> {
    let by = &linear.scene.settings.verdict;
    if !by.confirms_held_out {
        return Ok(Vec::new());
    }
    let mut remarks = cross_validation::leave_out(causes, linear, &best.set, &best.noise)?;
    remarks.extend(confounded_episode::leave_out(causes, &linear.scene.blocks, by.carried));
    Ok(remarks)
}

fn small(effect: &str, share: f64, interval: Option<[f64; 2]>) -> String {
    let perhaps = match interval {
        Some([from, _]) if from <= 0.0 => ", and perhaps nothing of it",
        _ => "",
    };
    format!("not asserted: {effect} closes {:.1} % of the gap{perhaps}", 100.0 * share)
}

/// Takes out the causes that explain less of a sensor than what its residual still follows, or next to nothing of the gap, unless
/// every sensor has them; remarks on them.
fn outweighed(causes: &mut Vec<Cause>, explained: &Solution<'_>, tested: &Tested) -> Vec<String> {
    let settings = explained.linear.scene.settings;
    let remark = |cause: &Cause| {
        let at = explained.best.set.iter().position(|effect| effect.id == cause.effect)?;
        let share = tested.closed.each.get(at)?.value;
        if explained.linear.candidates.was_taken_out(explained.best.set[at]) {
            return None;
        }
        if share < settings.verdict.least_of_all {
            return Some(small(&cause.effect, share, None));
        }
        let own = share * tested.closed.explainable;
        let reach = explained.linear.scene.reach(explained.best.set[at]);
        let is_more = |f: &&Following| {
            reach.contains(&f.kind) && f.size > own && is_followed(f, tested.after.len(), &settings.location)
        };
        let most = tested.after.iter().filter(is_more).max_by(|a, b| a.size.total_cmp(&b.size))?;
        Some(format!(
            "not asserted: {} explains less of the {} than its residual still follows ({}), which no effect explains",
            cause.effect, most.kind, most.driver
        ))
    };
    let remarks: Vec<Option<String>> = causes.iter().map(remark).collect();
    let mut out = remarks.iter().map(Option::is_some);
    causes.retain(|_| !out.next().unwrap_or(false));
    remarks.into_iter().flatten().collect()
}

/// The table of the gap.
fn table(explained: &Solution<'_>, clock: Option<&Clock<'_>>) -> Result<Vec<finding::Gap>, DiagnosisError> {
    let (linear, set) = seen_from(explained, clock);
    shares::table(linear, set, &explained.best.noise)
}

/// The residual over what each sensor follows most.
fn profiles(
    explained: &Solution<'_>,
    tested: &Tested,
    clock: Option<&Clock<'_>>,
    places: &[Place],
) -> Result<Vec<finding::Profile>, DiagnosisError> {
    let (linear, set) = seen_from(explained, clock);
    profile::profiles(linear, set, &explained.best.noise, &tested.drivers, places)
}

/// The covariates that the gap depends on: before the causes are added, or where there is none, still.
fn located(
    explained: &Solution<'_>,
    tested: &Tested,
    clock: Option<&Clock<'_>>,
    none_found: bool,
) -> Result<Vec<Place>, DiagnosisError> {
    let (linear, set) = seen_from(explained, clock);
    let noise = &explained.best.noise;
    let before = if clock.is_none() && (none_found || explained.best.set.is_empty()) {
        tested.after.clone()
    } else {
        score_test::following(linear, &[], noise, &tested.drivers)?
    };
    Ok(places(&before, shares::size(linear, set, noise)?, &linear.scene.settings.location))
}

/// The problem and the set that the gap is seen from: with the terms of a clock among the effects, where they are such.
fn seen_from<'e>(
    explained: &'e Solution<'e>,
    clock: Option<&'e Clock<'e>>,
) -> (&'e Linearisation<'e>, &'e [&'static Effect]) {
    match clock {
        Some(clock) => (&clock.linear, &clock.set),
        None => (&explained.linear, &explained.best.set),
    }
}

/// Ids of the effects that the data leave possible, each once.
fn credible_set(
    Solution { linear, best, .. }: &Solution<'_>,
    tested: &Tested,
) -> Result<Vec<String>, DiagnosisError> {
    let suspects = if best.set.is_empty() { credible::suspects(linear, best)? } else { Vec::new() };
    let mut ids: Vec<String> = Vec::new();
    for effect in tested.standings.iter().flat_map(|standing| &standing.set).chain(&suspects) {
        if !ids.contains(&effect.id) {
            ids.push(effect.id.clone());
        }
    }
    Ok(ids)
}

/// The causes were judged with the clock's terms in the baseline: what they close is now a share of the gap that these are
/// a part of.
fn share_with(clock: &Clock<'_>, causes: &mut [Cause]) {
    for cause in causes {
        let mut shares = clock.set.iter().zip(&clock.closed.each);
        let share = shares.find(|(effect, _)| effect.id == cause.effect).map(|(_, share)| *share);
        (cause.gap_closed, cause.gap_closed_ci95) = (share.map(|s| s.value), share.map(|s| s.interval));
    }
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
        // What is the same here has no columns of its own.
        let is_fitted = |other: &&&'static Effect| explained.linear.candidates.effects.contains(*other);
        pairs.extend(standing.equivalents.iter().filter(is_fitted).map(|other| (*cause, *other)));
    }
    experiment::next(explained, axes, &pairs)
}

fn is_followed(following: &Following, tests: usize, by: &LocationSettings) -> bool {
    following.p_value * tests as f64 <= by.p_value
}

fn most_followed<'f>(all: &'f [Following], by: &LocationSettings) -> Option<&'f Following> {
    all.iter().find(|following| is_followed(following, all.len(), by))
}

/// Covariates that are followed; `explained` is the size of what the causes explain.
fn places(following: &[Following], explained: f64, by: &LocationSettings) -> Vec<Place> {
    let explainable = following.iter().map(|f| f.size).fold(explained.max(f64::MIN_POSITIVE), f64::max);
    let place = |f: &Following| Place {
        sensor: f.kind.prefix().to_owned(),
        driver: f.driver.clone(),
        share: (f.size / explainable).min(1.0),
        p_value: (f.p_value * following.len() as f64).min(1.0),
        detail: f.detail.clone(),
    };
    let mut places: Vec<Place> =
        following.iter().filter(|f| is_followed(f, following.len(), by)).map(place).collect();
    places.sort_by(|a, b| b.share.total_cmp(&a.share));
    places
}

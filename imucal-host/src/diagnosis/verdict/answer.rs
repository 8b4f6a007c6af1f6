//! The diagnosis, put together once from what the search has found.

use super::{
    asserted::Asserted,
    decision::Evidence,
    detectability, experiment, fault, profile,
    reference_clock::{self, Clock},
    shares, swallowed,
    tested::{Tested, places},
};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        finding::{self, Cause, Diagnosis, Place, Verdict},
        location::score_test,
        reference::movement,
        screening::preparation::Preparation,
        search::{linearisation::Linearisation, stepwise::Solution},
    },
    effect::{Effect, Role},
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
    let terms = reference_clock::terms(explained, &preparation.clock)?;
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
    let swallowed = if settings.source.followed { swallowed::remarks(recording, &gap) } else { Vec::new() };
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
        opposite: !explained.idle.is_empty(),
        within_model: !found.is_empty() && asserted.causes.is_empty() && clock.is_none(),
        faulty: !preparation.findings.is_empty(),
        swallowed: !swallowed.is_empty(),
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
    asserted.remarks.extend(opposite(&explained.idle));
    asserted.remarks.extend(swallowed);
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

/// What is said of effects that a fit took at no size.
fn opposite(idle: &[&'static Effect]) -> Vec<String> {
    let has_one_sign = |effect: &&&'static Effect| {
        effect
            .parameters
            .iter()
            .any(|parameter| parameter.role == Role::Amplitude && parameter.range.0 >= 0.0)
    };
    let (one_sided, others): (Vec<_>, Vec<_>) = idle.iter().partition(has_one_sign);
    let listed = |effects: &[&&'static Effect], by: &str| -> String {
        effects.iter().map(|effect| effect.id.as_str()).collect::<Vec<_>>().join(by)
    };
    let negative = (!one_sided.is_empty()).then(|| {
        format!(
            "the data show the opposite of {}, which cannot be negative: it is left out, and its part of the gap stays open; of a filter \
             or a delay that is a sensor which is ahead of the others, or late in the simulator",
            listed(&one_sided, " and of ")
        )
    });
    let without_size = (!others.is_empty()).then(|| {
        format!(
            "not asserted: {}: fitted with the other causes, no size of it is left",
            listed(&others, ", ")
        )
    });
    negative.into_iter().chain(without_size).collect()
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

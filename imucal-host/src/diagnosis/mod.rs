//! Where the gap between simulator and recording lies, which unmodelled effect causes it, and how far it shrinks.

pub mod block;
pub mod bordered;
mod borne;
pub mod candidates;
mod carried;
pub mod convention;
pub mod credible;
pub mod design;
pub mod driver;
mod eliminated;
pub mod estimate;
pub mod evidence;
pub mod experiment;
pub mod fault;
pub mod finding;
pub mod following;
pub mod footing;
pub mod frequency;
pub mod gap;
mod gram;
pub mod hand;
pub mod latent;
mod latest;
pub mod likelihood;
pub mod linear;
pub mod model;
mod moves;
pub mod nodes;
pub mod noise;
pub mod orientation;
pub mod reference_clock;
pub mod refit;
pub mod revisits;
mod scan;
pub mod scanned;
pub mod scatter;
pub mod scene;
pub mod search;
pub mod shape;
mod skyline;
pub mod start;
pub mod testable;
pub mod together;
mod unsteady;
mod white;
pub mod whitening;

use rayon::prelude::*;

pub use self::finding::{Diagnosis, Verdict};
use self::{
    candidates::{Candidates, Setting},
    finding::{Cause, Place as Driven},
    following::Following,
    footing::Footing,
    linear::{Judged, Linear},
    reference_clock::Clock,
    scene::Scene,
    search::Explained,
};
use crate::{effect::Effect, recording::Recording, store::StoredCalibration};

/// A driver is followed when noise alone would do as much less often than this, all tests counted.
const FOLLOWED: f64 = 0.01;
/// A remainder below this share of the explainable gap does not matter.
const REMAINDER: f64 = 0.05;
/// Causes that close less than this share of it explain nothing.
const EXPLAINS: f64 = 0.2;

/// What a diagnosis may be told beforehand.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Catalogue entries to be withheld from the candidates, and terms to be taken out of the baseline.
    pub without: Vec<String>,
    /// The simulator's present model of the unit; without it, the baseline is calibrated from the recording.
    pub model: Option<StoredCalibration>,
}

/// Diagnoses a recording; `progress` hears of each stage.
pub fn diagnose(recording: &Recording, options: &Options, progress: &dyn Fn(&str)) -> Diagnosis {
    let footing = match Footing::new(recording, options.model.as_ref()) {
        Ok(footing) => footing,
        Err(why) => return untestable(recording, why),
    };
    let mut scene = Scene::new(recording, footing.usable.clone(), &*footing.movement, footing.triads);
    if let Some(held) = &footing.held {
        scene = scene.through(held);
    }
    scene = scene.without_passages();
    let setting = Setting {
        kinds: &scene.kinds,
        thermometer: recording.temperature.is_some(),
        calibrated: &footing.model.calibrated,
        gimbals: scene.swings.is_some(),
        hand: footing.held.is_some(),
        field_known: recording.manifest.site.field_ned_ut.is_some(),
    };
    let candidates = Candidates::new(&setting, &options.without);
    let explained = search::search(&scene, &candidates, progress);
    let answered = explained.as_ref().and_then(|explained| {
        let (diagnosis, explainable) = answer(recording, explained, footing.moved, progress)?;
        let mut diagnosis = with_faults(beyond_model(diagnosis, &footing.model), &footing);
        fault::tell(&mut diagnosis, &fault::faults(recording, &footing.findings, explained), explainable);
        Some(diagnosis)
    });
    match answered {
        Some(diagnosis) => diagnosis,
        None => untestable(recording, "the baseline cannot be fitted to this recording".to_owned()),
    }
}

/// Takes out what a model made elsewhere does not know better itself.
fn beyond_model(mut diagnosis: Diagnosis, model: &model::Model) -> Diagnosis {
    let out: Vec<Cause> = diagnosis.causes.extract_if(.., |cause| model.errs_as_much(cause)).collect();
    for cause in &out {
        diagnosis.credible_set.retain(|id| *id != cause.effect && !cause.equivalents.contains(id));
        diagnosis
            .remarks
            .push(format!("not asserted: {} is within the model's own standard errors", cause.effect));
    }
    let explained = matches!(diagnosis.verdict, Verdict::Explained | Verdict::Ambiguous);
    if !out.is_empty() && diagnosis.causes.is_empty() {
        (diagnosis.gap_closed_total, diagnosis.gap_closed_total_ci95) = (None, None);
        diagnosis.verdict = if explained { Verdict::None } else { Verdict::Unknown };
    }
    diagnosis
}

/// Adds what was wrong with the recording itself: that is certain, and comes first.
fn with_faults(mut diagnosis: Diagnosis, footing: &Footing) -> Diagnosis {
    for finding in footing.findings.iter().rev() {
        diagnosis.causes.insert(
            0,
            Cause {
                effect: finding.effect.id.clone(),
                probability: 1.0 - finding.p_value,
                equivalents: Vec::new(),
                parameters: finding.parameters.clone(),
                material: true,
                gap_closed: None,
                gap_closed_ci95: None,
            },
        );
        diagnosis.credible_set.insert(0, finding.effect.id.clone());
    }
    if !footing.findings.is_empty() && diagnosis.verdict == Verdict::None {
        diagnosis.verdict = Verdict::Explained;
    }
    diagnosis.remarks.extend(footing.remarks.iter().cloned());
    diagnosis
}

fn untestable(recording: &Recording, why: String) -> Diagnosis {
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

/// What the search has found, and the whitened squared size of the gap that can be explained.
fn answer(
    recording: &Recording,
    explained: &Explained<'_>,
    moved: f64,
    progress: &dyn Fn(&str),
) -> Option<(Diagnosis, f64)> {
    let (linear, best) = (&explained.linear, &explained.best);
    let drivers = driver::drivers(linear.scene, &linear.weighing.given);
    let after = following::following_anew(linear, &best.set, &best.noise, &drivers)?;
    let before = match best.set.as_slice() {
        [] => after.clone(),
        _ => following::following(linear, &[], &best.noise, &drivers)?,
    };
    progress("drivers tested");
    let left = after.iter().find(|f| is_followed(f, after.len()));
    let closed = gap::closed(linear, &best.set, &best.noise, left.map_or(0.0, |f| f.size))?;
    progress("held out");
    let standings: Vec<credible::Standing> =
        best.set.par_iter().map(|cause| credible::standing(linear, best, cause)).collect::<Option<_>>()?;
    progress("alternatives judged");
    let mut causes = causes(explained, &standings, &closed)?;
    let remarks = match linear.scene.swings {
        Some(_) => Vec::new(),
        None => {
            let mut remarks = borne::leave_out(&mut causes, linear, &best.set, &best.noise)?;
            remarks.extend(carried::leave_out(&mut causes, &linear.scene.blocks));
            remarks
        }
    };
    let apart = reference_clock::candidates(linear.candidates);
    let remainder = left.map_or(0.0, |f| f.size);
    let clock = match &apart {
        Some(apart) => reference_clock::clock(explained, apart, moved, remainder)?,
        None => None,
    };
    causes.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    let mut credible_set = credible_set(linear, best, &standings)?;
    let pairs: Vec<(&'static Effect, &'static Effect)> = best
        .set
        .iter()
        .zip(&standings)
        .flat_map(|(cause, standing)| standing.equivalents.iter().map(|other| (*cause, *other)))
        .collect();
    let next_experiment = match footing::axes(recording) {
        Ok(axes) => experiment::next(explained, axes, &pairs)?,
        Err(_) => Vec::new(),
    };
    let (absent, not_testable) = testable::testable(linear, &best.set, &best.noise)?;
    let found = !causes.is_empty();
    if !remarks.is_empty() {
        credible_set
            .retain(|id| causes.iter().any(|cause| cause.effect == *id || cause.equivalents.contains(id)));
    }
    let is_judged = remarks.is_empty();
    let own = match (is_judged, found) {
        (true, _) => verdict(&causes, left, &closed),
        (false, true) => Verdict::Partly,
        (false, false) => Verdict::Unknown,
    };
    let mut diagnosis = Diagnosis {
        verdict: own,
        remarks,
        gap: gap::table(linear, &best.set, &best.noise)?,
        places: places(if found { &before } else { &after }, gap::size(linear, &best.set, &best.noise)?),
        causes,
        credible_set,
        gap_closed_total: found.then_some(closed.total.value),
        gap_closed_total_ci95: found.then_some(closed.total.interval),
        held_out: true,
        absent,
        not_testable,
        next_experiment,
        ..untestable(recording, String::new())
    };
    let Some(clock) = clock else { return Some((diagnosis, closed.explainable)) };
    let explainable = clock.closed.explainable;
    let places_before = following::following(&clock.linear, &[], &best.noise, &drivers)?;
    diagnosis.gap = gap::table(&clock.linear, &clock.set, &best.noise)?;
    diagnosis.places = places(&places_before, gap::size(&clock.linear, &clock.set, &best.noise)?);
    if !found {
        let alone = std::slice::from_ref(&clock.cause);
        diagnosis.verdict = if is_judged { verdict(alone, left, &clock.closed) } else { Verdict::Partly };
    }
    with_clock(&mut diagnosis, clock);
    Some((diagnosis, explainable))
}

/// The effects of the best set with their estimates and what each closes of the gap.
fn causes(
    explained: &Explained<'_>,
    standings: &[credible::Standing],
    closed: &gap::Closed,
) -> Option<Vec<Cause>> {
    let set = explained.best.set.iter().zip(estimate::amounts(explained)?);
    let mut causes = Vec::new();
    for (((effect, amounts), standing), share) in set.zip(standings).zip(&closed.each) {
        causes.push(Cause {
            effect: effect.id.clone(),
            probability: standing.probability,
            equivalents: standing.equivalents.iter().map(|other| other.id.clone()).collect(),
            material: estimate::is_material(effect, &amounts),
            parameters: amounts,
            gap_closed: Some(share.value),
            gap_closed_ci95: Some(share.interval),
        });
    }
    Some(causes)
}

/// Ids of the effects that the data leave possible, each once.
fn credible_set(linear: &Linear<'_>, best: &Judged, standings: &[credible::Standing]) -> Option<Vec<String>> {
    let suspects = if best.set.is_empty() { credible::suspects(linear, best)? } else { Vec::new() };
    let mut ids: Vec<String> = Vec::new();
    for effect in standings.iter().flat_map(|standing| &standing.set).chain(&suspects) {
        if !ids.contains(&effect.id) {
            ids.push(effect.id.clone());
        }
    }
    Some(ids)
}

/// Names the offset of a reference's clock first: the other causes were judged with it in the baseline, and what they
/// close is now a share of the gap that it is a part of.
fn with_clock(diagnosis: &mut Diagnosis, clock: Clock<'_>) {
    for cause in &mut diagnosis.causes {
        let mut shares = clock.set.iter().zip(&clock.closed.each);
        let share = shares.find(|(effect, _)| effect.id == cause.effect).map(|(_, share)| *share);
        (cause.gap_closed, cause.gap_closed_ci95) = (share.map(|s| s.value), share.map(|s| s.interval));
    }
    diagnosis.gap_closed_total = Some(clock.closed.total.value);
    diagnosis.gap_closed_total_ci95 = Some(clock.closed.total.interval);
    diagnosis.credible_set.insert(0, clock.cause.effect.clone());
    diagnosis.causes.insert(0, clock.cause);
}

fn is_followed(following: &Following, tests: usize) -> bool {
    following.p_value * tests as f64 <= FOLLOWED
}

fn verdict(causes: &[Cause], left: Option<&Following>, closed: &gap::Closed) -> Verdict {
    let remainder = left.map_or(0.0, |f| f.size) / closed.explainable;
    match (causes, left) {
        ([], None) => Verdict::None,
        ([], Some(_)) => Verdict::Unknown,
        (_, Some(_)) if closed.total.value < EXPLAINS => Verdict::Unknown,
        (_, Some(_)) if remainder > REMAINDER => Verdict::Partly,
        _ if causes.iter().any(|cause| !cause.equivalents.is_empty()) => Verdict::Ambiguous,
        _ => Verdict::Explained,
    }
}

/// Drivers that are followed; `explained` is the size of what the causes explain.
fn places(following: &[Following], explained: f64) -> Vec<Driven> {
    let explainable = following.iter().map(|f| f.size).fold(explained.max(f64::MIN_POSITIVE), f64::max);
    let mut places: Vec<Driven> = following
        .iter()
        .filter(|f| is_followed(f, following.len()))
        .map(|f| Driven {
            sensor: f.kind.prefix().to_owned(),
            driver: f.driver.clone(),
            share: (f.size / explainable).min(1.0),
            p_value: (f.p_value * following.len() as f64).min(1.0),
            detail: f.detail.clone(),
        })
        .collect();
    places.sort_by(|a, b| b.share.total_cmp(&a.share));
    places
}

#[cfg(test)]
mod tests;

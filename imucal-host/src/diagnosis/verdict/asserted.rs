//! The causes that are asserted: those of the best set, less what held-out data, the reference or the model refute.

use super::{
    confounded_episode, credible, cross_validation, estimates, model_error, reference_error,
    tested::{Tested, is_followed},
};
use crate::{
    diagnosis::{
        error::DiagnosisError, finding::Cause, library::candidates::Candidates,
        location::score_test::Following, reference::model::Model, search::stepwise::Solution,
        settings::VerdictSettings,
    },
    effect::Effect,
};

/// A cause is not asserted that is, together with what is the same here, less probable.
const IMPROBABLE: f64 = 0.05;

/// The causes that are asserted, and what is said of the others.
pub(super) struct Asserted {
    pub(super) causes: Vec<Cause>,
    pub(super) credible_set: Vec<String>,
    pub(super) remarks: Vec<String>,
    /// Held-out data have refuted a cause of the search.
    pub(super) refuted: bool,
}

impl Asserted {
    pub(super) fn of(explained: &Solution<'_>, tested: &Tested) -> Result<Self, DiagnosisError> {
        let mut causes = causes(explained, tested)?;
        let mut remarks = refuted(&mut causes, explained)?;
        remarks.extend(improbable(&mut causes));
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
    pub(super) fn take_out_errors(&mut self, model: &Model, by: &VerdictSettings) {
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
    pub(super) fn take_out_smallest(&mut self, least: f64, candidates: &Candidates) {
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
    pub(super) fn put_first(&mut self, cause: Cause) {
        self.credible_set.insert(0, cause.effect.clone());
        self.causes.insert(0, cause);
    }

    /// A part of the diagnosis, or a remark on why it is left out.
    pub(super) fn part<T: Default>(&mut self, name: &str, part: Result<T, DiagnosisError>) -> T {
        part.unwrap_or_else(|why| {
            self.remarks.push(format!("{name} is left out: {why}"));
            T::default()
        })
    }
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

/// Takes out the causes that are not likely once all others are fitted; remarks on them.
fn improbable(causes: &mut Vec<Cause>) -> Vec<String> {
    let remark = |cause: Cause| {
        let percent = 100.0 * cause.probability;
        format!(
            "not asserted: {} has a probability of {percent:.1} % once the others are fitted",
            cause.effect
        )
    };
    let is_improbable =
        |cause: &mut Cause| cause.probability * (1 + cause.equivalents.len()) as f64 <= IMPROBABLE;
    causes.extract_if(.., is_improbable).map(remark).collect()
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
    remarks.extend(implausible(causes, &best.set));
    remarks.extend(confounded_episode::leave_out(causes, &linear.scene.blocks, by.carried));
    Ok(remarks)
}

/// Takes out the causes that would have to be implausibly large; what they explain is a gap of an unknown cause.
fn implausible(causes: &mut Vec<Cause>, set: &[&'static Effect]) -> Vec<String> {
    let is_implausible = |cause: &mut Cause| {
        let effect = set.iter().find(|effect| effect.id == cause.effect);
        effect.is_some_and(|effect| !estimates::is_plausible(effect, &cause.parameters))
    };
    let remark =
        |cause: Cause| format!("not asserted, since it would have to be implausibly large: {}", cause.effect);
    causes.extract_if(.., is_implausible).map(remark).collect()
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

//! What a missing effect looks like: for each sensor that still follows something, the one formula that explains it, or why
//! there is none.

use super::{
    constancy, entry,
    finalists::{self, Finalist},
    grammar::{self, Held},
    null_threshold,
    problem::{Problem, Weighed},
    term::{Driver, Formulated},
    trial::{Joined, Tried},
};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        finding::{Amount, Diagnosis, Proposal, ProposalStatus, Verdict},
        location::{covariate::Covariate, covariates},
        mixed_model::noise::NEAR,
        residual::base_run::Reference,
        search::stepwise::Solution,
        settings::ProposalSettings,
    },
    effect::{Effect, XYZ},
    recording::SensorKind,
};

/// What all sensors have in common.
struct Setting<'a, 's> {
    explained: &'a Solution<'s>,
    reference: Reference<'a>,
    drivers: Vec<Covariate>,
    held: Held,
    origin: &'a str,
}

/// What a formula is added to: a set of effects, and the fit of one sensor with it.
struct Start<'a, 's> {
    problem: Problem<'a, 's>,
    before: Weighed,
    /// ln of the probability of the data with the set, its prior included.
    value: f64,
}

/// Proposes formulas where a diagnosis leaves a gap unexplained, at most one a sensor; and remarks on sensors for which there
/// is none. `following` are the sensors whose residual follows something.
///
/// # Errors
///
/// [`DiagnosisError`], of a stage that failed.
pub fn proposed(
    explained: &Solution<'_>,
    diagnosis: &Diagnosis,
    following: &[SensorKind],
    progress: &dyn Fn(&str),
) -> Result<(Vec<Proposal>, Vec<String>), DiagnosisError> {
    let scene = explained.linear.scene;
    let is_asked = matches!(diagnosis.verdict, Verdict::Unknown | Verdict::Partly);
    // Without a table the movement is made of the sensors' own rests, and holds no input that is not theirs.
    if !is_asked || !scene.settings.source.table {
        return Ok(Default::default());
    }
    let temperature = scene.recording.temperature.as_ref().map(|rows| {
        let known = || rows.iter().filter(|value| value.is_finite());
        known().sum::<f64>() / known().count().max(1) as f64
    });
    let setting = Setting {
        explained,
        reference: Reference::new(scene, explained.fit.doses.clone(), &scene.fine)?,
        drivers: covariates::drivers(scene, &explained.linear.weighing.given),
        held: Held {
            gimbals: scene.swings.is_some(),
            temperature,
            field: scene.settings.source.gives_field() && scene.kinds.contains(&SensorKind::Mag),
        },
        origin: &diagnosis.recording,
    };
    let asserted = asserted(explained, diagnosis);
    let (mut proposals, mut remarks) = (Vec::new(), Vec::new());
    let is_open = |kind: &SensorKind| following.contains(kind) || has_effect(*kind, explained);
    for kind in scene.kinds.iter().copied().filter(is_open) {
        match setting.of_sensor(kind, &asserted)? {
            Ok(proposal) => proposals.push(proposal),
            Err(remark) => remarks.push(remark),
        }
        progress("formulas tried");
    }
    Ok((proposals, remarks))
}

/// The effects of the search that are asserted as causes.
pub fn asserted(explained: &Solution<'_>, diagnosis: &Diagnosis) -> Vec<&'static Effect> {
    let is_cause = |effect: &&&'static Effect| diagnosis.causes.iter().any(|cause| cause.effect == effect.id);
    explained.best.set.iter().filter(is_cause).copied().collect()
}

/// The search has found an effect of this sensor alone.
fn has_effect(kind: SensorKind, explained: &Solution<'_>) -> bool {
    explained.best.set.iter().any(|effect| explained.linear.scene.reach(effect) == [kind])
}

impl<'s> Setting<'_, 's> {
    fn settings(&self) -> &ProposalSettings {
        &self.explained.linear.scene.settings.proposal
    }

    /// The proposal for a sensor, or a sentence on why there is none.
    fn of_sensor(
        &self,
        kind: SensorKind,
        asserted: &[&'static Effect],
    ) -> Result<Result<Proposal, String>, DiagnosisError> {
        let mut starts = vec![self.start(kind, Vec::new())?];
        if asserted.iter().any(|effect| self.explained.linear.scene.reach(effect).contains(&kind)) {
            starts.push(self.start(kind, asserted.to_vec())?);
        }
        let largest = |driver: &Driver| largest(&starts[0].problem, driver);
        let formulas = grammar::formulas(kind, self.held, &largest);
        let cost = (formulas.len() as f64).ln();
        let mut best: Option<(f64, &Start<'_, '_>, Finalist)> = None;
        for start in &starts {
            let found = finalists::best(&start.problem, &self.reference, &start.before, &formulas)?;
            let Some(found) = found else { continue };
            let value = start.value + found.best.gain;
            if best.as_ref().is_none_or(|(most, ..)| value > *most) {
                best = Some((value, start, found));
            }
        }
        let none = || Err(format!("the {kind} follows something for which no formula was found"));
        let Some((_, start, found)) = best else { return Ok(none()) };
        let gain = found.best.gain - cost;
        if gain <= self.settings().least_gain {
            return Ok(none());
        }
        let threshold = null_threshold::threshold(&start.problem, &formulas, &start.before.noise)?;
        if found.best.gain <= threshold {
            return Ok(none());
        }
        self.accepted(start, &found, &formulas, gain)
    }

    fn start(&self, kind: SensorKind, set: Vec<&'static Effect>) -> Result<Start<'_, 's>, DiagnosisError> {
        let (linear, noise) = (&self.explained.linear, &self.explained.best.noise);
        let problem = Problem::new(linear, &self.reference, kind, linear.fitted(&set))?;
        let before = problem.weighed(&problem.design, &[], noise)?;
        let value = linear.screen(&set, noise, &[kind], &NEAR)?.value;
        Ok(Start { problem, before, value })
    }

    /// The formula as a proposal, if held-out stretches bear it out and nothing is followed beside it.
    fn accepted(
        &self,
        start: &Start<'_, '_>,
        found: &Finalist,
        formulas: &[Formulated],
        log_odds: f64,
    ) -> Result<Result<Proposal, String>, DiagnosisError> {
        let (by, kind, best) = (self.settings(), start.problem.kind, &found.best);
        let axes = best.axes(by.kept_errors);
        if best.axes(by.amplitude_errors).is_empty() {
            return Ok(Err(format!(
                "the {kind} follows something, and no formula's amplitudes differ from zero"
            )));
        }
        let text = |amounts: &[(f64, f64)]| entry::toml(kind, &best.formula, &axes, amounts, self.origin);
        let of_axes: Vec<(f64, f64)> =
            best.amounts.chunks(3).flat_map(|term| axes.iter().map(|axis| term[*axis])).collect();
        let effects = entry::effects(&text(&of_axes));
        let joined = Joined::new(self.explained.linear.candidates, &self.reference, effects)?;
        let linear = joined.problem(&self.explained.linear, &self.explained.fit, &start.problem.fitted);
        let tried = joined.tried(&linear, kind, &best.weighed.noise, &self.drivers)?;
        let follows = |what: &str| Err(format!("the {kind} follows {what}, no formula found"));
        if let Some(left) = tried.left.as_ref().filter(|left| left.size > by.remainder * best.explained) {
            return Ok(follows(&left.driver));
        }
        if tried.share.interval[0] < by.least_share {
            return Ok(follows(&best.formula.name.replace('_', " ")));
        }
        let every: Vec<usize> = start.problem.fitted.clone();
        let own = (self.explained.linear.design.columns.len()..linear.design.size).collect::<Vec<_>>();
        let beside = Problem::new(&linear, &self.reference, kind, [every, own].concat())?;
        let second = finalists::next(&beside, formulas, &best.weighed.noise)?;
        let cost = (formulas.len() as f64).ln();
        let is_needed = second.is_some_and(|second| {
            second.gain - cost > by.least_gain && second.explained > by.remainder * best.explained
        });
        if is_needed {
            return Ok(follows("more than one formula says"));
        }
        if let Some(missing) = constancy::missing(&start.problem, best, &axes, by.inconstancy)? {
            let name = best.formula.name.replace('_', " ");
            return Ok(Err(format!("the {kind} follows {name} and {missing}, no formula found")));
        }
        Ok(Ok(self.proposal(start, found, &axes, &tried, &text(&tried.amounts), log_odds)))
    }

    fn proposal(
        &self,
        start: &Start<'_, '_>,
        found: &Finalist,
        axes: &[usize],
        tried: &Tried,
        toml: &str,
        log_odds: f64,
    ) -> Proposal {
        let (kind, formula) = (start.problem.kind, &found.best.formula);
        let unit = formula.amplitude_unit(kind);
        let amplitude = |(at, (value, error)): (usize, &(f64, f64))| Amount {
            name: Formulated::amplitude_name(at / axes.len(), axes[at % axes.len()], axes.len()),
            value: Some(*value),
            std_error: Some(*error),
            unit: unit.clone(),
        };
        let shape = formula.shape.iter().map(|shape| Amount {
            name: shape.name.clone(),
            value: Some(shape.value),
            std_error: shape.std_error,
            unit: shape.unit.clone(),
        });
        Proposal {
            sensor: kind.prefix().to_owned(),
            axes: axes.iter().map(|axis| XYZ[*axis].to_owned()).collect(),
            formula: formula.spelt(axes),
            parameters: tried.amounts.iter().enumerate().map(amplitude).chain(shape).collect(),
            equivalents: found.equivalents.iter().map(|other| other.formula.spelt(axes)).collect(),
            gap_closed: tried.share.value,
            gap_closed_ci95: tried.share.interval,
            log_odds,
            status: ProposalStatus::Proposed,
            toml: toml.to_owned(),
        }
    }
}

/// The largest size of a driver in the recording, but for a few blocks.
fn largest(problem: &Problem<'_, '_>, driver: &Driver) -> f64 {
    let itself = driver.itself(1);
    let factors = itself.parsed().ok().and_then(|terms| problem.factors(terms.first()?, &[]).ok());
    let mut sizes: Vec<f64> = factors.into_iter().flatten().map(|factor| factor.amax()).collect();
    sizes.sort_by(f64::total_cmp);
    let most = sizes.get(sizes.len().saturating_sub(1 + sizes.len() / 50)).copied().unwrap_or(1.0);
    most.max(1e-6)
}

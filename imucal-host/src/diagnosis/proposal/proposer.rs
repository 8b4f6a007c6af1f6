//! What a missing effect looks like: for each sensor that still follows something, the one formula that explains it, or why
//! there is none.

use super::{
    constancy, entry,
    finalists::{self, Finalist},
    grammar::{self, Held, Taken},
    null_threshold,
    problem::{Problem, Run, Weighed},
    refitted,
    term::{Driver, Formulated, Shape},
    trial::{Joined, Tried},
};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        finding::{Amount, Diagnosis, Proposal, ProposalStatus, Verdict},
        location::{covariate::Covariate, covariates},
        mixed_model::noise::NEAR,
        search::{linearisation::Linearisation, refit::Fit, stepwise::Solution},
        settings::ProposalSettings,
    },
    effect::{Effect, XYZ},
    recording::SensorKind,
};

/// Fits with a formula among the effects, at most, until the best formula is that of the fit.
const ROUNDS: usize = 3;
/// Share of a driver's values at either end that does not count as reached.
const ENDS: f64 = 0.01;
/// Shares of the time for which an axis is below the knees that are tried.
const QUANTILES: [f64; 7] = [0.03, 0.1, 0.25, 0.5, 0.75, 0.9, 0.97];
/// Knees are further apart than this share of the largest value.
const APART: f64 = 0.02;
/// The least size of a driver that counts, and the least share of it that an axis must move to count.
const LEAST: f64 = 1e-6;
const LEAST_SHARE: f64 = 0.01;

/// A problem about a fit, and what all sensors have in common.
struct Setting<'a, 's> {
    explained: &'a Solution<'s>,
    linear: &'a Linearisation<'s>,
    fit: &'a Fit,
    run: Run<'a>,
    drivers: Vec<Covariate>,
    held: Held,
    origin: &'a str,
}

/// What a formula is added to: a set of effects, and the fit of one sensor with it.
struct Start<'a, 's> {
    set: Vec<&'static Effect>,
    problem: Problem<'a, 's>,
    before: Weighed,
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
    let held = Held {
        gimbals: scene.blocks.first().is_some_and(|block| scene.swings(block).is_some()),
        temperature,
        field: scene.settings.source.gives_field() && scene.kinds.contains(&SensorKind::Mag),
    };
    let setting = Setting::new(explained, (&explained.linear, &explained.fit), held, &diagnosis.recording)?;
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

impl<'a, 's> Setting<'a, 's> {
    fn new(
        explained: &'a Solution<'s>,
        (linear, fit): (&'a Linearisation<'s>, &'a Fit),
        held: Held,
        origin: &'a str,
    ) -> Result<Self, DiagnosisError> {
        let run = Run::new(linear.scene, &fit.doses)?;
        let drivers = covariates::drivers(linear.scene, &linear.weighing.given);
        Ok(Self { explained, linear, fit, run, drivers, held, origin })
    }

    fn settings(&self) -> &ProposalSettings {
        &self.linear.scene.settings.proposal
    }

    /// The proposal for a sensor, or a sentence on why there is none.
    fn of_sensor(
        &self,
        kind: SensorKind,
        asserted: &[&'static Effect],
    ) -> Result<Result<Proposal, String>, DiagnosisError> {
        let mut starts = vec![self.start(kind, Vec::new())?];
        if asserted.iter().any(|effect| self.linear.scene.reach(effect).contains(&kind)) {
            starts.push(self.start(kind, asserted.to_vec())?);
        }
        let formulas = formulas(&starts[0].problem, self.held);
        let mut best: Option<(f64, &Start<'_, '_>, Finalist)> = None;
        for start in &starts {
            let found = finalists::best(&start.problem, &self.run.fine, &start.before, &formulas)?;
            let Some(found) = found else { continue };
            let noise = &self.explained.best.noise;
            let value = self.linear.screen(&start.set, noise, &[kind], &NEAR)?.value + found.best.gain;
            if best.as_ref().is_none_or(|(most, ..)| value > *most) {
                best = Some((value, start, found));
            }
        }
        let Some((_, start, found)) = best else { return Ok(none(kind)) };
        if self.gain(&found, &formulas) <= self.settings().least_gain {
            return Ok(none(kind));
        }
        let threshold = null_threshold::threshold(&start.problem, &formulas, &start.before.noise)?;
        if found.best.gain <= threshold {
            return Ok(none(kind));
        }
        self.settled(kind, &start.set, found)
    }

    /// The formula that is best about the fit that has it among its effects, judged there.
    fn settled(
        &self,
        kind: SensorKind,
        set: &[&'static Effect],
        mut found: Finalist,
    ) -> Result<Result<Proposal, String>, DiagnosisError> {
        for round in 1..=ROUNDS {
            let fit = refitted::without(self.explained, set, kind, &found.best)?;
            let linear = Linearisation::fitted_alone(self.linear.scene, self.linear.candidates, &fit)?;
            let setting = Setting::new(self.explained, (&linear, &fit), self.held, self.origin)?;
            let start = setting.start(kind, set.to_vec())?;
            let (formulas, Some(again)) = setting.found(&start)? else { break };
            let gain = setting.gain(&again, &formulas);
            if gain <= self.settings().least_gain {
                break;
            }
            if round == ROUNDS || again.best.formula.name == found.best.formula.name {
                return setting.accepted(&start, &again, &formulas, gain);
            }
            found = again;
        }
        Ok(none(kind))
    }

    /// The formulas that are tried, and the best of them.
    fn found(&self, start: &Start<'_, '_>) -> Result<(Vec<Formulated>, Option<Finalist>), DiagnosisError> {
        let formulas = formulas(&start.problem, self.held);
        let found = finalists::best(&start.problem, &self.run.fine, &start.before, &formulas)?;
        Ok((formulas, found))
    }

    /// ln of the odds that a formula adds, the number of those that are tried counted.
    fn gain(&self, found: &Finalist, formulas: &[Formulated]) -> f64 {
        found.best.gain - (formulas.len() as f64).ln()
    }

    fn start(&self, kind: SensorKind, set: Vec<&'static Effect>) -> Result<Start<'_, 's>, DiagnosisError> {
        let problem = Problem::new(self.linear, &self.run, kind, self.linear.fitted(&set));
        let before = problem.weighed(&problem.design, &[], &self.explained.best.noise)?;
        Ok(Start { set, problem, before })
    }

    /// The formula as a proposal, if held-out stretches bear it out and the residual then follows nothing else.
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
        let name = || best.formula.name.replace('_', " ");
        if best.formula.shape.as_ref().is_some_and(Shape::is_at_end) {
            let name = name();
            return Ok(Err(format!(
                "the {kind} follows {name} beyond the shapes that are tried, no formula found"
            )));
        }
        let text = |amounts: &[(f64, f64)]| entry::toml(kind, &best.formula, &axes, amounts, self.origin);
        let effects = entry::effects(&text(&best.of_axes(&axes)));
        let joined = Joined::new(self.linear.candidates, &self.run.fine, effects)?;
        let linear = joined.problem(self.linear, self.fit, &start.problem.fitted);
        let tried = joined.tried(&linear, kind, &best.weighed.noise, &self.drivers)?;
        let follows = |what: &str| Err(format!("the {kind} follows {what}, no formula found"));
        if let Some(left) = tried.left.as_ref().filter(|left| left.size > by.remainder * best.explained) {
            return Ok(follows(&left.driver));
        }
        if tried.share.interval[0] < by.least_share {
            return Ok(follows(&name()));
        }
        let every: Vec<usize> = start.problem.fitted.clone();
        let own = (self.linear.design.columns.len()..linear.design.size).collect::<Vec<_>>();
        let next_to = Problem::new(&linear, &self.run, kind, [every, own].concat());
        let second = finalists::next(&next_to, formulas, &best.weighed.noise)?;
        let cost = (formulas.len() as f64).ln();
        let is_needed = second.is_some_and(|second| {
            second.gain - cost > by.least_gain && second.explained > by.remainder * best.explained
        });
        if is_needed {
            return Ok(follows("more than one formula says"));
        }
        if let Some(missing) = constancy::missing(&start.problem, best, &axes, by.inconstancy)? {
            return Ok(Err(format!("the {kind} follows {} and {missing}, no formula found", name())));
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
            equivalents: equivalents(found, axes),
            gap_closed: tried.share.value,
            gap_closed_ci95: tried.share.interval,
            log_odds,
            status: ProposalStatus::Proposed,
            toml: toml.to_owned(),
        }
    }
}

/// The formulas that cannot be distinguished from the one found, each once: on one axis a component is that of the axis, too.
fn equivalents(found: &Finalist, axes: &[usize]) -> Vec<String> {
    let mut texts = vec![found.best.formula.spelt(axes)];
    for text in found.equivalents.iter().map(|other| other.formula.spelt(axes)) {
        if !texts.contains(&text) {
            texts.push(text);
        }
    }
    texts.split_off(1)
}

/// The formulas that are tried on a problem.
fn formulas(problem: &Problem<'_, '_>, held: Held) -> Vec<Formulated> {
    grammar::formulas(problem.kind, held, &|driver| taken(problem, driver))
}

/// No formula is likely enough.
fn none<T>(kind: SensorKind) -> Result<T, String> {
    Err(format!("the {kind} follows something for which no formula was found"))
}

/// The values of a driver in the recording, a few blocks at either end left out.
fn taken(problem: &Problem<'_, '_>, driver: &Driver) -> Taken {
    let itself = driver.itself(1);
    let factors = itself.parsed().ok().and_then(|terms| problem.factors(terms.first()?, &[]).ok());
    let factors = factors.unwrap_or_default();
    let (mut least, mut largest) = (f64::INFINITY, LEAST);
    let mut quantiles = vec![0.0];
    for axis in 0..3 {
        let mut values: Vec<f64> = factors.iter().map(|factor| factor[axis]).collect();
        values.sort_by(f64::total_cmp);
        let below = |share: f64| values[((values.len() - 1) as f64 * share).round() as usize];
        if values.is_empty() {
            continue;
        }
        let (low, high) = (below(ENDS), below(1.0 - ENDS));
        largest = largest.max(low.abs()).max(high.abs());
        least = least.min(0.5 * (high - low));
        quantiles.extend(QUANTILES.map(below));
    }
    quantiles.sort_by(f64::total_cmp);
    quantiles.dedup_by(|a, b| (*a - *b).abs() < APART * largest);
    Taken { largest, least: least.clamp(LEAST_SHARE * largest, largest), quantiles }
}

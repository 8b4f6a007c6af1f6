//! A formula of another recording, with its amplitudes as they were found there: whether this recording bears it out.
//!
//! ```text
//! s = fᵀ Σ⁻¹ r / fᵀ Σ⁻¹ f      f: what the formula predicts, r: the residual, both with the baseline projected out
//! ```
//!
//! Both are those about the fit that has the formula among its effects, with amplitudes of its own: about another one, the baseline
//! holds a part of a strong formula, and what the axes sense is wrong by as much.
//!
//! It is confirmed where the prediction, nothing of it fitted, closes at least half of what is left of its sensor's gap, with an
//! interval above zero, and the factor s that would suit this recording best is near one.

use std::path::{Path, PathBuf};

use super::{
    problem::{Problem, Run},
    proposer::asserted,
    refitted,
    trial::Joined,
};
use crate::{
    diagnosis::{
        error::DiagnosisError,
        finding::{Amount, Diagnosis, Proposal, ProposalStatus},
        library::evidence::Projected,
        location::{covariate::Covariate, covariates, score_test, score_test::Following},
        mixed_model::{
            design::Design,
            noise::{NEAR, Noise},
        },
        search::{linearisation::Linearisation, stepwise::Solution},
        verdict::shares,
    },
    effect::{Act, Effect, user::Fitted},
    file::{Limits, ReadFault},
    recording::SensorKind,
};

/// The factor is near one within so many of its standard errors, or within this share.
const ERRORS: f64 = 4.0;
const CLOSE: f64 = 0.3;

/// The effects of a file on one sensor, with their parameters as they were found.
struct Frozen {
    kind: SensorKind,
    effects: Vec<&'static Effect>,
    /// Amplitudes with their standard errors, effect by effect.
    amplitudes: Vec<Fitted>,
}

/// A prediction with one set of effects.
struct Predicted {
    /// ln of the probability of the data with the prediction and the set.
    value: f64,
    proposal: Proposal,
}

/// Why the effects of a file cannot be confirmed.
#[derive(Debug, thiserror::Error)]
pub enum FrozenFault {
    /// One of them has no values.
    #[error(
        "{path}: found no fitted values of {effect}, expected `fitted` with a value and a std_error for each amplitude; leave \
         --frozen out to fit them"
    )]
    Unfitted {
        /// The file.
        path: PathBuf,
        /// The effect.
        effect: String,
    },
    /// The file cannot be read again.
    #[error("{path}: {cause}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: ReadFault,
    },
}

/// The text of a file whose effects are to be confirmed; all of them have fitted values.
///
/// # Errors
///
/// [`FrozenFault`].
pub fn frozen(path: &Path, effects: &[&'static Effect], limits: &Limits) -> Result<String, FrozenFault> {
    if let Some(effect) = without_values(effects).first() {
        return Err(FrozenFault::Unfitted { path: path.to_owned(), effect: effect.id.clone() });
    }
    let bytes = limits.read_small(path);
    let bytes = bytes.map_err(|cause| FrozenFault::Unreadable { path: path.to_owned(), cause })?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Effects of a file without the values that a confirmation needs.
pub fn without_values(effects: &[&'static Effect]) -> Vec<&'static Effect> {
    effects.iter().copied().filter(|effect| amplitudes(effect).is_none()).collect()
}

/// Amplitudes of an effect as its file gives them; `None` where one is missing.
fn amplitudes(effect: &Effect) -> Option<Vec<Fitted>> {
    let Act::Formula(_, formula) = effect.act else { return None };
    effect.amplitudes().map(|at| formula.fitted().get(at).copied().flatten()).collect()
}

/// The effects of a file, sensor by sensor, confirmed or refuted, and remarks on those that the recording cannot show; `toml`
/// is the file's text.
///
/// # Errors
///
/// [`DiagnosisError`], of a stage that failed.
pub fn confirmed(
    explained: &Solution<'_>,
    diagnosis: &Diagnosis,
    effects: &[&'static Effect],
    toml: &str,
) -> Result<(Vec<Proposal>, Vec<String>), DiagnosisError> {
    let scene = explained.linear.scene;
    let drivers = covariates::drivers(scene, &explained.linear.weighing.given);
    let (mut proposals, mut remarks) = (Vec::new(), Vec::new());
    for kind in SensorKind::ALL {
        let of_kind = |effect: &&&'static Effect| effect.sensors == [kind];
        let own: Vec<&'static Effect> = effects.iter().filter(of_kind).copied().collect();
        let found: Option<Vec<Vec<Fitted>>> = own.iter().map(|effect| amplitudes(effect)).collect();
        let Some(found) = found.filter(|found| !found.is_empty()) else { continue };
        let frozen = Frozen { kind, effects: own, amplitudes: found.concat() };
        if !scene.kinds.contains(&kind) {
            remarks.push(format!(
                "the formula for the {kind} cannot be tested: the recording lacks that sensor"
            ));
            continue;
        }
        let mut best: Option<Predicted> = None;
        let mut untestable = None;
        for set in [Vec::new(), asserted(explained, diagnosis)] {
            let predicted = match frozen.with(&set, explained, &drivers, toml) {
                Err(DiagnosisError::Formula(cause)) => {
                    untestable = Some(cause.without_row());
                    break;
                }
                predicted => predicted?,
            };
            let Some(predicted) = predicted else { continue };
            if best.as_ref().is_none_or(|best| predicted.value > best.value) {
                best = Some(predicted);
            }
        }
        if let Some(why) = untestable {
            remarks.push(format!("the formula for the {kind} cannot be tested: {why}"));
            continue;
        }
        match best {
            Some(best) => proposals.push(best.proposal),
            None => remarks.push(format!(
                "the formula for the {kind} cannot be tested: what it predicts here is lost in the noise"
            )),
        }
    }
    Ok((proposals, remarks))
}

impl Frozen {
    /// What it predicts, held against the recording with a set of effects; `None` where that is too small to be seen.
    fn with(
        &self,
        set: &[&'static Effect],
        explained: &Solution<'_>,
        drivers: &[Covariate],
        toml: &str,
    ) -> Result<Option<Predicted>, DiagnosisError> {
        let (best, scene) = (&explained.best, explained.linear.scene);
        let fit = &refitted::without_effects(explained, set, &self.effects, &best.noise)?;
        let linear = &Linearisation::fitted_alone(scene, explained.linear.candidates, fit)?;
        let run = &Run::new(scene, &fit.doses)?;
        let joined = Joined::new(linear.candidates, &run.fine, self.effects.clone())?;
        let fitted = linear.fitted(set);
        let (with, mut without) =
            (joined.problem(linear, fit, &fitted), joined.problem(linear, fit, &fitted));
        let own: Vec<usize> = (linear.design.columns.len()..with.design.size).collect();
        let amplitudes: Vec<f64> = own
            .iter()
            .zip(&self.amplitudes)
            .map(|(id, found)| {
                let column = with.design.columns[*id];
                found.value / column.effect.parameters[column.parameter].prior_scale
            })
            .collect();
        let taken: Vec<(usize, f64)> = own.iter().copied().zip(amplitudes.iter().map(|a| -a)).collect();
        without.design.restore(&taken);
        let problem = Problem::new(linear, run, self.kind, fitted.clone());
        let left = self.residual(&without.design, &fitted);
        let before = problem.weighed(&problem.design, &[], &best.noise)?;
        let after = problem.weighed(&left, &[], &best.noise)?;
        let projected = project(&with, &after.noise, &own)?;
        let (factor, error) = factor(&projected, &amplitudes);
        let is_seen = error.is_finite() && error.powi(-2) >= linear.scene.settings.verdict.detectable;
        if !is_seen {
            return Ok(None);
        }
        let remainder = self.remainder(&without, &after.noise, &own, drivers)?;
        let share = shares::closed_by_prediction(&with, &without, self.kind, &after.noise, remainder)?;
        let near = f64::max(CLOSE, ERRORS * f64::hypot(error, self.relative_error()));
        let by = &linear.scene.settings.proposal;
        let holds = share.value >= by.least_share && share.interval[0] > 0.0 && (factor - 1.0).abs() <= near;
        let status = if holds { ProposalStatus::Confirmed } else { ProposalStatus::Refuted };
        let log_odds = after.log_evidence - before.log_evidence;
        let set_value = explained.linear.screen(set, &best.noise, &[self.kind], &NEAR)?.value;
        let proposal = Proposal {
            gap_closed: share.value,
            gap_closed_ci95: share.interval,
            log_odds,
            status,
            toml: toml.to_owned(),
            ..self.proposal(&projected)
        };
        Ok(Some(Predicted { value: set_value + log_odds, proposal }))
    }

    /// The sensor's channels, with the columns that are fitted in any case.
    fn residual(&self, design: &Design, fitted: &[usize]) -> Design {
        let mut own = design.extended(fitted, Vec::new(), &[]);
        own.channels.retain(|channel| channel.kind == self.kind);
        own
    }

    /// Whitened size of what the sensor still follows apart from the prediction, another amplitude of it included.
    fn remainder(
        &self,
        without: &Linearisation<'_>,
        noise: &Noise,
        own: &[usize],
        drivers: &[Covariate],
    ) -> Result<f64, DiagnosisError> {
        let by = &without.scene.settings.location;
        let after = score_test::score_tests_refitted(without, &[], noise, drivers)?;
        let is_followed =
            |f: &&Following| f.kind == self.kind && f.p_value * after.len() as f64 <= by.p_value;
        let left = after.iter().filter(is_followed).map(|left| left.size).fold(0.0, f64::max);
        let every: Vec<usize> = (0..own.len()).collect();
        let again = project(without, noise, own)?.explained(&every) - own.len() as f64;
        Ok(left.max(again))
    }

    /// Standard error of the amplitudes as they were found, as a share of their size.
    fn relative_error(&self) -> f64 {
        let norm = |of: fn(&Fitted) -> f64| self.amplitudes.iter().map(of).map(|v| v * v).sum::<f64>().sqrt();
        norm(|found| found.std_error) / norm(|found| found.value).max(f64::MIN_POSITIVE)
    }

    /// The formula with the amplitudes that would suit this recording.
    fn proposal(&self, projected: &Projected) -> Proposal {
        let every: Vec<usize> = (0..self.amplitudes.len()).collect();
        let estimate = projected.estimate(&every);
        let mut parameters = Vec::new();
        for effect in &self.effects {
            for parameter in effect.amplitudes().map(|at| &effect.parameters[at]) {
                let at = parameters.len();
                let value = |of: f64| parameter.prior_scale * of;
                parameters.push(Amount {
                    name: parameter.name.clone(),
                    value: estimate.as_ref().map(|(amplitudes, _)| value(amplitudes[at])),
                    std_error: estimate.as_ref().map(|(_, c)| value(c[(at, at)].max(0.0).sqrt())),
                    unit: parameter.unit.clone(),
                });
            }
        }
        let mut axes: Vec<String> = parameters.iter().map(|amount| amount.name.clone()).collect();
        axes.sort();
        axes.dedup();
        let formula = |effect: &&'static Effect| match effect.act {
            Act::Formula(_, formula) => formula.to_string(),
            _ => String::new(),
        };
        Proposal {
            sensor: self.kind.prefix().to_owned(),
            axes,
            formula: self.effects.iter().map(formula).collect::<Vec<_>>().join(" + "),
            parameters,
            equivalents: Vec::new(),
            gap_closed: 0.0,
            gap_closed_ci95: [0.0, 1.0],
            log_odds: 0.0,
            status: ProposalStatus::Refuted,
            toml: String::new(),
        }
    }
}

/// Some columns of a problem with what is fitted in any case projected out.
fn project(linear: &Linearisation<'_>, noise: &Noise, own: &[usize]) -> Result<Projected, DiagnosisError> {
    let all: Vec<usize> = linear.baseline.iter().chain(own).copied().collect();
    let normal = linear.design.normal(&linear.precisions(noise), &all);
    let every: Vec<usize> = (0..all.len()).collect();
    let (first, others) = every.split_at(linear.baseline.len());
    Projected::new(&normal, first, others)
}

/// The factor of these amplitudes that suits the residual best, and its standard error.
fn factor(projected: &Projected, amplitudes: &[f64]) -> (f64, f64) {
    let score: f64 = amplitudes.iter().zip(projected.score.iter()).map(|(a, s)| a * s).sum();
    let pairs = (0..amplitudes.len()).flat_map(|i| (0..amplitudes.len()).map(move |j| (i, j)));
    let information: f64 =
        pairs.map(|at| amplitudes[at.0] * projected.information[at] * amplitudes[at.1]).sum();
    (score / information, 1.0 / information.max(0.0).sqrt())
}

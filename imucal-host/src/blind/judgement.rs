//! One opened trial held against its answer.
//!
//! Ids are compared by the contract's classes ([`class`]) except where a figure asks for the id itself. A cause's first
//! three declared equivalents stand for it in the figures that say so, and in no others.

use super::{
    answer::{Answer, Asserted, Finished},
    case::{Label, Present},
    lambda::largest,
    outside::is_spoken,
    proposal::Proposed,
};
use crate::{diagnosis::Verdict, effect::class::class};

/// Equivalents that are counted for a cause.
const COUNTED: usize = 3;

/// What a trial's recording holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Truth {
    /// Nothing beyond the baseline.
    Healthy,
    /// So many effects of the catalogue.
    Catalogue(usize),
    /// A mechanism from outside.
    Outside,
}

/// A trial, judged.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// Its label.
    pub label: Label,
    /// Its answer.
    pub answer: Answer,
    /// What it holds.
    pub truth: Truth,
    /// The smallest λ of its effects; 0 without.
    pub lambda: f64,
    /// The smallest λ of its effects with the others fitted.
    pub lambda_beside: f64,
    /// The asserted classes are those that are there, and no others.
    pub classes_right: bool,
    /// Likewise where an asserted cause may stand for one of its declared equivalents.
    pub right_or_equivalent: bool,
    /// One cause is asserted, and it or a declared equivalent is the effect itself.
    pub exact: bool,
    /// The credible set has one of the class of every effect.
    pub credible: bool,
    /// A cause is asserted of which neither class nor declared equivalents are there.
    pub absent_asserted: bool,
    /// The verdict is that something unknown is there.
    pub flagged: bool,
    /// The verdict is another than that there is no gap.
    pub alarmed: bool,
    /// What is there is from outside, and a formula says it.
    pub spoken: bool,
    /// A formula is proposed that is what is there, and no other.
    pub formula_right: bool,
    /// A formula is proposed that is not there.
    pub formula_wrong: bool,
    /// Share of the gap that is closed: said, its interval, true.
    pub closed: Option<Closed>,
    /// Time of the diagnosis, s.
    pub seconds: f64,
}

/// What is said of the closed share, and the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closed {
    /// As said; none where causes are asserted without it.
    pub said: Option<f64>,
    /// Its interval.
    pub interval: Option<[f64; 2]>,
    /// By simulation.
    pub truly: f64,
}

impl Judgement {
    /// Of a finished trial; `None` where its label cannot be read.
    pub fn of(trial: &Finished) -> Option<Self> {
        let label = trial.opened()?;
        let answer = trial.answer.clone();
        let truth = match &label.effects[..] {
            [] => Truth::Healthy,
            effects if effects.iter().any(|effect| effect.outside) => Truth::Outside,
            effects => Truth::Catalogue(effects.len()),
        };
        let there: Vec<&str> = label.effects.iter().map(|effect| effect.effect.as_str()).collect();
        let one = match &answer.causes[..] {
            [cause] => Some(cause),
            _ => None,
        };
        let smallest =
            |size: fn(&Present) -> f64| label.effects.iter().map(size).reduce(f64::min).unwrap_or(0.0);
        let closed = trial.truly_closed.map(|truly| Closed {
            said: answer.gap_closed,
            interval: answer.gap_closed_ci95,
            truly,
        });
        Some(Self {
            truth,
            lambda: smallest(|effect| largest(&effect.lambda)),
            lambda_beside: smallest(|effect| effect.lambda_beside),
            classes_right: same(&there, &answer.causes, |cause, id| class(&cause.effect) == class(id)),
            right_or_equivalent: same(&there, &answer.causes, stands_for_class),
            exact: there.len() == 1 && one.is_some_and(|cause| stands_for(cause, there[0])),
            credible: there.iter().all(|id| answer.credible_set.iter().any(|held| class(held) == class(id))),
            absent_asserted: answer
                .causes
                .iter()
                .any(|cause| !there.iter().any(|id| stands_for_class(cause, id))),
            flagged: matches!(answer.verdict, Some(Verdict::Unknown | Verdict::Partly)),
            alarmed: answer.verdict != Some(Verdict::None),
            spoken: truth == Truth::Outside && there.iter().all(|id| is_spoken(id)),
            formula_right: !answer.proposals.is_empty() && answer.proposals.iter().all(Proposed::is_right),
            formula_wrong: answer.proposals.iter().any(|proposed| !proposed.is_right()),
            closed,
            seconds: trial.seconds,
            label,
            answer,
        })
    }

    /// Named by the answer, whichever else is.
    pub fn is_right_of(&self, cause: &Asserted) -> bool {
        self.label.effects.iter().any(|effect| class(&cause.effect) == class(&effect.effect))
    }

    /// It is not what it ought to be.
    pub fn is_missed(&self) -> bool {
        match self.truth {
            Truth::Healthy => self.alarmed || self.formula_wrong,
            Truth::Catalogue(_) => !self.classes_right || self.flagged,
            Truth::Outside => !self.flagged || self.formula_wrong || (self.spoken && !self.formula_right),
        }
    }

    /// A line that says what was there and what was answered.
    pub fn line(&self) -> String {
        let setting = &self.label.setting;
        let effect = |effect: &Present| {
            let [acc, gyr, mag] = effect.lambda;
            format!(
                "{} [λ acc {acc:.0} gyr {gyr:.0} mag {mag:.0}; with the others fitted {:.0}]",
                effect.effect, effect.lambda_beside
            )
        };
        let there: Vec<String> = self.label.effects.iter().map(effect).collect();
        let cause = |cause: &Asserted| {
            let probability = cause.probability.unwrap_or(f64::NAN);
            format!("{} p {probability:.3}{}", cause.effect, equivalents(cause))
        };
        let causes: Vec<String> = self.answer.causes.iter().map(cause).collect();
        let verdict = self.answer.verdict.and_then(|verdict| serde_json::to_value(verdict).ok());
        let verdict = verdict.as_ref().and_then(|verdict| verdict.as_str()).unwrap_or("no answer").to_owned();
        format!(
            "{}: {} | {}: {} | {}credible {} | where {} | {} {} {} {:.0} Hz {:.0} s",
            self.label.case,
            if there.is_empty() { "nothing".to_owned() } else { there.join(" + ") },
            verdict,
            if causes.is_empty() { "nothing".to_owned() } else { causes.join(" + ") },
            formulas(&self.answer),
            self.answer.credible_set.join(", "),
            self.answer.places.join(", "),
            setting.unit,
            setting.programme,
            setting.axes,
            setting.rate,
            setting.duration,
        )
    }
}

/// The declared equivalents of a cause, as a part of a line; empty without one.
pub(super) fn equivalents(cause: &Asserted) -> String {
    match cause.equivalents.len() {
        0 => String::new(),
        _ => format!(" = {}", cause.equivalents.join(", ")),
    }
}

/// The proposed formulas in words, as a part of a line; empty without one.
pub(super) fn formulas(answer: &Answer) -> String {
    let one = |proposed: &Proposed| {
        let correlation = proposed.correlation.unwrap_or(f64::NAN);
        let status = match proposed.confirmed {
            Some(true) => "confirmed",
            Some(false) => "refuted",
            None => "not tested again",
        };
        format!("{} += {} ρ {correlation:.3} {status} | ", proposed.sensor, proposed.formula)
    };
    answer.proposals.iter().map(one).collect()
}

fn stands_for(cause: &Asserted, id: &str) -> bool {
    cause.effect == id || cause.equivalents.iter().take(COUNTED).any(|equivalent| equivalent == id)
}

/// The cause or one of its declared equivalents is of the class of an id.
pub(super) fn stands_for_class(cause: &Asserted, id: &str) -> bool {
    let equivalents = cause.equivalents.iter().take(COUNTED);
    std::iter::once(&cause.effect).chain(equivalents).any(|named| class(named) == class(id))
}

/// Every id is met by a cause, and every cause meets an id.
fn same(there: &[&str], causes: &[Asserted], meets: fn(&Asserted, &str) -> bool) -> bool {
    there.iter().all(|id| causes.iter().any(|cause| meets(cause, id)))
        && causes.iter().all(|cause| there.iter().any(|id| meets(cause, id)))
}

//! One opened trial with a robot held against its answer. Of the diagnosis and the label it is a function, and of nothing
//! else.

use super::{
    case::{Content, RobotLabel},
    setting::DELAY,
};
use crate::{
    blind::{
        answer::{Answer, Asserted, Finished},
        judgement::{equivalents, formulas, stands_for_class},
        proposal::Proposed,
    },
    diagnosis::Verdict,
    effect::class::class,
};

/// Causes that are true of every pair: each stream has a clock of its own.
const CLOCK: [&str; 2] = ["clk.time_offset", "clk.rate_error"];
/// The cause that says that the robot moved otherwise.
const MOTION: &str = "ref.motion_mismatch";
/// A delay is right within so many standard errors,
const ERRORS: f64 = 3.0;
/// and within this share of it, or this time, s.
const CLOSE: (f64, f64) = (0.1, 2e-4);

/// A trial, judged.
#[derive(Clone, Debug)]
pub struct RobotJudgement {
    /// Its label.
    pub label: RobotLabel,
    /// Its answer.
    pub answer: Answer,
    /// λ of what is there; 0 without.
    pub lambda: f64,
    /// Likewise beyond what one effect of the catalogue explains, where that was measured.
    pub lambda_beyond: f64,
    /// Something other than the clock is said to be there.
    pub alarmed: bool,
    /// Apart from the clock one class is asserted, that of the effect that is there.
    pub class_right: bool,
    /// Likewise where an asserted cause may stand for one of its declared equivalents, as in the contract's figure.
    pub right_or_equivalent: bool,
    /// It is said that the robot moved otherwise, and no sensor is blamed.
    pub motion_said: bool,
    /// The verdict is that something unknown is there.
    pub flagged: bool,
    /// The delay, and whether it was reported rightly; none where it is too short or too long to be asked for.
    pub delay: Option<bool>,
    /// Likewise the clock's rate, by its standard errors alone; none where none is reported.
    pub rate: Option<bool>,
    /// A formula is proposed that is what is there, and no other.
    pub formula_right: bool,
    /// A formula is proposed that is not there.
    pub formula_wrong: bool,
    /// Time of the diagnosis, s.
    pub seconds: f64,
}

impl RobotJudgement {
    /// Of a finished trial; `None` where its label cannot be read.
    pub fn of(trial: &Finished) -> Option<Self> {
        let label: RobotLabel = serde_json::from_str(&trial.label).ok()?;
        let answer = trial.answer.clone();
        let others: Vec<&Asserted> =
            answer.causes.iter().filter(|cause| !CLOCK.contains(&cause.effect.as_str())).collect();
        let flagged = matches!(answer.verdict, Some(Verdict::Unknown | Verdict::Partly));
        let answered = !matches!(answer.verdict, None | Some(Verdict::NotTestable));
        let of_class = |id: &str| others.iter().all(|cause| class(&cause.effect) == class(id));
        let there = label.effect.as_ref();
        let lambda = [there.map(|present| present.lambda), label.mismatch.as_ref().map(|m| m.lambda)];
        Some(Self {
            lambda: lambda.into_iter().flatten().fold(0.0, f64::max),
            lambda_beyond: there.and_then(|present| present.lambda_beyond).unwrap_or(0.0),
            alarmed: !answered || flagged || !others.is_empty(),
            class_right: there.is_some_and(|present| !others.is_empty() && of_class(&present.effect)),
            right_or_equivalent: there.is_some_and(|present| {
                !others.is_empty() && others.iter().all(|cause| stands_for_class(cause, &present.effect))
            }),
            motion_said: !others.is_empty() && of_class(MOTION),
            flagged,
            delay: delay(&label, &answer),
            rate: rate(&label, &answer),
            formula_right: !answer.proposals.is_empty() && answer.proposals.iter().all(Proposed::is_right),
            formula_wrong: answer.proposals.iter().any(|proposed| !proposed.is_right()),
            seconds: trial.seconds,
            label,
            answer,
        })
    }

    /// It is not what it ought to be.
    pub fn is_missed(&self) -> bool {
        let wrong = match self.label.content {
            Content::Healthy => self.alarmed || self.formula_wrong,
            Content::Effect | Content::Own => !self.right_or_equivalent,
            Content::Motion => !self.motion_said,
            Content::Spoken => !self.flagged || !self.formula_right,
            Content::Unspoken => !self.flagged || self.formula_wrong,
        };
        wrong || self.delay == Some(false)
    }

    /// A line that says what was there and what was answered.
    pub fn line(&self) -> String {
        let label = &self.label;
        let there = match (&label.effect, &label.mismatch) {
            (Some(present), _) => present.effect.clone(),
            (None, Some(departed)) => format!("{MOTION} by {}", departed.kind),
            (None, None) => "nothing".to_owned(),
        };
        let amount = |cause: &Asserted| {
            let delay = cause.amount("offset").filter(|_| cause.effect == CLOCK[0]);
            delay.map_or(String::new(), |(value, error)| {
                format!(" {:.3} ± {:.3} ms", 1e3 * value, 1e3 * error)
            })
        };
        let cause = |cause: &Asserted| {
            let probability = cause.probability.unwrap_or(f64::NAN);
            format!("{}{} p {probability:.3}{}", cause.effect, amount(cause), equivalents(cause))
        };
        let causes: Vec<String> = self.answer.causes.iter().map(cause).collect();
        let verdict = self.answer.verdict.and_then(|verdict| serde_json::to_value(verdict).ok());
        let verdict = verdict.as_ref().and_then(|verdict| verdict.as_str()).unwrap_or("no answer").to_owned();
        let beyond = label.effect.as_ref().and_then(|present| present.lambda_beyond);
        let beyond = beyond.map_or(String::new(), |lambda| format!("; beyond the catalogue {lambda:.0}"));
        let setting = &label.setting;
        format!(
            "{}: {there} [λ {:.0}{beyond}], delay {:.3} ms | {verdict}: {} | {}credible {} | {} {} {:.0}/{:.0} Hz {:.0} s",
            label.case,
            self.lambda,
            1e3 * setting.clock_offset,
            if causes.is_empty() { "nothing".to_owned() } else { causes.join(" + ") },
            formulas(&self.answer),
            self.answer.credible_set.join(", "),
            setting.machine,
            setting.unit,
            setting.rates[0],
            setting.rates[1],
            setting.duration,
        )
    }
}

fn delay(label: &RobotLabel, answer: &Answer) -> Option<bool> {
    let truth = label.setting.clock_offset;
    if !(DELAY.0..=DELAY.1).contains(&truth.abs()) {
        return None;
    }
    let said = answer.causes.iter().find(|cause| cause.effect == CLOCK[0]);
    Some(said.and_then(|cause| cause.amount("offset")).is_some_and(|(value, error)| {
        let miss = (value - truth).abs();
        miss <= ERRORS * error && miss <= f64::max(CLOSE.0 * truth.abs(), CLOSE.1)
    }))
}

fn rate(label: &RobotLabel, answer: &Answer) -> Option<bool> {
    let said = answer.causes.iter().find(|cause| cause.effect == CLOCK[1])?;
    let (value, error) = said.amount("error")?;
    Some((value - label.setting.clock_rate_error).abs() <= ERRORS * error)
}

//! The frozen scorer of trials with robots: the figures of the contract's table, from judged trials.

use super::{case::Content, judgement::RobotJudgement};
use crate::blind::score::{Figure, Goal, Share};

use Goal::{AtLeast, AtMost};

/// All figures.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotScore {
    /// Healthy and afflicted pairs.
    pub trials: [usize; 2],
    /// The figures of the contract, in its order.
    pub shares: Vec<Share>,
    /// Figures in addition to the contract's.
    pub further: Vec<Share>,
    /// Median and largest time of a diagnosis, s.
    pub seconds: [f64; 2],
}

fn holds(j: &RobotJudgement, content: Content) -> bool {
    j.label.content == content
}

/// Where nothing else moves or bends what the clock is found from.
fn has_delay(j: &RobotJudgement) -> bool {
    j.delay.is_some() && matches!(j.label.content, Content::Healthy | Content::Effect)
}

/// The contract's figures.
const CONTRACT: [Figure<RobotJudgement>; 8] = [
    Figure {
        name: "healthy pairs, false alarm",
        of: |j| holds(j, Content::Healthy),
        hit: |j| j.alarmed,
        must: Some(AtMost(0.05)),
        aim: Some(AtMost(0.02)),
    },
    Figure {
        name: "one effect, its class or a declared equivalent's, λ ≥ 100",
        of: |j| holds(j, Content::Effect) && j.lambda >= 100.0,
        hit: |j| j.right_or_equivalent,
        must: Some(AtLeast(0.95)),
        aim: Some(AtLeast(0.98)),
    },
    Figure {
        name: "delay of 2 to 50 ms, within 3 errors and 10 % or 0.2 ms",
        of: has_delay,
        hit: |j| j.delay == Some(true),
        must: Some(AtLeast(0.95)),
        aim: Some(AtLeast(1.0)),
    },
    Figure {
        name: "motion that the simulator lacks: said, no sensor blamed",
        of: |j| holds(j, Content::Motion),
        hit: |j| j.motion_said,
        must: Some(AtLeast(0.90)),
        aim: Some(AtLeast(0.98)),
    },
    Figure {
        name: "a user's own effect, given in TOML: named, λ ≥ 100",
        of: |j| holds(j, Content::Own) && j.lambda >= 100.0,
        hit: |j| j.right_or_equivalent,
        must: Some(AtLeast(0.95)),
        aim: None,
    },
    Figure {
        name: "outside, λ ≥ 200 beyond the catalogue: a right formula",
        of: |j| holds(j, Content::Spoken) && j.lambda_beyond >= 200.0,
        hit: |j| j.formula_right,
        must: Some(AtLeast(0.80)),
        aim: Some(AtLeast(0.95)),
    },
    Figure {
        name: "outside, no formula says it: no wrong formula",
        of: |j| holds(j, Content::Unspoken),
        hit: |j| !j.formula_wrong,
        must: Some(AtLeast(0.90)),
        aim: None,
    },
    Figure {
        name: "proposals on healthy recordings",
        of: |j| holds(j, Content::Healthy),
        hit: |j| !j.answer.proposals.is_empty(),
        must: Some(AtMost(0.01)),
        aim: Some(AtMost(0.0)),
    },
];

/// Figures next to the contract's.
const FURTHER: [Figure<RobotJudgement>; 16] = [
    Figure::further(
        "one effect, its class itself, λ ≥ 100",
        |j| holds(j, Content::Effect) && j.lambda >= 100.0,
        |j| j.class_right,
    ),
    Figure::further(
        "one effect, its class or a declared equivalent's, λ < 100",
        |j| holds(j, Content::Effect) && j.lambda < 100.0,
        |j| j.right_or_equivalent,
    ),
    Figure::further(
        "one effect, its class or a declared equivalent's, λ ≥ 300",
        |j| holds(j, Content::Effect) && j.lambda >= 300.0,
        |j| j.right_or_equivalent,
    ),
    Figure::further(
        "one effect, λ ≥ 100, said to be motion",
        |j| holds(j, Content::Effect) && j.lambda >= 100.0,
        |j| j.motion_said,
    ),
    Figure::further(
        "clock's rate, where reported, within 3 errors",
        |j| j.rate.is_some(),
        |j| j.rate == Some(true),
    ),
    Figure::further(
        "delay of 2 to 50 ms with other motion or mechanisms",
        |j| j.delay.is_some() && !has_delay(j),
        |j| j.delay == Some(true),
    ),
    Figure::further(
        "a user's own effect, its own id and no equivalent, λ ≥ 100",
        |j| holds(j, Content::Own) && j.lambda >= 100.0,
        |j| j.class_right,
    ),
    Figure::further(
        "outside, a formula says it, λ ≥ 200: a right formula",
        |j| holds(j, Content::Spoken) && j.lambda >= 200.0,
        |j| j.formula_right,
    ),
    Figure::further(
        "outside, λ ≥ 200 beyond the catalogue: flagged",
        |j| holds(j, Content::Spoken) && j.lambda_beyond >= 200.0,
        |j| j.flagged,
    ),
    Figure::further(
        "outside, no formula says it, flagged, λ ≥ 200",
        |j| holds(j, Content::Unspoken) && j.lambda >= 200.0,
        |j| j.flagged,
    ),
    Figure::further(
        "outside, not flagged, an effect of the catalogue or no answer",
        |j| matches!(j.label.content, Content::Spoken | Content::Unspoken),
        |j| j.alarmed && !j.flagged,
    ),
    Figure::further("within the catalogue, flagged", |j| holds(j, Content::Effect), |j| j.flagged),
    Figure::further("without an answer", |_| true, |j| j.answer.verdict.is_none()),
    Figure::further(
        "outside, λ ≥ 200 beyond the catalogue, flagged: right",
        |j| holds(j, Content::Spoken) && j.flagged && j.lambda_beyond >= 200.0,
        |j| j.formula_right,
    ),
    Figure::further(
        "outside, a formula says it: a wrong formula",
        |j| holds(j, Content::Spoken),
        |j| j.formula_wrong,
    ),
    Figure::further(
        "a right formula, confirmed on a second recording",
        |j| j.formula_right,
        |j| j.answer.proposals.iter().all(|proposed| proposed.confirmed == Some(true)),
    ),
];

/// Scores judged trials.
pub fn score(judged: &[RobotJudgement]) -> RobotScore {
    let mut seconds: Vec<f64> = judged.iter().map(|j| j.seconds).collect();
    seconds.sort_by(f64::total_cmp);
    let healthy = judged.iter().filter(|j| holds(j, Content::Healthy)).count();
    RobotScore {
        trials: [healthy, judged.len() - healthy],
        shares: CONTRACT.iter().map(|figure| figure.of(judged)).collect(),
        further: FURTHER.iter().map(|figure| figure.of(judged)).collect(),
        seconds: [seconds.get(seconds.len() / 2), seconds.last()].map(|s| s.copied().unwrap_or(0.0)),
    }
}

#[cfg(test)]
mod tests;

//! The frozen scorer: the figures of the contract's table, from judged trials.

use super::{
    interval::clopper_pearson,
    judgement::{Closed, Judgement, Truth},
};

/// What a figure has to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// At least this share.
    AtLeast(f64),
    /// At most this share.
    AtMost(f64),
    /// Between these shares.
    Within(f64, f64),
}

impl Goal {
    /// The figure is as it has to be.
    pub fn is_met(self, figure: f64) -> bool {
        match self {
            Self::AtLeast(least) => figure >= least,
            Self::AtMost(most) => figure <= most,
            Self::Within(least, most) => (least..=most).contains(&figure),
        }
    }
}

/// One figure: a share of trials.
#[derive(Clone, Debug, PartialEq)]
pub struct Share {
    /// Of what.
    pub name: &'static str,
    /// Trials in which it was so.
    pub hits: usize,
    /// Trials.
    pub trials: usize,
    /// What it must be.
    pub must: Option<Goal>,
    /// What it ought to be.
    pub aim: Option<Goal>,
}

impl Share {
    /// Its estimate; `None` without trials.
    pub fn estimate(&self) -> Option<f64> {
        (self.trials > 0).then(|| self.hits as f64 / self.trials as f64)
    }

    /// Its 95 % interval.
    pub fn interval(&self) -> [f64; 2] {
        clopper_pearson(self.hits, self.trials)
    }

    /// It is what it must be; without trials nothing is.
    pub fn meets_must(&self) -> bool {
        self.must.is_none_or(|goal| self.estimate().is_some_and(|figure| goal.is_met(figure)))
    }
}

/// How often what was said to be likely was so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// Probabilities said, from and below; the last bin holds 1.
    pub bin: (f64, f64),
    /// Their mean.
    pub said: f64,
    /// Causes that were there.
    pub hits: usize,
    /// Causes.
    pub causes: usize,
}

/// All figures.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// Healthy and afflicted trials.
    pub trials: [usize; 2],
    /// The figures of the contract, in its order.
    pub shares: Vec<Share>,
    /// Mean of the closed share as said less the true one, its standard error and how many there are.
    pub closed_bias: Option<(f64, f64, usize)>,
    /// Figures in addition to the contract's.
    pub further: Vec<Share>,
    /// Of the causes' probabilities, where all that is there is of the catalogue.
    pub calibration: Vec<Calibration>,
    /// Median and largest time of a diagnosis, s.
    pub seconds: [f64; 2],
}

/// Largest bias of the closed share.
pub const CLOSED_BIAS: [f64; 2] = [0.05, 0.02];
/// Largest upper bound of false alarms.
pub const ALARM_BOUND: f64 = 0.065;
const BINS: [f64; 6] = [0.0, 0.5, 0.8, 0.95, 0.99, 1.0];

use Goal::{AtLeast, AtMost, Within};

/// A share of judged trials: among which, which of them hit, and what the contract asks of it.
pub(in crate::blind) struct Figure<J> {
    pub(super) name: &'static str,
    pub(super) of: fn(&J) -> bool,
    pub(super) hit: fn(&J) -> bool,
    pub(super) must: Option<Goal>,
    pub(super) aim: Option<Goal>,
}

impl<J> Figure<J> {
    pub(super) fn of(&self, judged: &[J]) -> Share {
        let trials: Vec<&J> = judged.iter().filter(|j| (self.of)(j)).collect();
        let hits = trials.iter().filter(|j| (self.hit)(j)).count();
        Share { name: self.name, hits, trials: trials.len(), must: self.must, aim: self.aim }
    }

    pub(super) const fn further(name: &'static str, of: fn(&J) -> bool, hit: fn(&J) -> bool) -> Self {
        Self { name, of, hit, must: None, aim: None }
    }
}

fn is_healthy(j: &Judgement) -> bool {
    j.truth == Truth::Healthy
}

fn is_of_one(j: &Judgement) -> bool {
    j.truth == Truth::Catalogue(1)
}

fn is_of_catalogue(j: &Judgement) -> bool {
    matches!(j.truth, Truth::Catalogue(_))
}

/// A fault of the recording itself is undone or left out before anything is fitted, and no share is said.
fn share_of(j: &Judgement) -> Option<Closed> {
    j.closed.filter(|closed| closed.interval.is_some())
}

/// The contract's figures.
const CONTRACT: [Figure<Judgement>; 15] = [
    Figure {
        name: "false alarm on healthy recordings",
        of: is_healthy,
        hit: |j| j.alarmed,
        must: Some(AtMost(0.05)),
        aim: Some(AtMost(0.05)),
    },
    Figure {
        name: "one effect, class-correct, λ ≥ 100",
        of: |j| is_of_one(j) && j.lambda >= 100.0,
        hit: |j| j.classes_right,
        must: Some(AtLeast(0.95)),
        aim: None,
    },
    Figure {
        name: "one effect, class-correct, λ ≥ 60",
        of: |j| is_of_one(j) && j.lambda >= 60.0,
        hit: |j| j.classes_right,
        must: None,
        aim: Some(AtLeast(0.98)),
    },
    Figure {
        name: "one effect, exact or declared equivalent",
        of: is_of_one,
        hit: |j| j.exact,
        must: Some(AtLeast(0.9)),
        aim: None,
    },
    Figure {
        name: "one effect, exact or declared equivalent, λ ≥ 100",
        of: |j| is_of_one(j) && j.lambda >= 100.0,
        hit: |j| j.exact,
        must: None,
        aim: Some(AtLeast(0.97)),
    },
    Figure {
        name: "95 % credible set holds the truth, one effect",
        of: is_of_one,
        hit: |j| j.credible,
        must: Some(AtLeast(0.93)),
        aim: Some(Within(0.94, 0.98)),
    },
    Figure {
        name: "two effects, exact set of classes",
        of: |j| j.truth == Truth::Catalogue(2),
        hit: |j| j.classes_right,
        must: Some(AtLeast(0.85)),
        aim: Some(AtLeast(0.95)),
    },
    Figure {
        name: "three effects, exact set of classes",
        of: |j| j.truth == Truth::Catalogue(3),
        hit: |j| j.classes_right,
        must: Some(AtLeast(0.75)),
        aim: Some(AtLeast(0.90)),
    },
    Figure {
        name: "an effect asserted that is not there",
        of: is_of_catalogue,
        hit: |j| j.absent_asserted,
        must: Some(AtMost(0.10)),
        aim: Some(AtMost(0.05)),
    },
    Figure {
        name: "outside the catalogue, flagged, λ ≥ 200",
        of: |j| j.truth == Truth::Outside && j.lambda >= 200.0,
        hit: |j| j.flagged,
        must: Some(AtLeast(0.70)),
        aim: Some(AtLeast(0.85)),
    },
    Figure {
        name: "outside the catalogue, flagged, λ > 800",
        of: |j| j.truth == Truth::Outside && j.lambda > 800.0,
        hit: |j| j.flagged,
        must: None,
        aim: Some(AtLeast(0.95)),
    },
    Figure {
        name: "within the catalogue, flagged",
        of: is_of_catalogue,
        hit: |j| j.flagged,
        must: None,
        aim: Some(AtMost(0.03)),
    },
    Figure {
        name: "outside, a formula says it, λ ≥ 200: it or its equal",
        of: |j| j.spoken && j.lambda >= 200.0,
        hit: |j| j.formula_right,
        must: Some(AtLeast(0.80)),
        aim: Some(AtLeast(0.95)),
    },
    Figure {
        name: "outside, no formula says it: no wrong formula",
        of: |j| j.truth == Truth::Outside && !j.spoken,
        hit: |j| !j.formula_wrong,
        must: Some(AtLeast(0.90)),
        aim: None,
    },
    Figure {
        name: "proposals on healthy recordings",
        of: is_healthy,
        hit: |j| !j.answer.proposals.is_empty(),
        must: Some(AtMost(0.01)),
        aim: Some(AtMost(0.0)),
    },
];

/// Figures next to the contract's.
const FURTHER: [Figure<Judgement>; 16] = [
    Figure::further(
        "one effect, class-correct, λ < 60",
        |j| is_of_one(j) && (0.0..60.0).contains(&j.lambda),
        |j| j.classes_right,
    ),
    Figure::further(
        "one effect, class-correct, λ 60 to 100",
        |j| is_of_one(j) && (60.0..100.0).contains(&j.lambda),
        |j| j.classes_right,
    ),
    Figure::further(
        "one effect, class-correct, λ 100 to 300",
        |j| is_of_one(j) && (100.0..300.0).contains(&j.lambda),
        |j| j.classes_right,
    ),
    Figure::further(
        "one effect, class-correct, λ 300 and more",
        |j| is_of_one(j) && (300.0..f64::INFINITY).contains(&j.lambda),
        |j| j.classes_right,
    ),
    Figure::further(
        "one effect, its class or a declared equivalent's, λ ≥ 100",
        |j| is_of_one(j) && j.lambda >= 100.0,
        |j| j.right_or_equivalent,
    ),
    Figure::further(
        "credible set, λ < 100",
        |j| is_of_one(j) && (0.0..100.0).contains(&j.lambda),
        |j| j.credible,
    ),
    Figure::further(
        "credible set, λ 100 to 300",
        |j| is_of_one(j) && (100.0..300.0).contains(&j.lambda),
        |j| j.credible,
    ),
    Figure::further(
        "credible set, λ 300 and more",
        |j| is_of_one(j) && (300.0..f64::INFINITY).contains(&j.lambda),
        |j| j.credible,
    ),
    Figure::further(
        "two effects, each λ ≥ 60 with the other fitted, exact",
        |j| j.truth == Truth::Catalogue(2) && j.lambda_beside >= 60.0,
        |j| j.classes_right,
    ),
    Figure::further(
        "three effects, each λ ≥ 60 with the others fitted, exact",
        |j| j.truth == Truth::Catalogue(3) && j.lambda_beside >= 60.0,
        |j| j.classes_right,
    ),
    Figure::further(
        "outside the catalogue, flagged, λ < 200",
        |j| j.truth == Truth::Outside && j.lambda < 200.0,
        |j| j.flagged,
    ),
    Figure::further("causes without a closed share", |j| j.closed.is_some(), |j| share_of(j).is_none()),
    Figure::further("without an answer", |_| true, |j| j.answer.verdict.is_none()),
    Figure::further(
        "outside, a formula says it, flagged, λ ≥ 200: right",
        |j| j.spoken && j.flagged && j.lambda >= 200.0,
        |j| j.formula_right,
    ),
    Figure::further("outside, a formula says it: a wrong formula", |j| j.spoken, |j| j.formula_wrong),
    Figure::further(
        "a right formula, confirmed on a second recording",
        |j| j.formula_right,
        |j| j.answer.proposals.iter().all(|proposed| proposed.confirmed == Some(true)),
    ),
];

/// Scores judged trials.
pub fn score(judged: &[Judgement]) -> Score {
    let claimed: Vec<Closed> = judged.iter().filter_map(share_of).collect();
    let covered =
        |closed: &Closed| closed.interval.is_some_and(|[low, high]| (low..=high).contains(&closed.truly));
    let mut shares: Vec<Share> = CONTRACT.iter().map(|figure| figure.of(judged)).collect();
    shares.push(Share {
        name: "closed share's interval holds the true one",
        hits: claimed.iter().filter(|closed| covered(closed)).count(),
        trials: claimed.len(),
        must: Some(AtLeast(0.90)),
        aim: Some(Within(0.93, 0.98)),
    });
    let further = FURTHER.iter().map(|figure| figure.of(judged)).collect();
    let mut seconds: Vec<f64> = judged.iter().map(|j| j.seconds).collect();
    seconds.sort_by(f64::total_cmp);
    let trials_healthy = judged.iter().filter(|j| is_healthy(j)).count();
    Score {
        trials: [trials_healthy, judged.len() - trials_healthy],
        shares,
        closed_bias: bias(&claimed),
        further,
        calibration: calibration(judged),
        seconds: [seconds.get(seconds.len() / 2), seconds.last()].map(|s| s.copied().unwrap_or(0.0)),
    }
}

/// Mean and standard error of what is said less what is true.
fn bias(claimed: &[Closed]) -> Option<(f64, f64, usize)> {
    let errors: Vec<f64> = claimed.iter().filter_map(|closed| Some(closed.said? - closed.truly)).collect();
    let n = errors.len() as f64;
    let mean = errors.iter().sum::<f64>() / n;
    let variance = errors.iter().map(|error| (error - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    (!errors.is_empty()).then(|| (mean, (variance / n).sqrt(), errors.len()))
}

fn calibration(judged: &[Judgement]) -> Vec<Calibration> {
    let said: Vec<(f64, bool)> = judged
        .iter()
        .filter(|j| matches!(j.truth, Truth::Catalogue(_)))
        .flat_map(|j| j.answer.causes.iter().map(|cause| (cause, j.is_right_of(cause))))
        .filter_map(|(cause, right)| Some((cause.probability?, right)))
        .collect();
    let bin = |bounds: &[f64]| {
        let (low, high) = (bounds[0], bounds[1]);
        let last = high >= 1.0;
        let inside: Vec<&(f64, bool)> =
            said.iter().filter(|(p, _)| *p >= low && (*p < high || last)).collect();
        Calibration {
            bin: (low, high),
            said: inside.iter().map(|(p, _)| p).sum::<f64>() / inside.len().max(1) as f64,
            hits: inside.iter().filter(|(_, right)| *right).count(),
            causes: inside.len(),
        }
    };
    BINS.windows(2).map(bin).collect()
}

#[cfg(test)]
mod tests;

//! What a diagnosis answered to a trial, as it is kept, and the finished trial.

use serde::{Deserialize, Serialize};

use super::{
    case::{Drawn, Label},
    proposal::Proposed,
    seal::digest,
};
use crate::{
    diagnosis::{Diagnosis, Verdict, finding},
    effect::{self, Effect},
    simulator::{Dose, SimulationError},
};

/// An effect that was asserted. Figures that are not finite are kept as none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Asserted {
    /// Its id.
    pub effect: String,
    /// Probability that it was given.
    pub probability: Option<f64>,
    /// Effects that were said to be the same here.
    pub equivalents: Vec<String>,
    /// Its parameters; none for an episode that has not ended.
    pub parameters: Vec<(String, Option<f64>)>,
    /// Their standard errors.
    #[serde(default)]
    pub std_errors: Vec<(String, Option<f64>)>,
}

impl Asserted {
    /// A parameter and its standard error, where both are numbers.
    pub fn amount(&self, name: &str) -> Option<(f64, f64)> {
        let of = |list: &[(String, Option<f64>)]| list.iter().find(|(own, _)| own == name)?.1;
        Some((of(&self.parameters)?, of(&self.std_errors)?))
    }
}

/// What is kept of a diagnosis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// The verdict; none where the diagnosis came to no end.
    pub verdict: Option<Verdict>,
    /// Effects that were asserted.
    pub causes: Vec<Asserted>,
    /// Effects that hold each cause.
    pub credible_set: Vec<String>,
    /// Share of the gap that all causes are said to close.
    pub gap_closed: Option<f64>,
    /// Its interval.
    pub gap_closed_ci95: Option<[f64; 2]>,
    /// Where the gap was said to lie: sensor and driver.
    pub places: Vec<String>,
    /// Formulas that were proposed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub proposals: Vec<Proposed>,
}

impl Answer {
    /// Of a diagnosis, or of none where it came to no end.
    pub fn of(diagnosis: Option<&Diagnosis>) -> Self {
        let Some(diagnosis) = diagnosis else {
            return Self {
                verdict: None,
                causes: Vec::new(),
                credible_set: Vec::new(),
                gap_closed: None,
                gap_closed_ci95: None,
                places: Vec::new(),
                proposals: Vec::new(),
            };
        };
        let finite = |value: f64| value.is_finite().then_some(value);
        let cause = |cause: &finding::Cause| Asserted {
            effect: cause.effect.clone(),
            probability: finite(cause.probability),
            equivalents: cause.equivalents.clone(),
            parameters: cause.parameters.iter().map(|p| (p.name.clone(), p.value.and_then(finite))).collect(),
            std_errors: cause
                .parameters
                .iter()
                .map(|p| (p.name.clone(), p.std_error.and_then(finite)))
                .collect(),
        };
        let place = |place: &finding::Place| format!("{} {}", place.sensor, place.driver);
        Self {
            verdict: Some(diagnosis.verdict),
            causes: diagnosis.causes.iter().map(cause).collect(),
            credible_set: diagnosis.credible_set.clone(),
            gap_closed: diagnosis.gap_closed_total.and_then(finite),
            gap_closed_ci95: diagnosis
                .gap_closed_total_ci95
                .filter(|interval| interval.iter().all(|bound| bound.is_finite())),
            places: diagnosis.places.iter().take(3).map(place).collect(),
            proposals: Vec::new(),
        }
    }

    /// The effects as they were fitted, ready for the simulator; those it does not know are left out.
    fn doses(&self, own: &[&'static Effect]) -> Vec<Dose> {
        let dose = |cause: &Asserted| {
            let effect = effect::user::find_among(&cause.effect, own)?;
            let asserted =
                |name: &str| cause.parameters.iter().find(|(own, _)| own == name).map(|(_, value)| *value);
            let value = |parameter: &effect::Parameter| match asserted(&parameter.name) {
                Some(Some(value)) => value,
                // An episode that has not ended.
                Some(None) => f64::INFINITY,
                None => parameter.neutral(0.0),
            };
            Some(Dose { effect, values: effect.parameters.iter().map(value).collect() })
        };
        self.causes.iter().filter_map(dose).collect()
    }
}

/// A trial that is over: one line of the set's file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Finished {
    /// Name of the case.
    pub case: String,
    /// The label's text, of which the seal is the hash.
    pub label: String,
    /// The answer.
    pub answer: Answer,
    /// Share of the gap that the causes, as they were fitted, truly close.
    pub truly_closed: Option<f64>,
    /// Time the diagnosis took, s.
    pub seconds: f64,
}

impl Finished {
    /// The label, opened; `None` where it is not one.
    pub fn opened(&self) -> Option<Label> {
        serde_json::from_str(&self.label).ok()
    }

    /// The seal of its label.
    pub fn seal(&self) -> String {
        digest(&self.label)
    }
}

/// The share of the gap's whitened square that the asserted effects, as they were fitted, close:
///
/// ```text
/// φ = 1 − Σ λ(y, ŷ) / Σ λ(y, y₀)      y: all true effects, ŷ: the asserted ones, y₀: none; over sensors
/// ```
///
/// all of them runs without noise of the trial's own unit and rig; λ(a, b) is the whitened square of what is left of run
/// a where the baseline is fitted to it on top of run b, see [`Lambda::remainder`]. `None` without causes, or without a
/// gap.
///
/// [`Lambda::remainder`]: super::lambda::Lambda::remainder
///
/// # Errors
///
/// [`SimulationError`], when an effect as fitted is beyond reason.
pub fn truly_closed(
    drawn: &Drawn,
    answer: &Answer,
    own: &[&'static Effect],
) -> Result<Option<f64>, SimulationError> {
    let doses = answer.doses(own);
    if doses.is_empty() || drawn.simulation.doses.is_empty() {
        return Ok(None);
    }
    let lambda = &drawn.lambda;
    let (truth, fitted) = (lambda.run(&drawn.simulation.doses)?, lambda.run(&doses)?);
    let whole: f64 = lambda.remainder(&truth, &lambda.healthy).iter().sum();
    let left: f64 = lambda.remainder(&truth, &fitted).iter().sum();
    Ok((whole > 0.0).then(|| 1.0 - left / whole))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::blind::{
        case::{Case, draw},
        seal::Nonce,
    };

    /// Parameters as an answer gives them.
    pub(in crate::blind) type Amounts = Vec<(String, Option<f64>)>;

    /// An answer that asserts these effects with these parameters.
    pub(in crate::blind) fn asserting(verdict: Verdict, causes: &[(&str, Amounts)]) -> Answer {
        let cause = |(effect, parameters): &(&str, Amounts)| Asserted {
            effect: (*effect).to_owned(),
            probability: Some(0.99),
            equivalents: Vec::new(),
            parameters: parameters.clone(),
            std_errors: Vec::new(),
        };
        Answer {
            verdict: Some(verdict),
            causes: causes.iter().map(cause).collect(),
            credible_set: causes.iter().map(|(effect, _)| (*effect).to_owned()).collect(),
            ..Answer::of(None)
        }
    }

    #[test]
    fn the_truth_closes_all_half_of_it_three_quarters() {
        let drawn = draw(&Nonce::parse("5").unwrap(), Case::Afflicted(0)).unwrap();
        let [present] = &drawn.label.effects[..] else { panic!("{:?}", drawn.label) };
        let effect = effect::find(&present.effect).unwrap();
        let closed = |share: f64| {
            let parameters =
                effect.parameters.iter().zip(&present.parameters).map(|(parameter, (name, value))| {
                    (name.clone(), Some(if parameter.switches() { value * share } else { *value }))
                });
            let answer = asserting(Verdict::Explained, &[(&present.effect, parameters.collect())]);
            truly_closed(&drawn, &answer, &[]).unwrap().unwrap()
        };
        assert!((closed(1.0) - 1.0).abs() < 1e-9, "{present:?}");
        assert!((closed(0.5) - 0.75).abs() < 0.05, "{present:?}: {}", closed(0.5));
        assert!(closed(-1.0) < -2.5, "{present:?}");
        assert_eq!(truly_closed(&drawn, &Answer::of(None), &[]).unwrap(), None);
    }
}

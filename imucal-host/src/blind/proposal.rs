//! Proposed formulas of a trial: whether each is what is there, and whether another recording of the same unit confirms it.
//!
//! ```text
//! ρ = (λ(â + b̂) − λ(â − b̂)) / 4      â, b̂: what the formula and the truth change, each of λ = 1
//! ```

use serde::{Deserialize, Serialize};

use super::{
    case::Drawn,
    lambda::{Signal, difference},
    robot::{case::RobotDrawn, lambda::RobotLambda},
};
use crate::{
    diagnosis::{
        Diagnosis, Options, diagnose,
        finding::{Proposal, ProposalStatus},
        proposal::entry,
    },
    effect::Effect,
    recording::{Recording, Stream},
    simulator::{Dose, SimulationError},
};

/// Correlation of what a formula and the truth change from which on they are the same.
pub const SAME: f64 = 0.95;

/// What is kept of a proposal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Proposed {
    /// `acc`, `gyr` or `mag`.
    pub sensor: String,
    /// The formula.
    pub formula: String,
    /// ρ, over all sensors; none where nothing is there.
    pub correlation: Option<f64>,
    /// Another recording of the same unit confirms it; none where that could not show it.
    pub confirmed: Option<bool>,
}

impl Proposed {
    /// It, or what this recording cannot distinguish from it, is there.
    pub fn is_right(&self) -> bool {
        self.correlation.is_some_and(|correlation| correlation > SAME)
    }
}

/// The proposals of a diagnosis of the rig.
///
/// # Errors
///
/// [`SimulationError`], where a formula cannot be simulated.
pub fn of_rig(drawn: &Drawn, diagnosis: &Diagnosis) -> Result<Vec<Proposed>, SimulationError> {
    let (lambda, doses) = (&drawn.lambda, &drawn.simulation.doses);
    let second = |options: &Options| {
        let recording = drawn.simulation.again().record("second.csv")?;
        Ok(diagnose(&recording, options, &|_| ()))
    };
    let of = |proposal: &Proposal| {
        let signal = |doses: &[Dose]| Ok(difference(&lambda.run(doses)?, &lambda.healthy));
        let square = |signal: &Signal| lambda.of(signal, &[]).iter().sum();
        let correlation = correlation(doses, &entry::effects(&proposal.toml), &signal, &square)?;
        proposed(proposal, correlation, &second)
    };
    diagnosis.proposals.iter().map(of).collect()
}

/// The proposals of a diagnosis of a robot.
///
/// # Errors
///
/// As [`of_rig`].
pub fn of_robot(drawn: &RobotDrawn, diagnosis: &Diagnosis) -> Result<Vec<Proposed>, SimulationError> {
    if diagnosis.proposals.is_empty() {
        return Ok(Vec::new());
    }
    let lambda = RobotLambda::new(&drawn.scene)?;
    let second = |options: &Options| {
        let pair = drawn.scene.again().record("second")?;
        let options = Options { stream: Stream::of(&pair.simulated), ..options.clone() };
        Ok(diagnose(&pair.real as &Recording, &options, &|_| ()))
    };
    let of = |proposal: &Proposal| {
        let signal = |doses: &[Dose]| Ok(difference(&lambda.run(doses)?, &lambda.healthy));
        let square = |signal: &Signal| lambda.of(signal, &[]);
        let effects = entry::effects(&proposal.toml);
        let correlation = correlation(&drawn.scene.doses, &effects, &signal, &square)?;
        proposed(proposal, correlation, &second)
    };
    diagnosis.proposals.iter().map(of).collect()
}

fn proposed(
    proposal: &Proposal,
    correlation: Option<f64>,
    second: &dyn Fn(&Options) -> Result<Diagnosis, SimulationError>,
) -> Result<Proposed, SimulationError> {
    let effects = entry::effects(&proposal.toml);
    let options = Options { effects, frozen: Some(proposal.toml.clone()), ..Options::default() };
    // Without anything there, there is nothing to be confirmed.
    let confirmed = match correlation {
        Some(_) => second(&options)?.proposals.first().map(|found| found.status == ProposalStatus::Confirmed),
        None => None,
    };
    Ok(Proposed {
        sensor: proposal.sensor.clone(),
        formula: proposal.formula.clone(),
        correlation,
        confirmed,
    })
}

/// ρ of the true doses and of a proposal's effects as they were fitted; `None` where either changes nothing.
fn correlation(
    truth: &[Dose],
    effects: &[&'static Effect],
    signal: &dyn Fn(&[Dose]) -> Result<Signal, SimulationError>,
    square: &dyn Fn(&Signal) -> f64,
) -> Result<Option<f64>, SimulationError> {
    let fitted: Vec<Dose> = effects.iter().filter_map(|effect| entry::fitted(effect)).collect();
    let unit = |doses: &[Dose]| -> Result<Option<Signal>, SimulationError> {
        let signal = signal(doses)?;
        let size = libm::sqrt(square(&signal));
        Ok((size > 1e-6).then(|| signal.map(|values| values.iter().map(|v| v / size).collect())))
    };
    let (Some(truth), Some(formula)) = (unit(truth)?, unit(&fitted)?) else { return Ok(None) };
    let opposite = formula.each_ref().map(|values| values.iter().map(|v| -v).collect());
    Ok(Some(0.25 * (square(&difference(&truth, &opposite)) - square(&difference(&truth, &formula)))))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use nalgebra::Vector3;

    use super::*;
    use crate::effect::user;

    /// An effect on two axes with these fitted amplitudes.
    fn effect(fitted: [f64; 2]) -> &'static Effect {
        let [x, y] = fitted.map(|value| format!("{{ value = {value:e}, std_error = 1e-3 }}"));
        let text = format!(
            "[[effect]]\nid = \"acc.own\"\nsensor = \"acc\"\naxes = [\"x\", \"y\"]\nformula = \"B\"\nunit = \"SI\"\n\
             amplitude = {{ typical = 1.0, material = 0.1 }}\nfitted = {{ x = {x}, y = {y} }}\ncause = \"c\"\n\
             remedy = \"r\"\n"
        );
        user::parse(&text, Path::new("own.toml")).unwrap()[0]
    }

    /// Of a run that changes two axes by the amplitudes alone.
    fn correlated(truth: [f64; 2], formula: [f64; 2]) -> Option<f64> {
        let signal = |doses: &[Dose]| {
            let sum = |at: usize| doses.iter().map(|dose| dose.values[at]).sum();
            Ok([vec![Vector3::new(sum(0), sum(1), 0.0)], Vec::new(), Vec::new()])
        };
        let square = |signal: &Signal| signal.iter().flatten().map(Vector3::norm_squared).sum();
        let truth = Dose { effect: effect(formula), values: truth.to_vec() };
        correlation(&[truth], &[effect(formula)], &signal, &square).unwrap()
    }

    #[test]
    fn correlation_is_that_of_what_formula_and_truth_change() {
        let close = |found: Option<f64>, expected: f64| {
            assert!(found.is_some_and(|found| (found - expected).abs() < 1e-9), "{found:?} {expected}");
        };
        close(correlated([1.0, 2.0], [0.1, 0.2]), 1.0);
        close(correlated([1.0, 2.0], [-0.1, -0.2]), -1.0);
        close(correlated([1.0, 0.0], [0.0, 3.0]), 0.0);
        close(correlated([1.0, 0.0], [1.0, 1.0]), 0.5f64.sqrt());
        assert_eq!(correlated([0.0, 0.0], [1.0, 0.0]), None);
    }
}

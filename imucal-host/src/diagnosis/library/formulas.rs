//! A user's effects among the candidates: those whose formula has a value all over the recording, and of those that do
//! the same here one.
//!
//! Effects are the same where what their amplitudes multiply differs by a factor alone, for usual and extreme shapes. It
//! is compared by its sums with a few waves along the run, which any difference would change.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::candidates::Candidates;
use crate::{
    diagnosis::{error::DiagnosisError, residual::forward_model::ForwardModel},
    effect::{
        Act, Effect, Input, Role,
        user::{Formula, NotFinite},
    },
    recording::SensorKind,
    simulator::OutputError,
};

/// Sums by which two effects are compared.
const WAVES: usize = 12;
/// Sums that differ by less than this share of their size are the same.
const SAME: f64 = 1e-9;

/// A run at some points, for each sensor's formulas.
struct Points {
    input: Vec<Input>,
    /// What the axes sense, by [`SensorKind::ALL`]; none of a sensor that is not there.
    sensed: [Vec<Vector3<f64>>; 3],
}

/// Withdraws those that have no value somewhere, and lets one of several that are the same stand for all.
///
/// # Errors
///
/// [`DiagnosisError::Simulation`], where a triad is singular.
pub fn sift(scene: &ForwardModel<'_>, candidates: &mut Candidates) -> Result<(), DiagnosisError> {
    let own: Vec<(&'static Effect, SensorKind, &'static Formula)> =
        candidates.effects.iter().filter_map(|effect| formula_of(effect)).collect();
    if own.is_empty() {
        return Ok(());
    }
    let rows = Points::new(scene, scene.given_rows())?;
    let nodes = Points::new(scene, scene.given_nodes())?;
    let waves = waves(nodes.input.len());
    let judge = |(effect, kind, formula): &(&'static Effect, SensorKind, &'static Formula)| {
        let shapes = shapes(effect);
        for shape in &shapes {
            rows.factors(*kind, formula, shape)?;
        }
        let mut sums = Vec::new();
        for shape in &shapes {
            for factor in nodes.factors(*kind, formula, shape)? {
                sums.extend(
                    waves.iter().map(|wave| factor.iter().zip(wave).map(|(a, b)| a * b).sum::<f64>()),
                );
            }
        }
        Ok(sums)
    };
    let judged: Vec<Result<Vec<f64>, NotFinite>> = own.par_iter().map(judge).collect();
    let mut kept: Vec<(&'static Effect, Vec<f64>)> = Vec::new();
    for ((effect, _, formula), sums) in own.into_iter().zip(judged) {
        let sums = match sums {
            Ok(sums) => normalised(sums),
            Err(cause) => {
                candidates.withdraw(&effect.id, cause.without_row());
                continue;
            }
        };
        let is_same = |(other, others): &&(&'static Effect, Vec<f64>)| {
            let alike = formula_of(other).is_some_and(|(_, _, own)| own.is_laid_out_like(formula));
            alike && other.sensors == effect.sensors && are_same(others, &sums)
        };
        match kept.iter().find(is_same) {
            Some((held, _)) => {
                candidates.effects.retain(|other| *other != effect);
                candidates.same.push((held, effect));
            }
            None => kept.push((effect, sums)),
        }
    }
    Ok(())
}

fn formula_of(effect: &'static Effect) -> Option<(&'static Effect, SensorKind, &'static Formula)> {
    match effect.act {
        Act::Formula(kind, formula) => Some((effect, kind, formula)),
        _ => None,
    }
}

impl Points {
    fn new(scene: &ForwardModel<'_>, input: Vec<Input>) -> Result<Self, DiagnosisError> {
        let mut sensed: [Vec<Vector3<f64>>; 3] = Default::default();
        for kind in &scene.kinds {
            let k = scene.triads[*kind as usize].sensitivity();
            let k = k.ok_or(DiagnosisError::from(OutputError::Singular { sensor: *kind }))?;
            sensed[*kind as usize] = input.iter().map(|row| k * row.given(*kind)).collect();
        }
        Ok(Self { input, sensed })
    }

    fn factors(
        &self,
        kind: SensorKind,
        formula: &Formula,
        shapes: &[f64],
    ) -> Result<Vec<Vec<f64>>, NotFinite> {
        formula.factors(&self.input, &self.sensed[kind as usize], shapes)
    }
}

/// Usual and extreme shapes, each with each.
fn shapes(effect: &Effect) -> Vec<Vec<f64>> {
    let mut shapes = vec![Vec::new()];
    for parameter in &effect.parameters {
        if let Role::Shape { usual } = parameter.role {
            let values = [usual, parameter.range.0, parameter.range.1];
            shapes = shapes
                .iter()
                .flat_map(|shape: &Vec<f64>| values.map(|value| [shape.as_slice(), &[value]].concat()))
                .collect();
        }
    }
    shapes
}

/// Waves of incommensurable lengths along a run of so many points.
fn waves(points: usize) -> Vec<Vec<f64>> {
    let wave = |order: usize| {
        let turn = libm::sqrt(2.0 + 3.0 * order as f64);
        (0..points).map(|at| libm::cos(turn * at as f64 + order as f64)).collect()
    };
    (0..WAVES).map(wave).collect()
}

/// Of a largest sum of one, if there is any.
fn normalised(sums: Vec<f64>) -> Vec<f64> {
    let most = sums.iter().copied().fold(0.0f64, |most, sum| if sum.abs() > most.abs() { sum } else { most });
    if most == 0.0 { Vec::new() } else { sums.into_iter().map(|sum| sum / most).collect() }
}

/// Their sums differ by a factor alone.
fn are_same(one: &[f64], other: &[f64]) -> bool {
    !one.is_empty() && one.len() == other.len() && one.iter().zip(other).all(|(a, b)| (a - b).abs() < SAME)
}

#[cfg(test)]
mod tests;

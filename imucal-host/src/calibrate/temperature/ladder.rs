//! Which terms of temperature a calibration keeps: what is borne out, and confirmed at temperatures held out.
//!
//! Bias, then scale, then either to second order. A group is kept where [`evidence`] says that chance hardly explains it
//! and where observations of temperatures that the fit has not seen are predicted better with it: those of [`BLOCK`] K at
//! a time are left out, at the ends of the span as well, where the terms extrapolate.

use nalgebra::{DMatrix, DVector, SMatrix};
use rayon::prelude::*;

use super::{
    evidence,
    groups::{Group, Groups},
    problem::{Fitted, ThermalProblem},
    refusal::TemperatureRefusal,
};
use crate::calibrate::fit::{
    outlier::{MOST, outliers},
    report::FitReport,
    rows::influence,
};
use imucal_core::model::thermal::{BLOCK, UNIT};

/// What became of a group.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tried {
    /// The group.
    pub group: Group,
    /// Probability of as much evidence where there is none; `None` where it cannot be distinguished from the rest.
    pub chance: Option<f64>,
    /// Rms residual at temperatures held out, with it; `None` where a fit to the others does not end.
    pub held_out: Option<f64>,
    /// It is kept.
    pub kept: bool,
}

/// A ladder, climbed.
#[derive(Clone, Debug)]
pub struct Climbed {
    /// The groups tried, in order.
    pub tried: Vec<Tried>,
    /// Rms residual at temperatures held out without terms and with those kept; `None` where a fit does not end.
    pub held_out: (Option<f64>, Option<f64>),
    /// The fit, where any group is kept.
    pub fit: Option<ThermalFit>,
    /// Observations left out as gross outliers of it.
    pub left_out: Vec<(usize, f64)>,
}

/// The fit of the groups kept.
#[derive(Clone, Debug)]
pub struct ThermalFit {
    /// Parameters and report.
    pub fitted: Fitted,
    /// Parameters that are free.
    pub free: Vec<usize>,
    /// Covariance of the free ones, in order.
    pub covariance: DMatrix<f64>,
    /// How many of them are none of temperature.
    pub model: usize,
    /// Observations used.
    pub used: Vec<usize>,
    /// Rms residual of observations left out one by one.
    pub single_held_out: Option<f64>,
}

impl ThermalFit {
    /// Covariance of the first `P` parameters, those without terms of temperature.
    pub fn first<const P: usize>(&self) -> SMatrix<f64, P, P> {
        SMatrix::from_fn(|i, j| self.covariance[(i, j)])
    }

    /// Figures of a fit to reduced observations, of `each` residuals, with those that the terms of temperature change.
    pub fn report(&self, reduced: &FitReport, each: usize) -> FitReport {
        let terms = self.free.len() - self.model;
        let freedom = (each * reduced.observations) as f64 - (reduced.parameters + terms) as f64;
        let before = freedom + terms as f64;
        FitReport {
            solver: self.fitted.report,
            rms: reduced.rms * (before / freedom).sqrt(),
            held_out_rms: self.single_held_out,
            parameters: reduced.parameters + terms,
            ..*reduced
        }
    }

    /// Standard errors of all parameters; zero where one is held.
    pub fn std(&self) -> DVector<f64> {
        let mut std = DVector::zeros(self.fitted.theta.len());
        for (row, k) in self.free.iter().enumerate() {
            std[*k] = self.covariance[(row, row)].max(0.0).sqrt();
        }
        std
    }
}

/// Which observations of `count` are in use.
type Restricted<'a> = Box<dyn ThermalProblem + 'a>;

/// Climbs; `restricted` gives the problem of some observations, by index.
///
/// # Errors
/// too-few-observations.
pub fn climb<'a>(
    count: usize,
    restricted: impl Fn(&[usize]) -> Restricted<'a>,
) -> Result<Climbed, TemperatureRefusal> {
    let mut used: Vec<usize> = (0..count).collect();
    let mut left_out = Vec::new();
    let first = restricted(&used);
    let mut climbed = of_all(&*first, &used)?;
    drop(first);
    if let Some(fit) = &climbed.fit {
        let problem = restricted(&used);
        let sizes = sizes(&*problem, &fit.fitted);
        let gross = outliers(&sizes);
        if !gross.is_empty() && gross.len() as f64 <= MOST * count as f64 {
            for (index, size) in gross.into_iter().rev() {
                left_out.push((used.remove(index), size));
            }
            left_out.sort_by_key(|(index, _)| *index);
            climbed = of_all(&*restricted(&used), &used)?;
        }
    }
    climbed.left_out = left_out;
    Ok(climbed)
}

/// Length of each observation's residual.
fn sizes(problem: &dyn ThermalProblem, fitted: &Fitted) -> Vec<f64> {
    let rows = problem.rows(fitted);
    let each = problem.each();
    if each == 1 {
        return rows.residuals.iter().copied().collect();
    }
    (0..problem.count()).map(|k| rows.residuals.rows(each * k, each).norm()).collect()
}

fn of_all(problem: &dyn ThermalProblem, used: &[usize]) -> Result<Climbed, TemperatureRefusal> {
    let all: Vec<usize> = (0..problem.count()).collect();
    // As many as there are with every linear term, and one more.
    let linear = Groups::NONE.with(Group::Bias).with(Group::Scale);
    let rows = problem.independent() as f64 / all.len().max(1) as f64;
    let need = (problem.free(linear).len() as f64 / rows).ceil() as usize + 1;
    let few = TemperatureRefusal::TooFewObservations { have: all.len(), need };
    if all.len() < need {
        return Err(few);
    }
    let none = problem.fit(Groups::NONE, &all, None).ok_or(few)?;
    let held_out_without = held_out(problem, &none);
    let (mut best, mut held) = (none, held_out_without);
    let mut tried = Vec::new();
    for group in Group::ALL.into_iter().filter(|group| problem.offered().has(*group)) {
        let added = group.with_lower().without(best.groups);
        let chance = evidence::chance(problem, &best, added);
        let with = problem.fit(best.groups.and(added), &all, Some(&best));
        let held_with = with.as_ref().and_then(|with| held_out(problem, with));
        let better = held_with.zip(held).is_some_and(|(with, without)| with < without);
        let kept = better && chance.is_some_and(|chance| chance < evidence::CHANCE);
        tried.push(Tried { group, chance, held_out: held_with, kept });
        if let Some(with) = with.filter(|_| kept) {
            (best, held) = (with, held_with);
        }
    }
    let kept = !best.groups.is_empty();
    let fit = if kept { thermal_fit(problem, best, used) } else { None };
    let held = if fit.is_some() { held } else { held_out_without };
    Ok(Climbed { tried, held_out: (held_out_without, held), fit, left_out: Vec::new() })
}

/// Rms residual at temperatures held out, a block at a time; `None` where a fit to the others does not end.
fn held_out(problem: &dyn ThermalProblem, fitted: &Fitted) -> Option<f64> {
    let changes = problem.changes();
    let least = changes.iter().copied().fold(f64::INFINITY, f64::min);
    let block = |change: f64| ((change - least) * UNIT / BLOCK).floor() as usize;
    let mut blocks: Vec<usize> = changes.iter().map(|change| block(*change)).collect();
    let of: Vec<usize> = blocks.clone();
    blocks.sort_unstable();
    blocks.dedup();
    let parts: Option<Vec<f64>> = blocks
        .par_iter()
        .map(|block| {
            let (out, kept): (Vec<usize>, Vec<usize>) = (0..of.len()).partition(|k| of[*k] == *block);
            let others = problem.fit(fitted.groups, &kept, Some(fitted))?;
            Some(problem.squared(&others, &out))
        })
        .collect();
    let sum: f64 = parts?.iter().sum();
    let rms = (sum / (problem.each() * of.len()) as f64).sqrt();
    rms.is_finite().then_some(rms)
}

fn thermal_fit(problem: &dyn ThermalProblem, fitted: Fitted, used: &[usize]) -> Option<ThermalFit> {
    let rows = problem.rows(&fitted);
    let free = problem.free(fitted.groups);
    let jacobian = rows.jacobian.select_columns(&free);
    let influence = influence(&jacobian)?;
    let covariance = problem.covariance(&rows.residuals, &jacobian, &influence)?;
    let single_held_out = single_held_out(&rows.residuals, &jacobian, &influence, problem.each());
    Some(ThermalFit {
        model: problem.free(Groups::NONE).len(),
        used: used.to_vec(),
        fitted,
        free,
        covariance,
        single_held_out,
    })
}

/// Rms residual of observations left out one by one, each by one Gauss–Newton step: (1 − H)⁻¹ r.
fn single_held_out(
    residuals: &DVector<f64>,
    jacobian: &DMatrix<f64>,
    influence: &DMatrix<f64>,
    each: usize,
) -> Option<f64> {
    let count = residuals.len() / each;
    let mut sum = 0.0;
    for k in 0..count {
        let (j, a) = (jacobian.rows(each * k, each), influence.rows(each * k, each));
        let own = DMatrix::identity(each, each) - j * a.transpose();
        sum += own.lu().solve(&residuals.rows(each * k, each).into_owned())?.norm_squared();
    }
    Some((sum / (each * count) as f64).sqrt())
}

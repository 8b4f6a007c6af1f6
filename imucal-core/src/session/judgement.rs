//! What a fit of a session comes to once its solver has stopped: errors, verdict, and the scores of the poses that might be next.

use heapless::Vec;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::{
    Session,
    design::{Lowered, Scores},
    estimate::{Estimate, to_unit_determinant},
    evidence::shell,
    fitting::{Fit, LEAST_TURNS, acc_limits},
    poses::{Pose, unit},
};
use crate::{
    accept::{self, Limits},
    fit::{Criteria, FitSummary, Observed, standard_errors},
    model::{
        Model,
        parameterisation::{FULL_GAIN, UPPER_TRIANGULAR},
        turn::TurnModel,
    },
    observation::{Block, Durations, ShellPoint, Turn},
    record::Sensor,
    triad::Triad,
};

/// Largest rms error of a turn, rad (5.7°): beyond it axes are swapped or a unit is wrong.
const LARGEST_TURN: f64 = 0.1;
/// Residuals that the noise of the rests counts as.
const PRIOR: f32 = 12.0;
/// A turn that is scored lasts so long, s; any time does, since the bias is not fitted.
const SCORED_TURN: f32 = 1.0;

impl<const N: usize, const B: usize, const M: usize> Session<N, B, M> {
    #[inline(never)]
    pub(super) fn judge(&mut self, fit: &Fit) {
        let estimate = match fit.sensor {
            Sensor::Accelerometer => self.judge_accelerometer(fit),
            Sensor::Gyroscope => self.judge_gyroscope(fit),
            Sensor::Magnetometer => self.judge_magnetometer(fit),
        };
        if let Some(slot) = self.estimates.get_mut(fit.sensor as usize) {
            *slot = estimate;
        }
        self.sense_due = fit.sensor == Sensor::Gyroscope;
    }

    #[inline(never)]
    fn judge_accelerometer(&mut self, fit: &Fit) -> Option<Estimate> {
        let triad = UPPER_TRIANGULAR.triad(fit.solver.theta());
        let points: Vec<ShellPoint<f32>, N> =
            list(self.used_poses(fit).map(|pose| ShellPoint::new(pose.acc)));
        let radius = radius(&triad, fit.norm);
        let criteria = Criteria {
            observed: Observed::Points(&points),
            limits: acc_limits(),
            radius,
            nonlinearity: true,
        };
        let summary = FitSummary::of(&fit.solver, &self.rests(fit), &triad, &criteria);
        let white = self.used_poses(fit).map(|pose| pose.acc_variance).sum::<f32>() / points.len() as f32;
        let covariance = stated(fit, Some(white));
        let std = UPPER_TRIANGULAR.triad(&standard_errors(&covariance));
        let estimate = self.estimated(fit, triad, std, summary, &criteria);
        let mut scores = Scores::NONE;
        if let Some(covariance) = covariance.filter(|_| !self.is_done(fit.sensor, &estimate)) {
            let weights = weights(&triad, radius);
            let squared = estimate.error * estimate.error;
            let variance = summary.rms * summary.rms;
            scores = Scores::of(|direction| {
                let mut lowered = Lowered { covariance: &covariance, weights: &weights, variance, sum: 0.0 };
                if let Some(raw) = triad.predict(&(direction * fit.norm)) {
                    shell(&ShellPoint::new(raw), fit.norm).rows(fit.solver.theta(), &mut lowered);
                }
                lowered.sum / squared
            });
        }
        self.scores[0] = scores;
        Some(estimate)
    }

    #[inline(never)]
    fn judge_gyroscope(&mut self, fit: &Fit) -> Option<Estimate> {
        let bias = fit.bias?;
        let turns = self.turns(fit)?;
        let acc = *turns.acc;
        let gain = FULL_GAIN.triad(fit.solver.theta()).gain;
        let triad = Triad { gain, bias: bias.mean };
        let ends: Vec<[Vector3<f32>; 2], N> = list(self.used_poses(fit).filter_map(|pose| pose.ends(&acc)));
        let limits =
            Limits { observations: 2 * LEAST_TURNS, rms: LARGEST_TURN, ..Limits::for_norm(9, LEAST_TURNS) };
        let criteria =
            Criteria { observed: Observed::TurnEnds(&ends), limits, radius: 1.0, nonlinearity: true };
        let summary = FitSummary::of(&fit.solver, &turns, &triad, &criteria);
        let covariance = stated(fit, None);
        let std = Triad { gain: FULL_GAIN.triad(&standard_errors(&covariance)).gain, bias: bias.std() };
        let estimate = self.estimated(fit, triad, std, summary, &criteria);
        let mut scores = Scores::NONE;
        let from = self.poses.list().last().map(|pose| unit(&acc.correct(&pose.acc)));
        if let Some((covariance, from)) =
            covariance.zip(from).filter(|_| !self.is_done(fit.sensor, &estimate))
        {
            let weights = weights(&triad, 1.0);
            let squared = estimate.error * estimate.error;
            let variance = summary.rms * summary.rms;
            scores = Scores::of(|to| {
                let mut lowered = Lowered { covariance: &covariance, weights: &weights, variance, sum: 0.0 };
                shortest_turn(&gain, &from, to, |turn| {
                    TurnModel { turns: core::slice::from_ref(turn), form: FULL_GAIN }
                        .rows(fit.solver.theta(), &mut lowered);
                });
                lowered.sum / squared
            });
        }
        self.scores[1] = scores;
        Some(estimate)
    }

    #[inline(never)]
    fn judge_magnetometer(&self, fit: &Fit) -> Option<Estimate> {
        let triad = UPPER_TRIANGULAR.triad(fit.solver.theta());
        let cloud = self.points_of(fit);
        let used = cloud.slots.iter().enumerate().filter(|(at, _)| fit.used.has(*at));
        let points: Vec<ShellPoint<f32>, M> = list(used.map(|(_, slot)| slot.on_shell(cloud.radius)));
        let criteria = Criteria {
            observed: Observed::Points(&points),
            limits: acc_limits(),
            radius: radius(&triad, fit.norm),
            nonlinearity: true,
        };
        let summary = FitSummary::of(&fit.solver, &cloud, &triad, &criteria);
        let covariance = stated(fit, None);
        let std = UPPER_TRIANGULAR.triad(&standard_errors(&covariance));
        let mut estimate = self.estimated(fit, triad, std, summary, &criteria);
        if let Some(covariance) = covariance.filter(|_| self.settings.field.is_none()) {
            let (triad, std, norm) = to_unit_determinant(&triad, &covariance, fit.norm);
            estimate = Estimate { triad, std, field_norm: Some(norm), ..estimate };
        }
        Some(estimate)
    }

    fn used_poses(&self, fit: &Fit) -> impl Iterator<Item = &Pose<B>> {
        let used = fit.used;
        self.poses.list().iter().enumerate().filter(move |(at, _)| used.has(*at)).map(|(_, pose)| pose)
    }

    fn estimated(
        &self,
        fit: &Fit,
        triad: Triad<f32>,
        std: Triad<f32>,
        summary: FitSummary<f32>,
        criteria: &Criteria<'_, f32>,
    ) -> Estimate {
        let count = match fit.sensor {
            Sensor::Magnetometer => self.cloud.slots().len(),
            _ => self.poses.list().len(),
        };
        Estimate {
            triad,
            std,
            summary,
            error: accept::relative_error(&triad.gain, &std, criteria.radius),
            verdict: summary.check(&triad, &std, criteria),
            field_norm: None,
            alignment_error: None,
            left_out: count.saturating_sub(fit.used.count(count)) as u8,
        }
    }
}

/// As many as there is room for: a list that is collected beyond its room panics.
fn list<V, const R: usize>(values: impl Iterator<Item = V>) -> Vec<V, R> {
    let mut list = Vec::new();
    for value in values {
        let _room = list.push(value);
    }
    list
}

/// The covariance that is stated: of the residuals' variance, with that of white noise counted as [`PRIOR`] more of them where it
/// is known, and wider by what few residuals leave open.
#[inline]
pub(super) fn stated(fit: &Fit, white: Option<f32>) -> Option<SMatrix<f32, 9, 9>> {
    let variance = fit.solver.variance()?;
    let own = fit.solver.report().independent_rows.saturating_sub(9) as f32;
    let (known, weight) = white.map_or((0.0, 0.0), |white| (white, PRIOR));
    let freedom = own + weight;
    let pooled = (variance * own + known * weight) / freedom;
    let wider = wider(freedom);
    fit.solver.factor().covariance(pooled * wider * wider)
}

/// By how much standard errors of so many degrees of freedom are wider, so that 1.96 of them are the 95 % of Student's t (to its second
/// order in 1/ν, Fisher and Cornish 1960).
#[inline]
pub(super) fn wider(freedom: f32) -> f32 {
    1.0 + 1.21 / freedom + 1.44 / (freedom * freedom)
}

/// Raw length of a vector of some norm: that of a gain of the same size in all directions.
#[inline]
fn radius(triad: &Triad<f32>, norm: f32) -> f32 {
    norm * libm::sqrtf(3.0 / triad.gain.norm_squared())
}

/// Weights of the parameters in the square of the relative error; a full gain has no bias among its parameters.
#[inline]
fn weights(triad: &Triad<f32>, radius: f32) -> SVector<f32, 9> {
    let gain = 1.0 / triad.gain.norm_squared();
    let bias = if triad.gain.m21 == 0.0 && triad.gain.m31 == 0.0 { 1.0 / (radius * radius) } else { gain };
    SVector::from([gain, gain, gain, gain, gain, gain, bias, bias, bias])
}

/// Calls with the turn that carries one direction to another the shortest way, as a gyroscope of that gain sees it.
fn shortest_turn(
    gain: &Matrix3<f32>,
    from: &Vector3<f32>,
    to: &Vector3<f32>,
    call: impl FnOnce(&Turn<'_, f32>),
) {
    // The body turns the other way than the direction does in it.
    let (axis, cosine) = (to.cross(from), from.dot(to));
    let sine = libm::sqrtf(axis.norm_squared());
    let Some(inverse) = gain.try_inverse().filter(|_| sine > 1e-3) else { return };
    let angle = libm::atan2f(sine, cosine);
    let none = Vector3::zeros();
    let block = Block { s0: inverse * (axis * (angle / sine)), s1: none, c: none };
    call(&Turn {
        blocks: core::slice::from_ref(&block),
        durations: Durations::Uniform(SCORED_TURN),
        before: *from,
        after: *to,
    });
}

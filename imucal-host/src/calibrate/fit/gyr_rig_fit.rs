//! The gyroscope's fit to motions between known attitudes: weights, search, honest errors, motions left out.
//!
//! Each motion is one residual of three components, compared once, at its end: errors at successive references within
//! a motion would have the noise before them in common. White rate noise makes that residual's variance grow with the
//! motion's length, so that a motion weighs as the inverse square root of it.

use imucal_core::{
    model::{Model, Parameterisation, RowSink, attitude::AttitudeModel, parameterisation::FULL},
    observation::Motion,
    scalar::Scalar,
    solver::LevenbergMarquardt,
    triad::Triad,
};
use nalgebra::{DMatrix, SVector, Vector3};

use super::{
    compare::Step,
    held_out::{by_steps, root_mean},
    least_squares,
    least_squares::dynamic,
    outlier::{Kept, leaving_out},
    report::FitReport,
    rows::{Residuals, Rows, influence},
    search::{SWARM_OBSERVATIONS, Search, Searched},
};
use crate::observe::motion::MotionData;

/// Largest rms error of a turn or motion, rad (5.7°): beyond it the fit has ended in a wrong minimum, or axes are swapped.
pub const LARGEST_RMS: f64 = 0.1;
/// How far a swarm looks: each entry of the gain, of the bias (rad/s; 10 °/s) and of the g-sensitivity (rad/s per
/// m/s²) to either side of its start.
pub const REACH: (f64, f64, f64) = (0.2, 0.175, 2e-3);
/// Rounds of leaving gross outliers out.
const ROUNDS: usize = 3;

/// Motions with their weights.
#[derive(Clone, Copy, Debug)]
pub struct Weighted<'a, const P: usize, T: Scalar = f64> {
    /// The motions.
    pub motions: &'a [Motion<'a, T>],
    /// Factor on each one's residuals.
    pub weights: &'a [T],
    /// What is estimated.
    pub form: Parameterisation<P>,
}

/// Passes rows on, times a weight.
struct Scaled<'a, S, T> {
    sink: &'a mut S,
    weight: T,
}

impl<const P: usize, T: Scalar, S: RowSink<T, P>> RowSink<T, P> for Scaled<'_, S, T> {
    const JACOBIAN: bool = S::JACOBIAN;

    fn row(&mut self, residual: T, jacobian: &SVector<T, P>) {
        self.sink.row(residual * self.weight, &(jacobian * self.weight));
    }
}

impl<'a, const P: usize> Weighted<'a, P> {
    /// One motion alone, its weight taken off.
    fn only(&self, k: usize) -> Weighted<'a, P> {
        Weighted { motions: &self.motions[k..=k], weights: &[1.0], form: self.form }
    }
}

impl<const P: usize, T: Scalar> Model<T, P> for Weighted<'_, P, T> {
    fn rows<S: RowSink<T, P>>(&self, theta: &SVector<T, P>, sink: &mut S) {
        for (motion, weight) in self.motions.iter().zip(self.weights) {
            let model = AttitudeModel { motions: std::slice::from_ref(motion), form: self.form };
            model.rows(theta, &mut Scaled { sink: &mut *sink, weight: *weight });
        }
    }

    fn independent_rows(&self) -> usize {
        3 * self.motions.len()
    }
}

/// The bias alone, gain nominal.
struct BiasOnly<'a>(Weighted<'a, 12>);

/// Passes on the bias's part of a derivative.
struct BiasColumns<'a, S>(&'a mut S);

impl<S: RowSink<f64, 3>> RowSink<f64, 12> for BiasColumns<'_, S> {
    const JACOBIAN: bool = S::JACOBIAN;

    fn row(&mut self, residual: f64, jacobian: &SVector<f64, 12>) {
        self.0.row(residual, &jacobian.fixed_rows::<3>(9).into_owned());
    }
}

impl Model<f64, 3> for BiasOnly<'_> {
    fn rows<S: RowSink<f64, 3>>(&self, theta: &SVector<f64, 3>, sink: &mut S) {
        let bias = Vector3::from(*theta);
        self.0.rows(&FULL.theta(&Triad { bias, ..Triad::identity() }), &mut BiasColumns(sink));
    }

    fn independent_rows(&self) -> usize {
        self.0.independent_rows()
    }
}

/// A fit and what became of it.
#[derive(Clone, Debug)]
pub struct MotionFit {
    /// Gain in table axes, and bias.
    pub triad: Triad<f64>,
    /// Estimated entries and their covariance.
    pub entries: Vec<u8>,
    /// In the entries' order.
    pub covariance: DMatrix<f64>,
    /// By how much a change of the bias during each motion moves each parameter: three rows a motion.
    pub bias_influence: DMatrix<f64>,
    /// All parameters, in the entries' order.
    pub parameters: Vec<f64>,
    /// Its figures: three residuals a motion, rms errors of a motion in rad, held out one at a time.
    pub report: FitReport,
    /// How it was reached.
    pub search: Search,
    /// Motions used, and those left out with their size in robust standard deviations.
    pub kept: Vec<usize>,
    /// See `kept`.
    pub gross: Vec<(usize, f64)>,
}

impl MotionFit {
    /// The fit as a rung of a comparison.
    pub fn step(&self, name: &'static str, adds: &'static str) -> Step {
        self.report.step(name, adds, &self.entries)
    }
}

/// Weight of each motion: the square root of the mean duration over its own.
pub fn weights(data: &[&MotionData]) -> Vec<f64> {
    let mean = data.iter().map(|d| d.duration()).sum::<f64>() / data.len().max(1) as f64;
    data.iter().map(|d| (mean / d.duration()).sqrt()).collect()
}

/// Attitude error of each motion, rad, times its weight.
fn errors<const P: usize>(model: &Weighted<'_, P>, theta: &SVector<f64, P>) -> Vec<f64> {
    lengths(&Residuals::of(model, theta))
}

fn lengths(residuals: &[f64]) -> Vec<f64> {
    residuals.chunks_exact(3).map(|r| r.iter().map(|x| x * x).sum::<f64>().sqrt()).collect()
}

fn rms(errors: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = errors.fold((0.0, 0.0), |(count, sum), e| (count + 1.0, sum + e * e));
    (sum / count).sqrt()
}

/// Rms of errors whose weights are taken off again.
fn unweighted(errors: &[f64], weights: &[f64]) -> f64 {
    rms(errors.iter().zip(weights).map(|(e, w)| e / w))
}

/// Fits the entries of `form` from the nominal gain and a static bias, rad/s; gross outliers go by name.
pub fn fit<const P: usize>(data: &[MotionData], form: Parameterisation<P>, bias: Vector3<f64>) -> MotionFit {
    let start = form.theta(&Triad { bias, ..Triad::identity() });
    let fitted = leaving_out(data.len(), ROUNDS, &mut |used, _| {
        let used: Vec<&MotionData> = used.iter().map(|k| &data[*k]).collect();
        let motions: Vec<_> = used.iter().map(|d| d.motion()).collect();
        let weights = weights(&used);
        let model = Weighted { motions: &motions, weights: &weights, form };
        let (solver, search) = searching(&model, &used, start, |searched| searched.solve());
        let errors = errors(&model, solver.theta());
        ((solver, search), errors)
    });
    let Kept { fit: (solver, search), used: kept, left_out: gross } = fitted;
    let used: Vec<&MotionData> = kept.iter().map(|k| &data[*k]).collect();
    let motions: Vec<_> = used.iter().map(|d| d.motion()).collect();
    let weights = weights(&used);
    summarise(&Weighted { motions: &motions, weights: &weights, form }, &solver, search, kept, gross)
}

/// The fit over all motions by the swarm alone, then Levenberg–Marquardt; `None` where no particle has a finite cost.
#[cfg(test)]
pub fn search<const P: usize>(
    data: &[MotionData],
    form: Parameterisation<P>,
    bias: Vector3<f64>,
) -> Option<MotionFit> {
    let used: Vec<&MotionData> = data.iter().collect();
    let motions: Vec<_> = used.iter().map(|d| d.motion()).collect();
    let weights = weights(&used);
    let model = Weighted { motions: &motions, weights: &weights, form };
    let start = form.theta(&Triad { bias, ..Triad::identity() });
    let (solver, swarm) = searching(&model, &used, start, |searched| searched.swarm())?;
    let search = Search { direct: (solver.report().termination, f64::NAN), swarm: Some(swarm) };
    Some(summarise(&model, &solver, search, (0..data.len()).collect(), Vec::new()))
}

/// Does something with the search from `start`; a swarm looks at the shortest motions.
fn searching<const P: usize, R>(
    model: &Weighted<'_, P>,
    used: &[&MotionData],
    start: SVector<f64, P>,
    then: impl FnOnce(&Searched<'_, Weighted<'_, P>, AttitudeModel<'_, f64, P>, P>) -> R,
) -> R {
    let mut shortest = used.to_vec();
    shortest.sort_by(|a, b| a.duration().total_cmp(&b.duration()));
    let motions: Vec<_> = shortest.iter().take(SWARM_OBSERVATIONS).map(|d| d.motion()).collect();
    let reach = SVector::from_fn(|k, _| match model.form.entries()[k] {
        0..9 => REACH.0,
        9..12 => REACH.1,
        _ => REACH.2,
    });
    then(&Searched {
        model,
        cost: &AttitudeModel { motions: &motions, form: model.form },
        start,
        reach,
        rms: &|theta| unweighted(&errors(model, theta), model.weights),
        limit: LARGEST_RMS,
    })
}

fn summarise<const P: usize>(
    model: &Weighted<'_, P>,
    solver: &LevenbergMarquardt<f64, P>,
    search: Search,
    kept: Vec<usize>,
    gross: Vec<(usize, f64)>,
) -> MotionFit {
    let theta = solver.theta();
    let count = model.motions.len();
    let report = FitReport {
        rms: unweighted(&errors(model, theta), model.weights),
        held_out_rms: held_out(model, theta, count, |k| model.only(k)),
        nonlinearity: imucal_core::accept::nonlinearity(solver, model, 1.0),
        ..FitReport::of(solver, count, 3)
    };
    MotionFit {
        triad: model.form.triad(theta),
        entries: model.form.entries().to_vec(),
        covariance: dynamic(&least_squares::covariance(solver)),
        bias_influence: bias_influence(model, theta).unwrap_or_else(|| DMatrix::zeros(3 * count, P)),
        parameters: theta.iter().copied().collect(),
        report,
        search,
        kept,
        gross,
    }
}

/// `None` where the motions do not determine the parameters.
fn bias_influence<const P: usize>(model: &Weighted<'_, P>, theta: &SVector<f64, P>) -> Option<DMatrix<f64>> {
    let rows = Rows::of(model, theta);
    let count = 3 * model.motions.len();
    let mut influence = influence(&rows.derivatives(count, &Vec::from_iter(0..P)))?;
    let by_bias = rows.derivatives(count, &[9, 10, 11]);
    for first in (0..count).step_by(3) {
        let moved = by_bias.rows(first, 3).tr_mul(&influence.rows(first, 3));
        influence.rows_mut(first, 3).copy_from(&moved);
    }
    Some(influence)
}

/// Rms error of motions left out in turn, rad: one Gauss–Newton step from the optimum of all, and the motion left
/// out, which `alone` gives, integrated afresh.
fn held_out<const P: usize, A: Model<f64, P>>(
    model: &impl Model<f64, P>,
    theta: &SVector<f64, P>,
    count: usize,
    alone: impl Fn(usize) -> A,
) -> Option<f64> {
    let sum = by_steps(&Rows::of(model, theta), theta, (count, 3), |k, theta| {
        lengths(&Residuals::of(&alone(k), theta)).iter().map(|e| e * e).sum()
    });
    Some(root_mean(sum?, count))
}

/// Sum of weighted squares and rms attitude error, rad, of motions under parameters that are given.
pub fn score<const P: usize>(
    data: &[MotionData],
    form: Parameterisation<P>,
    theta: &SVector<f64, P>,
) -> (f64, f64) {
    let used: Vec<&MotionData> = data.iter().collect();
    let motions: Vec<_> = used.iter().map(|d| d.motion()).collect();
    let weights = weights(&used);
    let errors = errors(&Weighted { motions: &motions, weights: &weights, form }, theta);
    (errors.iter().map(|e| e * e).sum(), unweighted(&errors, &weights))
}

/// The bias alone, gain nominal, rad/s, and the held-out rms attitude error, rad.
pub fn bias_alone(data: &[MotionData], bias: Vector3<f64>) -> (Vector3<f64>, Option<f64>) {
    let used: Vec<&MotionData> = data.iter().collect();
    let motions: Vec<_> = used.iter().map(|d| d.motion()).collect();
    let weights = weights(&used);
    let model = Weighted { motions: &motions, weights: &weights, form: FULL };
    let only = BiasOnly(model);
    let solver = least_squares::solve(&only, bias);
    let held = held_out(&only, solver.theta(), used.len(), |k| BiasOnly(model.only(k)));
    (Vector3::from(*solver.theta()), held)
}

//! The gyroscope's fit to motions between known attitudes: weights, search, honest errors, motions left out.
//!
//! Each motion is one residual of three components, compared once, at its end: errors at successive references within
//! a motion would have the noise before them in common. White rate noise makes that residual's variance grow with the
//! motion's length, so that a motion weighs as the inverse square root of it.

use imucal_core::{
    model::{
        Cost, Model, Parameterisation, RowSink,
        attitude::{AttitudeModel, AttitudePass},
        parameterisation::FULL,
    },
    observation::Motion,
    solver::{
        LevenbergMarquardt, SolveReport,
        lm::Settings,
        swarm::{self, Bounds, Swarm},
    },
    triad::Triad,
};
use nalgebra::{DMatrix, SMatrix, SVector, Vector3};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

use super::{
    compare::Step,
    norm_fit::dynamic,
    outlier::outliers,
    rows::{Residuals, Rows, influence},
};
use crate::observe::motion::MotionData;

/// Largest rms error of a motion, rad (5.7°): beyond it the fit has ended in a wrong minimum, or axes are swapped.
pub const LARGEST_RMS: f64 = 0.1;
/// How far a swarm looks: each entry of the gain, of the bias (rad/s; 10 °/s) and of the g-sensitivity (rad/s per
/// m/s²) to either side of its start.
pub const REACH: (f64, f64, f64) = (0.2, 0.175, 2e-3);
/// Particles of a swarm, and the motions it looks at, the shortest: a basin needs no more.
const PARTICLES: usize = 40;
const SWARM_MOTIONS: usize = 20;
/// Rounds of leaving gross outliers out.
const ROUNDS: usize = 3;

/// How the fit was reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Search {
    /// Levenberg–Marquardt from the static bias.
    Direct,
    /// A particle swarm, whose best Levenberg–Marquardt then polished.
    Swarm,
}

/// Motions with their weights.
#[derive(Clone, Copy, Debug)]
struct Weighted<'a, const P: usize> {
    motions: &'a [Motion<'a, f64>],
    weights: &'a [f64],
    form: Parameterisation<P>,
}

/// Passes rows on, times a weight.
struct Scaled<'a, S> {
    sink: &'a mut S,
    weight: f64,
}

impl<const P: usize, S: RowSink<f64, P>> RowSink<f64, P> for Scaled<'_, S> {
    const JACOBIAN: bool = S::JACOBIAN;

    fn row(&mut self, residual: f64, jacobian: &SVector<f64, P>) {
        self.sink.row(residual * self.weight, &(jacobian * self.weight));
    }
}

impl<'a, const P: usize> Weighted<'a, P> {
    /// One motion alone, its weight taken off.
    fn only(&self, k: usize) -> Weighted<'a, P> {
        Weighted { motions: &self.motions[k..=k], weights: &[1.0], form: self.form }
    }
}

impl<const P: usize> Model<f64, P> for Weighted<'_, P> {
    fn rows<S: RowSink<f64, P>>(&self, theta: &SVector<f64, P>, sink: &mut S) {
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
    /// The solver's report.
    pub report: SolveReport<f64>,
    /// How it was reached.
    pub search: Search,
    /// Rms attitude error of a motion, rad.
    pub rms: f64,
    /// The same of motions left out in turn.
    pub held_out_rms: Option<f64>,
    /// Departure from a parabola within one standard error.
    pub nonlinearity: f64,
    /// Sum of the weighted squares.
    pub squared_sum: f64,
    /// Motions used, and those left out with their size in robust standard deviations.
    pub kept: Vec<usize>,
    /// See `kept`.
    pub gross: Vec<(usize, f64)>,
}

impl MotionFit {
    /// The fit as a rung of a comparison.
    pub fn step(&self, name: &'static str, adds: &'static str) -> Step {
        let free = self.entries.len();
        Step {
            name,
            adds,
            entries: self.entries.clone(),
            free,
            residuals: 3 * self.kept.len(),
            squared_sum: self.squared_sum,
            rms: self.rms,
            held_out_rms: self.held_out_rms,
        }
    }
}

/// Weight of each motion: the square root of the mean duration over its own.
fn weights(data: &[&MotionData]) -> Vec<f64> {
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
    let mut kept: Vec<usize> = (0..data.len()).collect();
    let mut gross = Vec::new();
    let start = form.theta(&Triad { bias, ..Triad::identity() });
    let mut round = 0;
    loop {
        let used: Vec<&MotionData> = kept.iter().map(|k| &data[*k]).collect();
        let motions: Vec<_> = used.iter().map(|d| d.motion()).collect();
        let weights = weights(&used);
        let model = Weighted { motions: &motions, weights: &weights, form };
        let (solver, search) = solve(&model, &used, start);
        let errors = errors(&model, solver.theta());
        let out = outliers(&errors);
        if out.is_empty() || round == ROUNDS {
            return summarise(&model, &solver, search, kept, gross);
        }
        for (index, size) in out.iter().rev() {
            gross.push((kept.remove(*index), *size));
        }
        round += 1;
    }
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
    let best = scout(&model, &used, &form.theta(&Triad { bias, ..Triad::identity() }))?;
    let mut solver = LevenbergMarquardt::new(best, Settings::default());
    solver.run(&model);
    Some(summarise(&model, &solver, Search::Swarm, (0..data.len()).collect(), Vec::new()))
}

/// Levenberg–Marquardt from the start; where that ends badly, a swarm, then Levenberg–Marquardt from its best.
fn solve<const P: usize>(
    model: &Weighted<'_, P>,
    used: &[&MotionData],
    start: SVector<f64, P>,
) -> (LevenbergMarquardt<f64, P>, Search) {
    let polish = |from| {
        let mut solver = LevenbergMarquardt::new(from, Settings::default());
        solver.run(model);
        let rms = unweighted(&errors(model, solver.theta()), model.weights);
        (solver, rms)
    };
    let (direct, first) = polish(start);
    if direct.report().termination.was_successful() && first <= LARGEST_RMS {
        return (direct, Search::Direct);
    }
    let Some(best) = scout(model, used, &start) else { return (direct, Search::Direct) };
    let (polished, second) = polish(best);
    // NaN of the first is worse than anything.
    if second < first || first.is_nan() { (polished, Search::Swarm) } else { (direct, Search::Direct) }
}

/// A swarm's best over the shortest motions; `None` where no particle has a finite cost.
fn scout<const P: usize>(
    model: &Weighted<'_, P>,
    used: &[&MotionData],
    start: &SVector<f64, P>,
) -> Option<SVector<f64, P>> {
    let mut shortest = used.to_vec();
    shortest.sort_by(|a, b| a.duration().total_cmp(&b.duration()));
    let motions: Vec<_> = shortest.iter().take(SWARM_MOTIONS).map(|d| d.motion()).collect();
    let cost = AttitudeModel { motions: &motions, form: model.form };
    let reach = SVector::from_fn(|k, _| match model.form.entries()[k] {
        0..9 => REACH.0,
        9..12 => REACH.1,
        _ => REACH.2,
    });
    let bounds = Bounds::around(start, &reach)?;
    let mut swarm = Swarm::<f64, PARTICLES, P, AttitudePass<f64>>::new(bounds, swarm::Settings::default());
    // The same recording gives the same answer.
    swarm.run(&cost, &mut ChaCha8Rng::seed_from_u64(1));
    let best = *swarm.best();
    cost.cost(&best).is_finite().then_some(best)
}

fn summarise<const P: usize>(
    model: &Weighted<'_, P>,
    solver: &LevenbergMarquardt<f64, P>,
    search: Search,
    kept: Vec<usize>,
    gross: Vec<(usize, f64)>,
) -> MotionFit {
    let theta = solver.theta();
    let covariance = solver.covariance().unwrap_or_else(|| SMatrix::repeat(f64::INFINITY));
    MotionFit {
        triad: model.form.triad(theta),
        entries: model.form.entries().to_vec(),
        covariance: dynamic(&covariance),
        bias_influence: bias_influence(model, theta)
            .unwrap_or_else(|| DMatrix::zeros(3 * model.motions.len(), P)),
        parameters: theta.iter().copied().collect(),
        report: solver.report(),
        search,
        rms: unweighted(&errors(model, theta), model.weights),
        held_out_rms: held_out(model, theta, model.motions.len(), |k| model.only(k)),
        nonlinearity: imucal_core::accept::nonlinearity(solver, model, 1.0),
        squared_sum: 2.0 * solver.report().cost,
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
    let rows = Rows::of(model, theta);
    let held: Option<Vec<f64>> = (0..count)
        .map(|k| {
            let there = theta + rows.step_without(3 * k..3 * k + 3)?;
            lengths(&Residuals::of(&alone(k), &there)).first().copied()
        })
        .collect();
    Some(rms(held?.into_iter()))
}

/// Steps of a comparison below the fits: nothing estimated, and the bias alone, over the motions that `kept` names.
pub fn lower_steps(data: &[MotionData], kept: &[usize], bias: Vector3<f64>) -> [Step; 2] {
    let used: Vec<&MotionData> = kept.iter().map(|k| &data[*k]).collect();
    let motions: Vec<_> = used.iter().map(|d| d.motion()).collect();
    let weights = weights(&used);
    let model = Weighted { motions: &motions, weights: &weights, form: FULL };
    let nominal = errors(&model, &FULL.theta(&Triad::identity()));
    let rms_nominal = unweighted(&nominal, &weights);
    let only = BiasOnly(model);
    let mut solver = LevenbergMarquardt::new(bias, Settings::default());
    solver.run(&only);
    let errors = lengths(&Residuals::of(&only, solver.theta()));
    let step = |name, adds, entries: Vec<u8>, squared_sum, rms, held_out_rms| Step {
        name,
        adds,
        free: entries.len(),
        entries,
        residuals: 3 * used.len(),
        squared_sum,
        rms,
        held_out_rms,
    };
    let squares = |errors: &[f64]| errors.iter().map(|e| e * e).sum::<f64>();
    [
        step(
            "-",
            "nothing: as the sheet says",
            Vec::new(),
            squares(&nominal),
            rms_nominal,
            Some(rms_nominal),
        ),
        step(
            "B3",
            "bias",
            vec![9, 10, 11],
            squares(&errors),
            unweighted(&errors, &weights),
            held_out(&only, solver.theta(), used.len(), |k| BiasOnly(model.only(k))),
        ),
    ]
}

//! Standard errors of a norm fit: for rests whose means drift and clouds whose samples are alike in time.
//!
//! A residual is the part of a sample's noise along the shell's normal n: r = nᵀe. White noise and flicker e, each axis on
//! its own, so have the covariances
//!
//! ```text
//! V₀ = diag(Σ_a n_a² (S_a / T + q_a)),   V₁ = (Σ_a n_a n'_a S_a) F          of rests
//! ```
//!
//! with the white noise S and the converter's steps q that rests show ([`RestNoise`]), and F the covariance of unit
//! flicker ([`flicker`]). The samples of a cloud are too many for that. Those of a block see one drift e, of which they
//! give z = Σ n r = N e + white noise of covariance N, N = Σ n nᵀ: with N = Q Λ Qᵀ the rows Λ^−½ Qᵀ z have white noise of
//! unit variance, whatever is alike within a block included, flicker of covariance (Λ^½Qᵀ) F (Λ^½Qᵀ)ᵀ, and of a rest's
//! points the steps of the converter, alike: (Λ^½Qᵀ) diag(q) (Λ^½Qᵀ)ᵀ. What the solver's classical covariance lacks is
//! then a ratio for each parameter.
//!
//! Lowest frequency: what is slower than the observations nobody sees. Flicker is taken to go on for ten times as long.
//! Not modelled: flicker within a block that turns.

use std::ops::Range;

use imucal_core::{
    model::{Parameterisation, norm::NormModel},
    observation::ShellPoint,
    triad::Triad,
};
use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, SVector, Vector3};
use rayon::prelude::*;

use super::{
    norm_fit::{NormFit, NormProblem, Stated},
    rest_covariance::RestCovariance,
    rest_noise::RestNoise,
    rows::{Rows, influence, weakest_inflation},
};
use crate::noise::{
    Noise, Span, flicker,
    interval::{Errors, Parts, Scale},
};

/// Blocks of a cloud at most, and points of a block at least.
const BLOCKS: (usize, usize) = (100, 10);
/// A direction of which a block sees less than this share of what it sees of all says nothing but rounding.
const SEEN: f64 = 1e-3;
/// Correlation times of a cloud's flicker, in lengths of the cloud.
const TIMES: [f64; 4] = [0.01, 0.1, 1.0, 10.0];

/// Errors of the estimated entries.
#[derive(Clone, Debug)]
pub struct ShellErrors<const P: usize> {
    /// Covariance, ±1.96 standard errors of which hold 95 %; infinite where the Jacobian is singular.
    pub covariance: SMatrix<f64, P, P>,
    /// Standard errors over the classical ones: residuals independent, their variance known.
    pub inflation: SVector<f64, P>,
    /// Noise of the rests' means, nominal SI; `None` of a cloud, or without redundancy.
    pub noise: Option<Noise>,
}

impl<const P: usize> ShellErrors<P> {
    fn new(classical: Option<SMatrix<f64, P, P>>, errors: Option<&Errors>) -> Self {
        let Some(classical) = classical else {
            let covariance = SMatrix::repeat(f64::INFINITY);
            return Self { covariance, inflation: SVector::repeat(1.0), noise: None };
        };
        let Some(errors) = errors else {
            return Self { covariance: classical, inflation: SVector::repeat(1.0), noise: None };
        };
        let covariance = SMatrix::<f64, P, P>::from_fn(|i, j| errors.covariance[(i, j)]);
        let inflation = covariance.diagonal().component_div(&classical.diagonal()).map(f64::sqrt);
        Self { covariance, inflation, noise: None }
    }

    /// With the covariance of a fit that has further parameters.
    #[must_use]
    pub fn with_covariance(self, covariance: SMatrix<f64, P, P>) -> Self {
        let factor = covariance.diagonal().component_div(&self.covariance.diagonal()).map(f64::sqrt);
        Self { inflation: self.inflation.component_mul(&factor), covariance, ..self }
    }

    /// For whoever judges the fit.
    pub fn stated(&self, form: &Parameterisation<P>, fit: &NormFit<P>) -> Stated {
        let std = form.triad(&self.covariance.diagonal().map(f64::sqrt));
        Stated { std, inflation: weakest_inflation(&fit.solver, &self.covariance) }
    }

    /// Of rests, with what they show of the noise of their means.
    pub fn of_rests(problem: &NormProblem<'_, P>, fit: &NormFit<P>, shown: &RestNoise) -> Self {
        let normals = normals(&problem.form.triad(fit.solver.theta()), &fit.points);
        let Some(noise) = RestCovariance::along(shown, &fit.used, &normals) else {
            return Self::new(fit.solver.covariance(), None);
        };
        let rows = rows(problem, fit, &fit.points);
        let jacobian = DMatrix::from_fn(fit.points.len(), P, |row, k| rows.jacobian[row][k]);
        let errors = influence(&jacobian).and_then(|influence| {
            noise.errors(&DVector::from_column_slice(&rows.residuals), &jacobian, &influence)
        });
        let of_means = errors.as_ref().map(|errors| noise.of_means(errors));
        Self { noise: of_means, ..Self::new(fit.solver.covariance(), errors.as_ref()) }
    }

    /// Of a cloud; `at` says for each point when, s, and `shown` what rests among them show of the noise.
    pub fn of_cloud(problem: &NormProblem<'_, P>, fit: &NormFit<P>, at: &[f64], shown: &RestNoise) -> Self {
        let classical = fit.solver.covariance();
        let variance = fit.solver.variance().unwrap_or(f64::INFINITY);
        let at: Vec<f64> = fit.used.iter().map(|k| at[*k]).collect();
        let block = |of: Range<usize>| block(problem, fit, &at, of);
        let errors = fit
            .solver
            .factor()
            .covariance(1.0)
            .and_then(|unscaled| blocked(&block, (&at, shown), (&unscaled, variance)));
        Self::new(classical, errors.as_ref())
    }
}

fn rows<const P: usize>(
    problem: &NormProblem<'_, P>,
    fit: &NormFit<P>,
    points: &[ShellPoint<f64>],
) -> Rows<P> {
    let model = NormModel { points, norm: problem.norm, form: problem.form };
    Rows::of(&model, fit.solver.theta())
}

/// Unit normals of the shell at points, raw axes.
pub fn normals(triad: &Triad<f64>, points: &[ShellPoint<f64>]) -> Vec<Vector3<f64>> {
    let normal = |point: &ShellPoint<f64>| triad.gain.tr_mul(&triad.correct(&point.value)).normalize();
    points.iter().map(normal).collect()
}

/// What a block's rows come to.
struct Block<const P: usize> {
    span: Span,
    /// Λ^½ Qᵀ: how the rows see a drift.
    sees: DMatrix<f64>,
    /// Λ^−½ Qᵀ z.
    residuals: DVector<f64>,
    /// Their derivatives.
    jacobian: DMatrix<f64>,
}

fn block<const P: usize>(
    problem: &NormProblem<'_, P>,
    fit: &NormFit<P>,
    at: &[f64],
    points: Range<usize>,
) -> Block<P> {
    let own = &fit.points[points.clone()];
    let (rows, normals) = (rows(problem, fit, own), normals(&problem.form.triad(fit.solver.theta()), own));
    let mut seen = Matrix3::zeros();
    let (mut weighed, mut by) = (Vector3::zeros(), SMatrix::<f64, 3, P>::zeros());
    for ((normal, residual), derivatives) in normals.iter().zip(&rows.residuals).zip(&rows.jacobian) {
        seen += normal * normal.transpose();
        weighed += normal * *residual;
        by += normal * derivatives.transpose();
    }
    let eigen = seen.symmetric_eigen();
    let kept: Vec<usize> = (0..3).filter(|k| eigen.eigenvalues[*k] > SEEN * points.len() as f64).collect();
    let root = |k: usize| eigen.eigenvalues[k].sqrt();
    let along = |k: usize| eigen.eigenvectors.column(k);
    Block {
        span: at[points.start]..at[points.end - 1],
        sees: DMatrix::from_fn(kept.len(), 3, |row, axis| root(kept[row]) * along(kept[row])[axis]),
        residuals: DVector::from_fn(kept.len(), |row, _| along(kept[row]).dot(&weighed) / root(kept[row])),
        jacobian: DMatrix::from_fn(kept.len(), P, |row, k| {
            along(kept[row]).dot(&by.column(k)) / root(kept[row])
        }),
    }
}

/// Covariance that a converter's steps leave in blocks: all points of a rest err alike.
fn steps<'a, const P: usize>(
    blocks: &[Block<P>],
    (starts, total): (&[usize], usize),
    at: impl Fn(usize) -> &'a [f64],
    shown: &RestNoise,
) -> DMatrix<f64> {
    let mut covariance = DMatrix::zeros(total, total);
    for (span, steps) in shown.spans.iter().zip(&shown.steps) {
        // Shares of the blocks that lie in this rest; points are in time order.
        let share = |k: usize| {
            let before = |until: f64| at(k).partition_point(|at| *at < until);
            before(span.end).saturating_sub(before(span.start)) as f64 / at(k).len() as f64
        };
        let first = blocks.partition_point(|block| block.span.end < span.start);
        let beyond = blocks.partition_point(|block| block.span.start < span.end);
        let shares: Vec<(usize, f64)> =
            (first..beyond).map(|k| (k, share(k))).filter(|(_, share)| *share > 0.0).collect();
        for (k, of_k) in &shares {
            for (l, of_l) in &shares {
                let (one, other) = (&blocks[*k].sees, &blocks[*l].sees);
                let both = one * Matrix3::from_diagonal(steps) * other.transpose() * (of_k * of_l);
                let mut there = covariance.view_mut((starts[*k], starts[*l]), both.shape());
                there += both;
            }
        }
    }
    covariance
}

/// Errors of all parameters; `None` where the points are too few for blocks, which `block` makes. `unscaled` is (JᵀJ)⁻¹ and
/// `variance` that of a point.
fn blocked<const P: usize>(
    block: &(impl Fn(Range<usize>) -> Block<P> + Sync),
    (at, shown): (&[f64], &RestNoise),
    (unscaled, variance): (&SMatrix<f64, P, P>, f64),
) -> Option<Errors> {
    let count = at.len();
    let number = BLOCKS.0.min(count / BLOCKS.1);
    let bounds = |k: usize| k * count / number;
    let blocks: Vec<Block<P>> =
        (0..number).into_par_iter().map(|k| block(bounds(k)..bounds(k + 1))).collect();
    let length = at.last()? - at.first()?;
    let spans: Vec<Span> = blocks.iter().map(|block| block.span.clone()).collect();
    let times = TIMES.map(|time| time * length);
    let between = flicker::covariance_of(&spans, &flicker::of_times(&times, 1.0));
    let starts: Vec<usize> = blocks
        .iter()
        .scan(0, |next, block| {
            let start = *next;
            *next += block.residuals.len();
            Some(start)
        })
        .collect();
    let total = blocks.iter().map(|block| block.residuals.len()).sum();
    let (mut residuals, mut jacobian) = (DVector::zeros(total), DMatrix::zeros(total, P));
    let mut drift = DMatrix::zeros(total, total);
    for (k, one) in blocks.iter().enumerate() {
        let rows = one.residuals.len();
        residuals.rows_mut(starts[k], rows).copy_from(&one.residuals);
        jacobian.rows_mut(starts[k], rows).copy_from(&one.jacobian);
        for (l, other) in blocks.iter().enumerate() {
            let both = &one.sees * other.sees.transpose() * between[(k, l)];
            drift.view_mut((starts[k], starts[l]), both.shape()).copy_from(&both);
        }
    }
    // A ratio is to the variance of a point, r to that variance times the interval between points.
    let interval = length / count as f64;
    let ratios = shown.within.weigh(&Parts::drifts(count as f64, 4.0, 11), &times, |ratio| {
        ratio / (times.len() as f64 * interval)
    });
    let ends: Vec<Range<usize>> = (0..number).map(|k| bounds(k)..bounds(k + 1)).collect();
    let steps = steps(&blocks, (&starts, total), |k| &at[ends[k].clone()], shown) / variance;
    // The points' own white noise, of which blocks show only a part.
    let all = DMatrix::from_fn(P, P, |i, j| unscaled[(i, j)]);
    let influence = &jacobian * &all;
    let drifting = influence.tr_mul(&(&drift * &influence));
    let all = all + influence.tr_mul(&(&steps * &influence));
    let parts = [DMatrix::identity(total, total) + steps, drift];
    let parts = Parts { parts: &parts, ratios: &ratios, scale: Scale::Free, five: !shown.within.is_empty() };
    let column = DMatrix::from_column_slice(total, 1, residuals.as_slice());
    parts.errors_of([all, drifting], &column, &jacobian)?.pop()
}

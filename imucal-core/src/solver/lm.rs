//! Levenberg–Marquardt of fixed size, one pass over the observations an evaluation, resumable after each iteration.
//!
//! ```text
//! (JᵀJ + μD) δ = −Jᵀr,   D = diag(JᵀJ)
//! ρ = (F(θ) − F(θ + δ)) / (L(0) − L(δ)),   μ ← μ · max(⅓, 1 − (2ρ − 1)³), or μ ← μν, ν ← 2ν
//! ```
//!
//! F = ½|r|² is the cost and L its quadratic model. Source: models.md 6; Marquardt 1963 for D, Nielsen 1999
//! (IMM-REP-1999-05) for the damping. The system is solved from a triangular factor of the rows and never formed.

use nalgebra::{SMatrix, SVector};

use super::{
    condition::normalised_condition,
    panel::triangularise,
    report::{SolveReport, Termination},
    triangular::{Triangular, dot, weighted_square},
};
use crate::{
    model::{Model, SquaredSum},
    scalar::Scalar,
};

/// When to stop, and how boldly to start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings<T> {
    /// Stop once no column of the Jacobian has a larger cosine with the residual. Smaller: later. Default: the
    /// square root of the rounding unit.
    pub gradient: T,
    /// Stop before a step shorter than this share of the parameters, both scaled by D. Default: eight rounding
    /// units.
    pub step: T,
    /// Steps to try at the most. Default: 100.
    pub iterations: u16,
    /// First μ. Large: short careful steps; small: Gauss–Newton from the start. Default: 1e-3.
    pub damping: T,
}

impl<T: Scalar> Default for Settings<T> {
    fn default() -> Self {
        Self {
            gradient: T::EPSILON.root(),
            step: T::EPSILON * T::of(8.0),
            iterations: 100,
            damping: T::of(1e-3),
        }
    }
}

/// A minimisation under way.
///
/// ```
/// use imucal_core::model::{Model, RowSink};
/// use imucal_core::solver::LevenbergMarquardt;
/// use nalgebra::SVector;
///
/// /// The point with the least squared distance from some numbers: their mean.
/// struct Mean<'a>(&'a [f32]);
/// impl Model<f32, 1> for Mean<'_> {
///     fn rows<S: RowSink<f32, 1>>(&self, theta: &SVector<f32, 1>, sink: &mut S) {
///         for x in self.0 {
///             sink.row(theta.x - x, &SVector::from([1.0]));
///         }
///     }
///     fn independent_rows(&self) -> usize {
///         self.0.len()
///     }
/// }
///
/// let mut fit = LevenbergMarquardt::new(SVector::from([0.0]), Default::default());
/// let report = fit.run(&Mean(&[1.0, 2.0, 6.0]));
/// assert!(report.termination.was_successful());
/// assert!((fit.theta().x - 3.0).abs() < 1e-5);
/// ```
#[derive(Clone, Debug)]
pub struct LevenbergMarquardt<T: Scalar, const P: usize> {
    settings: Settings<T>,
    theta: SVector<T, P>,
    mu: T,
    nu: T,
    factor: Triangular<T, P>,
    factored: bool,
    iterations: u16,
    evaluations: u16,
    independent_rows: usize,
    gradient: T,
    stopped: Option<Termination>,
}

impl<T: Scalar, const P: usize> LevenbergMarquardt<T, P> {
    /// A minimisation that starts from `theta`.
    pub fn new(theta: SVector<T, P>, settings: Settings<T>) -> Self {
        Self {
            settings,
            theta,
            mu: settings.damping,
            nu: T::of(2.0),
            factor: Triangular::default(),
            factored: false,
            iterations: 0,
            evaluations: 0,
            independent_rows: 0,
            gradient: T::zero(),
            stopped: None,
        }
    }

    /// Runs to the end: [`step`](Self::step) until it says why it stopped.
    pub fn run(&mut self, model: &impl Model<T, P>) -> SolveReport<T> {
        while self.step(model).is_none() {}
        self.report()
    }

    /// One iteration: one or two passes over the observations. Says why it stopped, once it has; further calls
    /// change nothing. The model must be the same at every call.
    pub fn step(&mut self, model: &impl Model<T, P>) -> Option<Termination> {
        if self.stopped.is_none() {
            self.stopped = self.iterate(model);
        }
        self.stopped
    }

    fn iterate(&mut self, model: &impl Model<T, P>) -> Option<Termination> {
        if !self.factored
            && let Err(stop) = self.factorise(model)
        {
            return Some(stop);
        }
        if self.gradient <= self.settings.gradient {
            return Some(Termination::Gradient);
        }
        if self.iterations >= self.settings.iterations {
            return Some(Termination::Iterations);
        }
        self.iterations += 1;
        self.try_step(model)
    }

    /// Triangularises the rows at the present parameters.
    fn factorise(&mut self, model: &impl Model<T, P>) -> Result<(), Termination> {
        triangularise(model, &self.theta, &mut self.factor);
        self.evaluations = self.evaluations.saturating_add(1);
        self.independent_rows = model.independent_rows();
        let finite = self.factor.squared_sum().finite()
            && all_finite(self.factor.r().as_slice())
            && all_finite(self.theta.as_slice());
        if !finite {
            return Err(Termination::NotFinite);
        }
        self.factored = true;
        self.gradient = self.orthogonality();
        Ok(())
    }

    /// Largest cosine between the residual and a column of the Jacobian.
    fn orthogonality(&self) -> T {
        let (slopes, norms) = (self.factor.gradient(), self.factor.column_norms());
        largest_cosine(slopes.as_slice(), norms.as_slice(), self.factor.squared_sum().root())
    }

    fn try_step(&mut self, model: &impl Model<T, P>) -> Option<Termination> {
        let half = T::of(0.5);
        let scale = self.factor.column_norms();
        let Some(delta) = self.factor.damped_step(self.mu, &scale) else {
            return self.damp_more();
        };
        let squared_step = weighted_square(delta.as_slice(), scale.as_slice());
        let reach = weighted_square(self.theta.as_slice(), scale.as_slice()).root();
        if squared_step.root() <= self.settings.step * reach {
            return Some(Termination::Step);
        }
        let before = self.factor.squared_sum() * half;
        let slope = dot(delta.as_slice(), self.factor.gradient().as_slice());
        let predicted = (squared_step * self.mu - slope) * half;
        if predicted <= T::EPSILON * before {
            return Some(Termination::Precision);
        }
        let trial = self.theta + delta;
        let mut sum = SquaredSum(T::zero());
        model.rows(&trial, &mut sum);
        self.evaluations = self.evaluations.saturating_add(1);
        let ratio = (before - sum.0 * half) / predicted;
        if ratio > T::zero() && ratio.finite() {
            self.theta = trial;
            self.factored = false;
            self.damp_less(ratio);
            None
        } else {
            self.damp_more()
        }
    }

    fn damp_less(&mut self, ratio: T) {
        let excess = ratio + ratio - T::one();
        let factor = T::one() - excess * excess * excess;
        let third = T::of(1.0 / 3.0);
        self.mu *= if factor > third { factor } else { third };
        self.nu = T::of(2.0);
    }

    fn damp_more(&mut self) -> Option<Termination> {
        self.mu *= self.nu;
        self.nu *= T::of(2.0);
        // With this much damping the step is below the rounding of the parameters.
        let limit = T::one() / (T::EPSILON * T::EPSILON);
        (self.mu > limit).then_some(Termination::Stalled)
    }

    /// The parameters reached so far.
    pub fn theta(&self) -> &SVector<T, P> {
        &self.theta
    }

    /// Steps tried so far; [`report`](Self::report) gives the rest, at a cost.
    pub fn iterations(&self) -> u16 {
        self.iterations
    }

    /// The triangular factor of the rows at the last parameters that were differentiated: those of
    /// [`theta`](Self::theta) once the fit has stopped.
    pub fn factor(&self) -> &Triangular<T, P> {
        &self.factor
    }

    /// What it did so far; before it has stopped, the termination reads [`Termination::Iterations`].
    pub fn report(&self) -> SolveReport<T> {
        SolveReport {
            termination: self.stopped.unwrap_or(Termination::Iterations),
            iterations: self.iterations,
            evaluations: self.evaluations,
            independent_rows: self.independent_rows,
            cost: self.factor.squared_sum() * T::of(0.5),
            gradient: self.gradient,
            condition: normalised_condition(self.factor.r()),
        }
    }

    /// Variance of a residual, from the cost and the degrees of freedom left; `None` without any.
    pub fn variance(&self) -> Option<T> {
        let freedom = self.independent_rows.checked_sub(P).filter(|n| *n > 0)?;
        Some(self.factor.squared_sum() / T::whole(freedom as u32))
    }

    /// Covariance of the parameters for residuals that are independent and of equal variance; `None` without
    /// redundancy or where the Jacobian is singular.
    pub fn covariance(&self) -> Option<SMatrix<T, P, P>> {
        self.factor.covariance(self.variance()?)
    }
}

/// Largest of |slope| over norm and length; zero where they have none.
#[inline(never)]
fn largest_cosine<T: Scalar>(slopes: &[T], norms: &[T], length: T) -> T {
    let mut worst = T::zero();
    for (slope, norm) in slopes.iter().zip(norms) {
        let size = if *slope < T::zero() { -*slope } else { *slope };
        let reach = *norm * length;
        if reach > T::zero() {
            let cosine = size / reach;
            worst = if cosine > worst { cosine } else { worst };
        }
    }
    worst
}

#[inline(never)]
fn all_finite<T: Scalar>(figures: &[T]) -> bool {
    figures.iter().all(|x| x.finite())
}

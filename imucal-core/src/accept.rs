//! Whether a fit may become a calibration: apart from whether the solver converged.
//!
//! A small residual is not a good calibration: nine poses and nine parameters print an rms of nothing. What is
//! asked here, in this order, is whether there were enough observations, in enough directions, more of them than
//! parameters, whether the solver stopped at a minimum, whether that minimum is sharp, and whether the result can
//! be a sensor at all. The first answer that is no is the refusal, with its figures.

use nalgebra::{Matrix3, SVector};

use crate::{
    coverage::Coverage,
    model::{Model, SquaredSum},
    scalar::Scalar,
    solver::{
        LevenbergMarquardt, SolveReport, Termination,
        condition::weakest_direction,
        triangular::{dot, weighted_square},
    },
    triad::Triad,
};

pub mod f_score;
pub mod outlier;
mod refusal;

pub use refusal::{Quantity, Refusal};

/// What is asked of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Limits {
    /// Observations at least.
    pub observations: usize,
    /// Distinct directions at least; one more than parameters, so that each is checked by another.
    pub directions: usize,
    /// Least share of the sphere, 0 to 1.
    pub coverage: f64,
    /// Least variance of the directions along any axis; 0.01 is a band of ±10°.
    pub flatness: f64,
    /// Largest error of a calibrated vector to be expected, one standard error, as a share of its length
    /// ([`relative_error`]).
    pub error: f64,
    /// Largest departure from a parabola one standard error along the weakest direction, relative, of a vector as
    /// imprecise as `error` allows. Above it the standard errors do not describe the answer.
    pub nonlinearity: f64,
    /// Least and largest gain of an axis against nominal, and of one axis against another.
    pub gain: (f64, f64),
    /// Largest rms residual as a share of the calibrated norm.
    pub rms: f64,
}

impl Limits {
    /// For `parameters` of a norm fit with `directions` that determine them.
    pub fn for_norm(parameters: usize, directions: usize) -> Self {
        Self {
            observations: parameters + 1,
            directions,
            coverage: 0.25,
            flatness: 0.01,
            error: 0.06,
            nonlinearity: 0.1,
            gain: (0.5, 2.0),
            rms: 0.05,
        }
    }
}

/// Enough observations, in enough directions, and more of them than parameters.
///
/// # Errors
/// The first of too-few-observations, poor-coverage and not-redundant that holds.
pub fn check_observations<T: Scalar>(
    coverage: &Coverage<T>,
    parameters: usize,
    limits: &Limits,
) -> Result<(), Refusal> {
    if coverage.observations < limits.observations {
        return Err(Refusal::TooFewObservations { have: coverage.observations, need: limits.observations });
    }
    if coverage.share < T::of(limits.coverage) || coverage.flatness < T::of(limits.flatness) {
        return Err(Refusal::PoorCoverage {
            coverage: coverage.share.wide(),
            flatness: coverage.flatness.wide(),
            need_coverage: limits.coverage,
            need_flatness: limits.flatness,
        });
    }
    if coverage.distinct < limits.directions {
        let directions = coverage.distinct;
        return Err(Refusal::NotRedundant { directions, need: limits.directions, parameters });
    }
    Ok(())
}

/// The solver stopped at a minimum, and the arithmetic distinguishes all directions there.
///
/// # Errors
/// not-finite, did-not-converge or ill-conditioned.
pub fn check_report<T: Scalar>(report: &SolveReport<T>) -> Result<(), Refusal> {
    match report.termination {
        Termination::NotFinite => return Err(Refusal::NotFinite),
        termination if !termination.was_successful() => return Err(Refusal::DidNotConverge { termination }),
        _ => {}
    }
    let limit = T::of(DIGITS_KEPT) / T::EPSILON;
    if report.condition > limit {
        return Err(Refusal::IllConditioned { condition: report.condition.wide(), limit: limit.wide() });
    }
    Ok(())
}

/// Beyond this share of 1/ε a condition leaves no two digits of the weakest combination.
const DIGITS_KEPT: f64 = 0.01;

/// Error of a calibrated vector to be expected from the standard errors of gain and bias, as a share of its length: the
/// root mean square over all directions and, of the gain, over its columns.
///
/// ```text
/// √( |σ_G|² / |G|² + |σ_b|² / r² )
/// ```
///
/// with r the vector's length in raw units. It is what a condition number cannot know: how good the observations are.
/// The largest number there is where a standard error is infinite or NaN.
pub fn relative_error<T: Scalar>(gain: &Matrix3<T>, std: &Triad<T>, radius: T) -> T {
    let squared = |values: &[T]| dot(values, values);
    let of_gain = squared(std.gain.as_slice()) / squared(gain.as_slice());
    let of_bias = squared(std.bias.as_slice()) / (radius * radius);
    let error = (of_gain + of_bias).root();
    if error.finite() { error } else { T::LARGEST }
}

/// The standard errors come to no more than a calibration may be wrong by.
///
/// # Errors
/// ill-conditioned, with the error.
pub fn check_precision<T: Scalar>(error: T, limits: &Limits) -> Result<(), Refusal> {
    if error > T::of(limits.error) {
        return Err(Refusal::Imprecise { error: error.wide(), limit: limits.error });
    }
    Ok(())
}

/// Where the cost's rounding is a larger share of the rise that is looked for, the rise says nothing: the residuals
/// are hardly more than rounding themselves, and standard errors that small stay on the parabola.
const ROUNDING_SHARE: f64 = 0.1;

/// How far rounding moves the sum of squares: 2 Σ r e, with e the rounding of the terms that a residual is made of.
fn rounding_of_cost<T: Scalar, const P: usize>(fit: &LevenbergMarquardt<T, P>, variance: T) -> T {
    let here = fit.factor().squared_sum();
    let rows = here / variance + T::whole(P as u32);
    let terms = weighted_square(fit.theta().as_slice(), fit.factor().column_norms().as_slice());
    (here * terms / rows).root() * T::EPSILON * T::of(2.0)
}

/// How far the cost departs from its parabola one standard error along the weakest direction, relative to the
/// parabola's own rise: 0 for a linear model. `inflation` multiplies the standard error (for residuals that are
/// not independent). Infinite where there is no redundancy; 0 where the residuals are no more than rounding.
///
/// Two passes over the observations. On clouds over parts of a sphere this is what parts answers whose standard
/// errors hold from those where they do not; the condition number alone does not know the noise.
pub fn nonlinearity<T: Scalar, const P: usize>(
    fit: &LevenbergMarquardt<T, P>,
    model: &impl Model<T, P>,
    inflation: T,
) -> T {
    let Some(variance) = fit.variance() else {
        return T::LARGEST;
    };
    let here = fit.factor().squared_sum();
    if here == T::zero() {
        return T::zero();
    }
    let Some(unit) = weakest_direction(fit.factor().r()) else {
        return T::LARGEST;
    };
    // Scaled so that the parabola rises by inflation² · variance.
    let rise = fit.factor().length_of(&unit);
    let step: SVector<T, P> = unit * (variance.root() * inflation / rise);
    let expected = variance * inflation * inflation;
    if rounding_of_cost(fit, variance) > expected * T::of(ROUNDING_SHARE) {
        return T::zero();
    }
    let mut worst = T::zero();
    for trial in [fit.theta() + step, fit.theta() - step] {
        let mut sum = SquaredSum(T::zero());
        model.rows(&trial, &mut sum);
        let departure = ((sum.0 - here) / expected - T::one()).abs();
        worst = if departure > worst || !departure.finite() { departure } else { worst };
    }
    if worst.finite() { worst } else { T::LARGEST }
}

/// How many times the limit a departure may be where errors are small: beyond, no standard error describes anything.
const BENT_AT_MOST: f64 = 5.0;

/// The minimum is as round as standard errors assume. What a departure comes to is its share of the error
/// ([`relative_error`]): of a vector n times as precise as it need be, it may be n times the limit, and five times at
/// most.
///
/// # Errors
/// ill-conditioned, with the departure.
pub fn check_nonlinearity<T: Scalar>(nonlinearity: T, error: T, limits: &Limits) -> Result<(), Refusal> {
    let (least, most) = (T::of(limits.nonlinearity), T::of(BENT_AT_MOST * limits.nonlinearity));
    let allowed = least * T::of(limits.error) / error;
    let limit = if allowed > least { allowed } else { least };
    let limit = if limit < most { limit } else { most };
    if nonlinearity > limit {
        return Err(Refusal::TooNonlinear { nonlinearity: nonlinearity.wide(), limit: limit.wide() });
    }
    Ok(())
}

/// The result can be a sensor: axes near nominal (where `nominal` says that the input is in nominal SI) and near
/// each other, and a residual that is small against the norm.
///
/// # Errors
/// not-finite or implausible.
pub fn check_plausibility<T: Scalar>(
    triad: &Triad<T>,
    nominal: bool,
    relative_rms: T,
    limits: &Limits,
) -> Result<(), Refusal> {
    if !triad.is_finite() || !relative_rms.finite() {
        return Err(Refusal::NotFinite);
    }
    let (least, most) = (T::of(limits.gain.0), T::of(limits.gain.1));
    let (mut low, mut high) = (T::LARGEST, T::zero());
    for column in triad.gain.column_iter() {
        let gain = column.norm_squared().root();
        low = if gain < low { gain } else { low };
        high = if gain > high { gain } else { high };
        if nominal && !(gain >= least && gain <= most) {
            let limit = if gain < least { limits.gain.0 } else { limits.gain.1 };
            return Err(Refusal::Implausible { what: Quantity::Gain, value: gain.wide(), limit });
        }
    }
    let ratio = most / least;
    if high > ratio * low {
        let value = (high / low).wide();
        return Err(Refusal::Implausible { what: Quantity::AxisRatio, value, limit: ratio.wide() });
    }
    check_residual(relative_rms, limits)
}

/// The residual is small against the norm: what was measured is one vector of one length, and not a magnet or a hand.
///
/// # Errors
/// not-finite or implausible.
pub fn check_residual<T: Scalar>(relative_rms: T, limits: &Limits) -> Result<(), Refusal> {
    if !relative_rms.finite() {
        return Err(Refusal::NotFinite);
    }
    if relative_rms > T::of(limits.rms) {
        let value = relative_rms.wide();
        return Err(Refusal::Implausible { what: Quantity::Residual, value, limit: limits.rms });
    }
    Ok(())
}

#[cfg(test)]
mod tests;

//! Whether terms of temperature are borne out by the residuals that a fit without them leaves.
//!
//! ```text
//! r + J x + Z c + N d = e           by least squares over all three
//! F = (|r₀|² − |r₁|²)/q : |r₁|²/(n − p − q − d)        r₀ without Z, r₁ with it
//! W = ĉᵀ C⁻¹ ĉ  ~  χ²(q)           C: covariance of ĉ for noise that drifts
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | r, J | residuals of the fit and their derivatives by its p parameters |
//! | Z | derivatives by the q terms in question |
//! | N | derivatives by d terms that are linear in time: a drift is no evidence of temperature |
//!
//! Both chances must be small: that of F does not know that neighbouring rests are alike, that of W leans on what is known
//! of the noise. Source: Rao 1948, Wald 1943; as [`crate::calibrate::fit::score_test`], with N.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::{
    groups::Groups,
    problem::{Fitted, ThermalProblem},
};
use crate::calibrate::fit::{rows::influence, score_test::upper_tail};

/// Probability with which a group is kept that is none.
pub const CHANCE: f64 = 1e-3;

/// Probability of so large a part of the residuals where the terms are zero: the larger of the two. `None` where they
/// cannot be distinguished from the other parameters or from time.
pub fn chance(problem: &dyn ThermalProblem, fitted: &Fitted, added: Groups) -> Option<f64> {
    let rows = problem.rows(fitted);
    let free = problem.free(fitted.groups);
    let tested: Vec<usize> =
        problem.free(fitted.groups.and(added)).into_iter().filter(|k| !free.contains(k)).collect();
    let (j, z) = (rows.jacobian.select_columns(&free), rows.jacobian.select_columns(&tested));
    let n = problem.drift(fitted, fitted.groups.and(added));
    let without = side_by_side(&j, &n);
    let with = side_by_side(&without, &z);
    let left = (problem.independent()).checked_sub(with.ncols()).filter(|left| *left > 0)? as f64;
    let before = unexplained(&rows.residuals, &without)?;
    let influence = influence(&with)?;
    let coefficients = -influence.tr_mul(&rows.residuals);
    let after = &rows.residuals + &with * &coefficients;
    let q = tested.len();
    let f = ((before.norm_squared() - after.norm_squared()) / q as f64) / (after.norm_squared() / left);
    let of_f = upper_tail(f.max(0.0), q as f64, left)?;
    let covariance = problem.covariance(&rows.residuals, &with, &influence)?;
    let (from, all) = (without.ncols(), with.ncols());
    let c = coefficients.rows(from, all - from).into_owned();
    let of_w = wald(&c, &covariance.view((from, from), (q, q)).into_owned())?;
    Some(f64::max(of_f, of_w))
}

/// Probability of χ² above cᵀC⁻¹c.
fn wald(c: &DVector<f64>, covariance: &DMatrix<f64>) -> Option<f64> {
    let std = covariance.diagonal().map(f64::sqrt);
    let scaled = DMatrix::from_fn(c.len(), c.len(), |i, j| covariance[(i, j)] / (std[i] * std[j]));
    let unit = c.component_div(&std);
    let square = unit.dot(&scaled.cholesky()?.solve(&unit));
    (square >= 0.0).then_some(())?;
    Some(ChiSquared::new(c.len() as f64).ok()?.sf(square))
}

/// What columns leave of residuals.
fn unexplained(residuals: &DVector<f64>, columns: &DMatrix<f64>) -> Option<DVector<f64>> {
    Some(residuals - columns * influence(columns)?.tr_mul(residuals))
}

/// Two matrices next to each other.
pub fn side_by_side(left: &DMatrix<f64>, right: &DMatrix<f64>) -> DMatrix<f64> {
    let (rows, first) = left.shape();
    DMatrix::from_fn(rows, first + right.ncols(), |row, k| {
        if k < first { left[(row, k)] } else { right[(row, k - first)] }
    })
}

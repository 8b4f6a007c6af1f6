//! One fit by the core's solver, and what it says of itself.

use imucal_core::{
    model::Model,
    solver::{LevenbergMarquardt, lm::Settings},
};
use nalgebra::{DMatrix, SMatrix, SVector};

/// Levenberg–Marquardt from `start` to its end.
pub fn solve<const P: usize>(
    model: &impl Model<f64, P>,
    start: SVector<f64, P>,
) -> LevenbergMarquardt<f64, P> {
    let mut solver = LevenbergMarquardt::new(start, Settings::default());
    solver.run(model);
    solver
}

/// The same from a start that is near the end: undamped, which takes fewer passes over the observations.
pub fn refine<const P: usize>(
    model: &impl Model<f64, P>,
    start: SVector<f64, P>,
) -> LevenbergMarquardt<f64, P> {
    let mut solver = LevenbergMarquardt::new(start, Settings { damping: UNDAMPED, ..Settings::default() });
    solver.run(model);
    solver
}

/// Slows a step by no more than rounding does; where a step fails nevertheless, damping grows from here.
const UNDAMPED: f64 = 1e-9;

/// Rms residual with the degrees of freedom left; NaN without any.
pub fn rms<const P: usize>(solver: &LevenbergMarquardt<f64, P>) -> f64 {
    solver.variance().map_or(f64::NAN, f64::sqrt)
}

/// Covariance of the parameters for independent residuals; infinite where the Jacobian is singular.
pub fn covariance<const P: usize>(solver: &LevenbergMarquardt<f64, P>) -> SMatrix<f64, P, P> {
    solver.covariance().unwrap_or_else(|| SMatrix::repeat(f64::INFINITY))
}

/// A matrix of a run-time size, for reports.
pub fn dynamic<const P: usize>(matrix: &SMatrix<f64, P, P>) -> DMatrix<f64> {
    DMatrix::from_column_slice(P, P, matrix.as_slice())
}

//! The figures of a fit that do not depend on what was observed: of norms, poses, a reference, turns or motions.

use imucal_core::solver::{LevenbergMarquardt, SolveReport};

use super::{compare::Step, least_squares};

/// Figures of a fit.
#[derive(Clone, Copy, Debug)]
pub struct FitReport {
    /// The solver's: why it stopped, after how many steps, at which cost and condition.
    pub solver: SolveReport<f64>,
    /// Rms residual, calibrated unit (rad a turn or motion of a gyroscope).
    pub rms: f64,
    /// The same of observations left out in turn; `None` where the others do not determine the fit.
    pub held_out_rms: Option<f64>,
    /// Observations used.
    pub observations: usize,
    /// Their independent residuals.
    pub residuals: usize,
    /// Parameters estimated and not held.
    pub parameters: usize,
    /// Departure from a parabola within one standard error.
    pub nonlinearity: f64,
    /// Largest factor on a standard error for residuals alike in time; 1 where none was needed.
    pub inflation: f64,
}

impl FitReport {
    /// Of a solver at its end, from observations of `each` residuals: errors independent, nothing held out yet.
    pub fn of<const P: usize>(solver: &LevenbergMarquardt<f64, P>, observations: usize, each: usize) -> Self {
        Self {
            solver: solver.report(),
            rms: least_squares::rms(solver),
            held_out_rms: None,
            observations,
            residuals: each * observations,
            parameters: P,
            nonlinearity: 0.0,
            inflation: 1.0,
        }
    }

    /// Sum of squared residuals.
    pub fn squared_sum(&self) -> f64 {
        2.0 * self.solver.cost
    }

    /// The fit of these entries as a rung of a comparison.
    pub fn step(&self, name: &'static str, adds: &'static str, entries: &[u8]) -> Step {
        Step {
            name,
            adds,
            entries: entries.to_vec(),
            free: self.parameters,
            residuals: self.residuals,
            squared_sum: self.squared_sum(),
            rms: self.rms,
            held_out_rms: self.held_out_rms,
            second_half_rms: None,
        }
    }
}

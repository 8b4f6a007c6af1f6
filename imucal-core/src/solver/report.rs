//! Why a solver stopped, and where.

use serde::{Deserialize, Serialize};

use crate::scalar::Scalar;

/// Why a solver stopped. The order of the variants is the messages' format: append only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Termination {
    /// The residual is orthogonal to every column of the Jacobian, to the gradient tolerance.
    Gradient,
    /// The next step would be shorter than the step tolerance.
    Step,
    /// No step can lower the cost by more than its own rounding.
    Precision,
    /// A swarm has drawn together to its tolerance.
    Spread,
    /// The iterations allowed are used up.
    Iterations,
    /// Damping grew without bound: no step lowers the cost.
    Stalled,
    /// A residual, a derivative or the start is infinite or NaN.
    NotFinite,
}

impl Termination {
    /// The solver is at a stationary point, or its swarm has settled on one point; whether the calibration is any
    /// good is another question.
    pub fn was_successful(self) -> bool {
        matches!(self, Self::Gradient | Self::Step | Self::Precision | Self::Spread)
    }

    /// The word for it in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gradient => "gradient",
            Self::Step => "step",
            Self::Precision => "precision",
            Self::Spread => "spread",
            Self::Iterations => "iterations",
            Self::Stalled => "stalled",
            Self::NotFinite => "not-finite",
        }
    }
}

/// What a solver did and where it stopped.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SolveReport<T: Scalar> {
    /// Why it stopped.
    pub termination: Termination,
    /// Steps tried.
    pub iterations: u16,
    /// Passes over the observations, with or without derivatives.
    pub evaluations: u16,
    /// Independent residuals.
    pub independent_rows: usize,
    /// ½ Σ r² at the last parameters.
    pub cost: T,
    /// Largest cosine between the residual and a column of the Jacobian; 0 at a stationary point.
    pub gradient: T,
    /// Condition number of the Jacobian with its columns at unit length; infinite where it is singular.
    pub condition: T,
}

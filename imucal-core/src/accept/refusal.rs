//! Why a fit does not become a calibration, with the figures that say by how much.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::solver::Termination;

/// Why a fit was refused. The figures are those that led to it. The order of the variants is the messages' format:
/// append only.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Refusal {
    /// No stretch in which the sensor lay still.
    NoRest,
    /// The sensor was never turned.
    NoMotion,
    /// Fewer observations than needed.
    TooFewObservations {
        /// Observations there are.
        have: usize,
        /// Observations needed.
        need: usize,
    },
    /// The directions leave too much of the sphere unseen.
    PoorCoverage {
        /// Share of the sphere within reach of an observation.
        coverage: f64,
        /// Least variance of the directions along any axis.
        flatness: f64,
        /// Share needed.
        need_coverage: f64,
        /// Variance needed.
        need_flatness: f64,
    },
    /// No direction is left to check the parameters with.
    NotRedundant {
        /// Distinct directions.
        directions: usize,
        /// Directions needed.
        need: usize,
        /// Parameters estimated.
        parameters: usize,
    },
    /// The observations determine some combination of the parameters no better than the arithmetic rounds.
    IllConditioned {
        /// Condition number of the normalised Jacobian.
        condition: f64,
        /// Largest one allowed.
        limit: f64,
    },
    /// One standard error along the weakest direction already leaves the parabola that standard errors assume.
    TooNonlinear {
        /// Relative departure.
        nonlinearity: f64,
        /// Largest one allowed.
        limit: f64,
    },
    /// The solver stopped elsewhere than at a minimum.
    DidNotConverge {
        /// Why it stopped.
        termination: Termination,
    },
    /// No sensor is like that.
    Implausible {
        /// What is implausible.
        what: Quantity,
        /// Its value.
        value: f64,
        /// The nearest value that would pass.
        limit: f64,
    },
    /// A figure is infinite or NaN.
    NotFinite,
    /// What the standard errors come to: the observations hardly determine some combination of the parameters.
    Imprecise {
        /// Expected error of a calibrated vector, as a share of its length.
        error: f64,
        /// Largest one allowed.
        limit: f64,
    },
}

/// A quantity that [`Refusal::Implausible`] speaks of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Quantity {
    /// Gain of an axis against its nominal value.
    Gain,
    /// Gain of the strongest axis against the weakest.
    AxisRatio,
    /// Rms residual as a share of the norm.
    Residual,
    /// Order and sign of the axes, as the code of a signed permutation: 8 · order + signs; 0 is as it ought to be.
    Axes,
    /// Slope of the nonlinear terms over the range that they were found in.
    Slope,
    /// Part of the measured field across a rig's outer axis, as a multiple of the most that the known field has in any heading.
    Heading,
}

impl Refusal {
    /// The reason's fixed name in files.
    pub fn reason(&self) -> &'static str {
        match self {
            Self::NoRest => "no-rest",
            Self::NoMotion => "no-motion",
            Self::TooFewObservations { .. } => "too-few-observations",
            Self::PoorCoverage { .. } => "poor-coverage",
            Self::NotRedundant { .. } => "not-redundant",
            Self::IllConditioned { .. } | Self::TooNonlinear { .. } | Self::Imprecise { .. } => {
                "ill-conditioned"
            }
            Self::DidNotConverge { .. } => "did-not-converge",
            Self::Implausible { .. } => "implausible",
            Self::NotFinite => "not-finite",
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoRest => write!(f, "no stretch in which the sensor lay still"),
            Self::NoMotion => write!(f, "the sensor was never turned from one rest to another"),
            Self::TooFewObservations { have, need } => write!(f, "{have} observations, {need} needed"),
            Self::PoorCoverage { coverage, flatness, need_coverage, need_flatness } => write!(
                f,
                "directions cover {:.0} % of the sphere ({:.0} % needed), least variance along an axis \
                 {flatness:.4} ({need_flatness} needed; 0 in a plane)",
                100.0 * coverage,
                100.0 * need_coverage
            ),
            Self::NotRedundant { directions, need, parameters } => write!(
                f,
                "{directions} distinct directions for {parameters} parameters, {need} needed: nothing would check them"
            ),
            Self::IllConditioned { condition, limit } => write!(
                f,
                "condition {condition:.1e}, at most {limit:.1e}: the observations do not determine some combination of \
                 the parameters"
            ),
            Self::Imprecise { error, limit } => write!(
                f,
                "a calibrated vector is expected to be wrong by {:.1} % of its length (at most {:.1} %): the \
                 observations hardly determine some combination of the parameters",
                100.0 * error,
                100.0 * limit
            ),
            Self::TooNonlinear { nonlinearity, limit } => write!(
                f,
                "the cost departs {:.0} % from a parabola within one standard error (at most {:.0} %): \
                 too little of the sphere for this noise",
                100.0 * nonlinearity,
                100.0 * limit
            ),
            Self::DidNotConverge { termination } => write!(f, "the solver stopped by {}", termination.name()),
            Self::Implausible { what: Quantity::Gain, value, limit } => {
                write!(f, "an axis has {value:.3} times its nominal gain, the limit is {limit}")
            }
            Self::Implausible { what: Quantity::AxisRatio, value, limit } => {
                write!(f, "one axis has {value:.2} times the gain of another, the limit is {limit}")
            }
            Self::Implausible { what: Quantity::Residual, value, limit } => write!(
                f,
                "rms residual {:.1} % of the norm, the limit is {:.1} %",
                100.0 * value,
                100.0 * limit
            ),
            Self::Implausible { what: Quantity::Axes, value, .. } => {
                write!(f, "the axes are in another order or of another sign (code {value:.0}, 0 expected)")
            }
            Self::Implausible { what: Quantity::Slope, value, limit } => {
                write!(f, "the nonlinear terms reach a slope of {value:.3}, the limit is {limit}")
            }
            Self::Implausible { what: Quantity::Heading, value, .. } => write!(
                f,
                "no heading of the base gives the known field: across the outer axis it would have to be {value:.3} times as large"
            ),
            Self::NotFinite => write!(f, "a figure is infinite or NaN"),
        }
    }
}

impl core::error::Error for Refusal {}

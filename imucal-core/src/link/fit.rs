//! Messages of a fit on board: what to fit, what to, and how it ended.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::{
    accept::Refusal,
    observation::Block,
    record::{RawUnit, Sensor},
    solver::Termination,
};

/// Parameters of the largest fit.
pub const MOST_PARAMETERS: usize = 14;
/// Entries of its covariance on and above the diagonal.
pub const MOST_COVARIANCE: usize = MOST_PARAMETERS * (MOST_PARAMETERS + 1) / 2;

/// A model that a device fits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FitModel {
    /// Accelerometer, upper triangular gain and bias, from rests.
    T9,
    /// Accelerometer, full gain and bias and the base's levelling, from rests on a rig.
    I14,
    /// Magnetometer, an ellipsoid, from single samples.
    E9,
    /// Gyroscope, full gain and bias, from turns between rests.
    K12,
}

impl FitModel {
    /// All, in the order of the messages.
    pub const ALL: [Self; 4] = [Self::T9, Self::I14, Self::E9, Self::K12];

    /// The sensor it calibrates.
    pub fn sensor(self) -> Sensor {
        match self {
            Self::T9 | Self::I14 => Sensor::Accelerometer,
            Self::E9 => Sensor::Magnetometer,
            Self::K12 => Sensor::Gyroscope,
        }
    }

    /// Its name in a record.
    pub fn name(self) -> &'static str {
        match self {
            Self::T9 => "T9",
            Self::I14 => "I14",
            Self::E9 => "E9",
            Self::K12 => "K12",
        }
    }
}

/// What to fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FitTask {
    /// The model.
    pub model: FitModel,
    /// Length of what is measured: gravity, m/s², or the field, µT. Not looked at for a gyroscope.
    pub norm: f32,
    /// Rig axes, outermost first, 0 to 2: of I14 alone.
    pub axes: [u8; 3],
    /// Bias to start from, nominal SI. Of a gyroscope, what its blocks were made less of: the fit adds what is left.
    pub bias: [f32; 3],
    /// Unit of the raw samples that the calibration is for.
    pub unit_in: RawUnit,
    /// `raw = offset + per_unit · nominal SI`: what the result is restated by.
    pub offset: f32,
    /// See `offset`.
    pub per_unit: f32,
    /// Search with a swarm of this seed before descending: of a gyroscope alone.
    pub search: Option<u64>,
}

/// One thing that a fit is made to, nominal SI.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Observation {
    /// Mean of a rest, or a sample of a field: value, and the distance outside the shell that is expected of it.
    Point([f32; 3], f32),
    /// Mean of a rest on a rig, and sines and cosines of the encoder angles, outermost first.
    Pose([f32; 3], [f32; 3], [f32; 3]),
    /// The next turn: direction of the specific force before and after, unit vectors, calibrated axes.
    Turn([f32; 3], [f32; 3]),
    /// A block of the last turn: s0, s1, c and its duration, s ([`Block`]).
    Block([f32; 3], [f32; 3], [f32; 3], f32),
}

impl Observation {
    /// A block of a turn.
    pub fn block(block: &Block<f32>, duration: f32) -> Self {
        Self::Block(block.s0.into(), block.s1.into(), block.c.into(), duration)
    }
}

/// How far a fit is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FitProgress {
    /// Observations taken: the index of the next.
    pub observations: u16,
    /// Iterations of the swarm.
    pub searched: u16,
    /// Iterations of Levenberg–Marquardt.
    pub iterations: u16,
    /// It has stopped, and can be finished.
    pub stopped: bool,
}

/// How a fit ended. Figures as of [`SolveReport`](crate::solver::SolveReport).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FitReport {
    /// What was fitted.
    pub model: FitModel,
    /// Why the solver stopped.
    pub termination: Termination,
    /// Steps tried.
    pub iterations: u16,
    /// Passes over the observations.
    pub evaluations: u16,
    /// Independent residuals.
    pub independent_rows: u32,
    /// ½ Σ r².
    pub cost: f32,
    /// Largest cosine between the residual and a column of the Jacobian.
    pub gradient: f32,
    /// Condition number of the Jacobian with columns at unit length.
    pub condition: f32,
    /// Departure from a parabola one standard error along the weakest direction.
    pub nonlinearity: f32,
    /// Share of the sphere of directions seen.
    pub coverage: f32,
    /// Why the fit is not accepted; `None` where it is.
    pub refusal: Option<Refusal>,
    /// The parameters, in the order of the model's form.
    pub theta: Vec<f32, MOST_PARAMETERS>,
    /// Their covariance: columns from the top to the diagonal; empty where it is singular.
    pub covariance: Vec<f32, MOST_COVARIANCE>,
}

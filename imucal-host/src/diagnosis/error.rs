//! Why a diagnosis cannot be made: the stage that failed, and the figure that shows why.

use thiserror::Error;

use crate::{effect::user::NotFinite, recording::SensorKind, simulator::OutputError};

/// Why a diagnosis cannot be made.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum DiagnosisError {
    /// Before any fit: what the recording or its manifest lacks.
    #[error("{0}")]
    Recording(String),
    /// Simulation: a sensor's gain is singular.
    #[error("the {sensor} cannot be simulated: the gain of its triad is singular")]
    Simulation {
        /// The sensor.
        sensor: SensorKind,
    },
    /// Simulation: a user's formula has no value in this recording.
    #[error("{}: {}", .0.effect, .0.without_row())]
    Formula(Box<NotFinite>),
    /// Fit of the baseline, or of it and a set of effects.
    #[error(
        "the baseline cannot be fitted to this recording: the normal equations of {columns} columns are singular"
    )]
    Fit {
        /// Number of the fitted columns.
        columns: usize,
    },
    /// Scan of nonlinear parameters.
    #[error("no value of the nonlinear parameters of {effect} can be scored")]
    Grid {
        /// Id of the effect.
        effect: &'static str,
    },
    /// Scores of effects after the projection of what is fitted.
    #[error("effects cannot be scored: the information of {columns} fitted columns is not positive definite")]
    Score {
        /// Number of the fitted columns.
        columns: usize,
    },
    /// Joint scores, with pointing errors that all sensors share.
    #[error(
        "a set of {effects} effects has no evidence that is a number under any size of the pointing errors"
    )]
    JointScore {
        /// Number of the effects.
        effects: usize,
    },
    /// Score tests against covariates.
    #[error("no score test can be made against {covariate}, which has no column")]
    ScoreTest {
        /// Name of the covariate.
        covariate: String,
    },
    /// Alternatives of a cause.
    #[error("the alternatives of {effect} cannot be ranked: it is not among the candidates")]
    Alternatives {
        /// Id of the effect.
        effect: &'static str,
    },
    /// Cross-validation.
    #[error("held-out data cannot be predicted: without fold {fold} the {columns} columns are singular")]
    CrossValidation {
        /// The fold that is left out.
        fold: usize,
        /// Number of the fitted columns.
        columns: usize,
    },
    /// Standard errors of the causes' parameters.
    #[error(
        "standard errors cannot be computed: the information of {columns} columns is not positive definite"
    )]
    Estimates {
        /// Number of the columns.
        columns: usize,
    },
}

impl From<OutputError> for DiagnosisError {
    fn from(error: OutputError) -> Self {
        match error {
            OutputError::Singular { sensor } => Self::Simulation { sensor },
            OutputError::NotFinite(cause) => Self::Formula(Box::new(cause)),
        }
    }
}

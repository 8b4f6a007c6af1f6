//! Why there is no simulation.

use crate::{effect::user::NotFinite, recording::SensorKind};

/// A triad's output that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)] // The fields are those of each message.
pub enum OutputError {
    /// An effect that leaves no sensor.
    #[error(
        "{sensor}: its axes do not span space any more, expected independent ones; reduce the size of the effect"
    )]
    Singular { sensor: SensorKind },
    /// A user's formula without a value.
    #[error(transparent)]
    NotFinite(#[from] NotFinite),
}

/// A simulation that cannot be; its text says what was found, what was expected and what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)] // The fields are those of each message.
pub enum SimulationError {
    /// The movements of a programme take longer.
    #[error(
        "the programme `{programme}` was given {duration} s, expected at least {shortest:.0} s; give it more time or choose a shorter programme"
    )]
    TooShort { programme: &'static str, duration: f64, shortest: f64 },
    /// More than memory and time allow.
    #[error("the duration is {found} s, expected at most {longest} s; shorten it")]
    TooLong { found: f64, longest: f64 },
    /// No such sampling rate.
    #[error("the sampling rate is {found} Hz, expected 10 to 1000 Hz; choose another")]
    Rate { found: f64 },
    /// Of a sensor's output.
    #[error(transparent)]
    Output(#[from] OutputError),
}

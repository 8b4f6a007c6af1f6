//! Temperature from a fit: bias and scale of a triad that follow the temperature, estimated with its other parameters.
//!
//! | file | what |
//! | --- | --- |
//! | [`thermometer`], [`course`], [`thermometry`] | whether temperatures are measured, far enough apart, and distinct from time |
//! | [`refusal`] | why not |
//! | [`groups`], [`problem`] | the terms, and a triad's model at the temperatures of its observations |
//! | [`evidence`], [`ladder`] | which terms are kept |
//! | [`terms`], [`finding`] | what is found |
//! | [`rests`], [`rest_rates`], [`turns`], [`poses`], [`motions`] | the observations: an accelerometer's rests, a gyroscope's rests and turns, poses and motions on a rig |
//!
//! The model and its fit are the core's ([`imucal_core::model::thermal`]). What is kept refers to the mean temperature of
//! the observations. Observations are then reduced to that temperature ([`terms`]), and gain, bias and all checks are made
//! of these by the same code as without temperature; standard errors are those of the fit of all parameters together. That
//! differs from the parameters of that fit by their weights alone: by what the scale changes by, some per cent of a
//! standard error.
//!
//! Not modelled: hysteresis, a lag between thermometer and sensing element, a magnetometer's terms.

pub mod course;
pub mod evidence;
pub mod finding;
pub mod groups;
pub mod ladder;
pub mod motions;
pub mod poses;
pub mod problem;
pub mod refusal;
pub mod rest_rates;
pub mod rests;
pub mod terms;
pub mod thermometer;
pub mod thermometry;
pub mod turns;

pub use finding::TemperatureFinding;
pub use refusal::TemperatureRefusal;
pub use terms::{Terms, WarmTriad};
pub use thermometry::Thermometry;

//! The gyroscope, by turns between rests (K12), along a rig or along a reference attitude.
//!
//! | goes in | comes out |
//! | --- | --- |
//! | rests, the rates between them, the calibrated accelerometer's directions | an outcome: the fit with its standard errors, or a refusal |
//!
//! | file | what |
//! | --- | --- |
//! | [`observed_turns`] | turns between rests, and the bias that is taken off them |
//! | [`turns`] | the fit to them: the field form |
//! | [`turn_errors`] | what the accelerometer's errors add to a turn's |
//! | [`motions`], [`rig`] | turns along a reference attitude, or a rig's encoders |
//! | [`bias_smoother`] | a bias that drifts between the rests |
//! | [`acceptance`] | the limits that both are judged by |
//! | [`ladder`] | forms of the model, compared by held-out residuals |

pub mod acceptance;
pub mod bias_smoother;
pub mod ladder;
pub mod motions;
pub mod observed_turns;
pub mod rig;
pub mod turn_errors;
pub mod turns;

//! Solvers of fixed size: they hold what `P` parameters need, and stream the rest.
//!
//! A solver always returns a report that says why it stopped. Whether a calibration is good enough is not its
//! question: see [`crate::accept`].

pub mod condition;
pub mod gauge;
pub mod jacobian_check;
pub mod lm;
pub mod report;
pub mod triangular;

pub use lm::LevenbergMarquardt;
pub use report::{SolveReport, Termination};

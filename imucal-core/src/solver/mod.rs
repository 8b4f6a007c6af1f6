//! Solvers of fixed size: they hold what `P` parameters need, and stream the rest.
//!
//! | solver | asks for | use |
//! | --- | --- | --- |
//! | [`lm`] | rows with derivatives ([`crate::model::Model`]) | from a start in the minimum's basin; the last digits |
//! | [`swarm`] | the cost alone ([`crate::model::Cost`]) | where there is no such start; its best is a start for `lm` |
//!
//! A solver always returns a report that says why it stopped. Whether a calibration is good enough is not its
//! question: see [`crate::accept`].

pub mod condition;
pub mod gauge;
pub mod jacobian_check;
pub mod lm;
pub mod panel;
pub mod report;
pub mod swarm;
pub mod triangular;

pub use lm::LevenbergMarquardt;
pub use report::{SolveReport, Termination};
pub use swarm::Swarm;

//! Shared fixtures of the cross-crate tests.

pub mod browser;
pub mod call_stack;
pub mod clouds;
pub mod coprocessor;
pub mod data;
pub mod firmware;
pub mod footprint;
pub mod golden;
pub mod part;
pub mod program;
pub mod rig;
pub mod robot_log;
pub mod simulated;

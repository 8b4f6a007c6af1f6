//! Shared fixtures of the cross-crate tests.

pub mod data;
pub mod firmware;
pub mod program;
pub mod simulated;

//! From samples to observations: rests, turns between them, and clouds.

pub mod block_change;
pub mod cloud;
pub mod compression;
pub mod held;
pub mod motion;
pub mod pose;
pub mod quantum;
pub mod rest;
pub mod rest_halves;
pub mod turn;
mod windowed;

//! Calibrate IMU recordings through `imucal-core`, the code that runs beside the sensor, and compare it with a
//! floating-point reference.
//!
//! Modules stand in the order of the flow; each uses what stands above it and nothing below.

#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod file;

pub mod recording;

pub mod effect;

pub mod simulator;

pub mod noise;

pub mod observe;

pub mod ellipsoid;

pub mod calibrate;

pub mod store;

pub mod apply;

pub mod device;

pub mod equivalence;

pub mod diagnosis;

pub mod blind;

pub mod report;

pub mod study;

pub mod cli;

//! Calibrate IMU recordings through `imucal-core`.

#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod recording;

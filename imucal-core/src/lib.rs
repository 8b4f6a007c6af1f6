//! Apply and fit IMU calibrations beside the sensor.
#![no_std]
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)
)]
#![deny(missing_docs)]

#[cfg(test)]
extern crate std;

// In the order of the flow: a module uses those above it, never those below.
pub mod scalar;

pub mod rotation;

pub mod triad;

pub mod temperature;

pub mod observation;

pub mod model;

pub mod solver;

pub mod coverage;

pub mod accept;

pub mod record;

pub mod corrector;

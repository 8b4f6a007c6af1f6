//! Apply and fit IMU calibrations beside the sensor.
#![no_std]
#![cfg_attr(
    not(test),
    deny(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::indexing_slicing
    )
)]
#![deny(missing_docs)]

#[cfg(test)]
extern crate std;

pub mod scalar;
pub mod triad;

pub mod temperature;

pub mod record;

pub mod corrector;

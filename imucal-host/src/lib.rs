//! Calibrate IMU recordings through `imucal-core`, the code that runs beside the sensor, and compare it with a
//! floating-point reference.
//!
//! Modules stand in the order of the flow; each uses what stands above it and nothing below.
//!
//! # Features
//!
//! | feature | what it adds |
//! | --- | --- |
//! | `cli`, by default | the program `imucal` and the module `cli` |
//! | `serial`, by default | devices at a serial port; without it [`device`] reaches those behind TCP and QEMU |
//! | `parquet` | recordings in Parquet |
//!
//! A program that uses the library takes it with `default-features = false`.

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

#[cfg(feature = "cli")]
pub mod cli;

/// The code in the README compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

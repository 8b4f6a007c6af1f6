//! Calibrate IMU recordings through `imucal-core`, the code that runs next to the sensor, and compare it with a
//! floating-point reference.
//!
//! # Architecture
//!
//! Modules stand in the order of the flow; each uses what stands above it and nothing below.
//!
//! ```text
//!  recording ──┬─► effect ──► simulator ─────────────┐
//!  file        │   catalogue   replays a movement    │
//!  samples,    │                                     ▼
//!  manifest    │                                 diagnosis ──────────► blind
//!              │                                 reference → screening → residual → mixed_model →
//!              │                                 library → search → location → verdict →
//!              │                                 proposal
//!              ├─► observe ─► calibrate ─► store ─┬─► apply ─► device
//!              │   rests,      acc, gyr, mag      │   corrects   the same on a
//!              │   motions     fit, examination   │              microcontroller
//!              │   noise, ellipsoid               └─► equivalence: f32 through the core against f64
//!              └──────────────────────────────────────────────► report, study ─► batch ─► cli
//! ```
//!
//! | stage | goes in | comes out |
//! | --- | --- | --- |
//! | [`recording`] | a CSV or Parquet file and its manifest, or a robot's log | samples in SI, warnings, which rows can be used |
//! | [`effect`] | – | the only list of what a simulator may lack; a user's own, from a file |
//! | [`simulator`] | a movement, effects | what ideal or afflicted sensors put out |
//! | [`noise`], [`observe`], [`ellipsoid`] | samples | rests, motions, turns, and the noise of their means |
//! | [`allan`] | a recording that is still, of any length | coefficients of each axis' noise, with intervals |
//! | [`calibrate`] | observations | triads with standard errors; accepted, suspect or refused |
//! | [`capture`] | samples as they arrive | what to do next, until a session has calibrated its sensors |
//! | [`store`], [`apply`], [`compose`], [`corrupt`], [`device`] | triads | records, corrected and corrupted recordings, answers of a device |
//! | [`equivalence`] | a calibration | how far the core in `f32` is from a reference in `f64` |
//! | [`diagnosis`] | a recording, effects | where the gap lies, its causes, what to record next |
//! | [`blind`], [`study`] | simulated recordings | how often answers and standard errors are right |
//! | [`export`] | a calibration, a unit's noise | files of other programs, and what they cannot say |
//! | [`report`] | any of these | text, JSON |
//! | [`batch`] | many recordings | their calibrations, a summary, units that are unlike the others |
//! | `cli` | a command line | files, text, exit status |
//!
//! A calibration of the core itself is described in [`imucal_core`].
//!
//! # Features
//!
//! | feature | what it adds |
//! | --- | --- |
//! | `cli`, by default | the program `imucal` and the module `cli` |
//! | `serial`, by default | devices at a serial port; without it [`device`] reaches those behind TCP and QEMU |
//! | `parquet`, by default | recordings and summaries of batches in Parquet |
//! | `logs`, by default | robots' logs as recordings: MCAP, ROS 2 and ROS 1 bags |
//!
//! A program that uses the library takes it with `default-features = false`.

#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod allocator;

pub mod file;

pub mod recording;

pub mod effect;

pub mod simulator;

pub mod noise;

pub mod allan;

pub mod observe;

pub mod ellipsoid;

pub mod calibrate;

pub mod store;

pub mod compare;

pub mod apply;

pub mod compose;

pub mod corrupt;

pub mod capture;

pub mod device;

pub mod equivalence;

pub mod diagnosis;

pub mod export;

pub mod blind;

pub mod report;

pub mod page;

pub mod study;

pub mod batch;

#[cfg(feature = "cli")]
pub mod cli;

/// The code in the README compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

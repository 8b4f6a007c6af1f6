//! Apply and fit IMU calibrations on the microcontroller next to the sensor.
//!
//! No `std`, no allocation, no `unsafe`, and no panic: an image that links `firmware-example`'s gate cannot hold a path
//! to one. The same arithmetic runs on a host (`libm` by name, nothing fused, sums in a fixed order), so that `f32`
//! there equals `f32` here bit for bit.
//!
//! # The flow
//!
//! ```text
//! observation → model → observer → solver → accept → record → fit → session
//!                                               record → corrector, integer
//! ```
//!
//! | stage | module | what it holds |
//! | --- | --- | --- |
//! | what is given | [`observation`] | rests, blocks of gyroscope samples, turns, points of a cloud |
//! | what is assumed | [`model`] | residual and Jacobian rows, streamed; [`triad`], [`rotation`], [`temperature`], [`nonlinearity`] below it |
//! | what is seen as samples arrive | [`observer`] | rests, turns and points of a cloud, in fixed memory |
//! | what is found | [`solver`] | Levenberg–Marquardt and particle swarm of fixed size, each with a report |
//! | whether to believe it | [`coverage`], [`accept`] | typed refusals with their figures |
//! | what is kept | [`record`] | bytes with a version and a CRC |
//! | what a fit comes to | [`fit`] | its figures, all checks in order, its part of a record |
//! | all of it, without a host | [`session`] | what to do next, and when it is enough |
//! | what is applied | [`corrector`] | `calibrated = gain · (raw − bias)`, sample by sample |
//! | what is applied without a floating-point unit | [`integer`] | the same from counts of 16 bits, in integers alone |
//! | whether it still holds | [`watch`] | alarms of drift while the device does its work, and a summary |
//! | what is said to a host | `link`, a feature | frames and messages between a device and its host |
//!
//! A device that only applies needs [`record`] and [`corrector`], or [`integer`], alone.
//!
//! # Parameterisation
//!
//! Values are run-time data, shapes are types: the number of parameters and of particles is const, the number of
//! observations is whatever the caller's slice holds. The core does no I/O, keeps no clock and draws no randomness of
//! its own; the caller gives slices, buffers and a generator, and gets values back.
//!
//! # Frames and units
//!
//! `C_a_b` takes components from frame `a` to frame `b`.
//!
//! | letter | frame |
//! | --- | --- |
//! | `n` | local north, east, down |
//! | `p` | platform base of a rig: `n` up to levelling tilt and heading |
//! | `o`, `m`, `t` | outer gimbal, middle gimbal, table |
//! | `q` | enclosure of the sensor |
//! | `s` | sensitivity axes of one triad, not orthogonal |
//!
//! Inside all is SI: s, rad, m/s², rad/s; fields in µT. What a record's triad takes and gives is named in it.
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

pub mod nonlinearity;

pub mod observation;

pub mod model;

pub mod observer;

pub mod solver;

pub mod coverage;

pub mod accept;

pub mod record;

pub mod fit;

pub mod session;

pub mod corrector;

pub mod integer;

pub mod watch;

#[cfg(feature = "link")]
pub mod link;

/// The code in the README compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

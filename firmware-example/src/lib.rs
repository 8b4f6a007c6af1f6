//! What the images share: the record they carry, the samples they correct, and the panic gate.
//!
//! Every image of this crate, built with profile `firmware`, is a proof: there is no global allocator, and the panic
//! handler calls a function that does not exist, so that an image with a panic path left in it does not link.
//!
//! | image | does |
//! | --- | --- |
//! | `replay` | reads the record, corrects the samples, prints the bits; on a host it prints the host's |
//! | `gate` | calls everything a device may want of the core |
//! | `correct` | reads the record and corrects a sample: the least a device does |
//! | `fit` | fits all sensors, judges the fits and writes a record, prints the bits as `replay` does |
//! | `empty` | start-up code and the record's bytes, to compare the size of `correct` with |
#![no_std]

#[cfg(target_os = "none")]
pub mod console;
pub mod correct;
pub mod fit;
#[cfg(target_os = "none")]
mod gate;
pub mod replay;
pub mod scene;
pub mod search;
#[cfg(target_os = "none")]
pub mod stack;

/// A record as it would lie in flash: the golden bytes of the format's version 1.0.
pub static RECORD: &[u8] = include_bytes!("../../imucal-core/tests/golden/record-1.0.bin");

/// Exit status of an image that found its answer wrong.
pub const FAILED: i32 = 1;

//! What the images share: the record they carry, the samples they correct, and the panic gate.
//!
//! Every image of this crate but `log`, `nrf52840`, `embassy` and `rtic`, built with profile `firmware`, is a proof: there
//! is no global allocator, and the panic handler calls a function that does not exist, so that an image with a panic path
//! left in it does not link.
//!
//! | image | does |
//! | --- | --- |
//! | `replay` | reads the record, corrects the samples, prints the bits; on a host it prints the host's |
//! | `gate` | calls every public function of the core |
//! | `correct` | reads the record and corrects a sample: the least a device does |
//! | `integer` | the same in integers, for a core without a floating-point unit |
//! | `fit` | fits every model to simulated sets, judges the fits and writes records, prints the bits as `replay` does |
//! | `fits` | reads a record, corrects, fits every model and packs a record, without text: what that takes of flash |
//! | `cost` | prints what parts of the core take: instructions and stack |
//! | `coprocessor` | keeps a record, corrects, fits and stores, at the end of a UART |
//! | `standalone` | calibrates from raw samples alone and stores the record; on a board with room for a session |
//! | `restarts` | ends its run by each way there is, and says after each reset how the run before ended |
//! | `log` | says by defmt what it does, over semihosting; with `--features log` |
//! | `nrf52840` | the co-processor on a real board; with `--features nrf52840` |
//! | `embassy` | the same board by the tasks of embassy; with `--features embassy` |
//! | `rtic` | the same board by the tasks of RTIC; with `--features rtic` |
//! | `empty` | start-up code and the record's bytes, to compare the sizes of `correct` and `integer` with |
//!
//! On RISC-V there are `replay`, `gate`, `correct`, `integer`, `fit`, `fits` and `empty`: what the core is, without a board.
#![no_std]

pub mod adapter;
pub mod board;
#[cfg(target_os = "none")]
pub mod console;
pub mod coprocessor;
pub mod correct;
#[cfg(cortex_m)]
pub mod cost;
pub mod drill;
pub mod elapsed;
pub mod fit;
pub mod fitting;
#[cfg(target_os = "none")]
mod gate;
#[cfg(all(cortex_m, feature = "rtt"))]
pub mod log;
#[cfg(cortex_m)]
pub mod machine;
pub mod replay;
pub mod restart;
pub mod ring;
pub mod scene;
pub mod search;
#[cfg(microbit)]
mod soft_float;
#[cfg(cortex_m)]
pub mod stack;
pub mod standalone;
pub mod storage;
pub mod surface;

/// What the images begin by: the attribute of their entry point.
#[cfg(cortex_m)]
pub use cortex_m_rt::entry;
#[cfg(virt)]
pub use riscv_rt::entry;

/// A record as it would lie in flash: the golden bytes of the format's version 1.0.
pub static RECORD: &[u8] = include_bytes!("../../imucal-core/tests/golden/record-1.0.bin");

/// The same of [`HigherOrder`](imucal_core::record::HigherOrder): temperature to second order, and nonlinear terms.
pub static RECORD_2: &[u8] = include_bytes!("../../imucal-core/tests/golden/record-2.0.bin");

/// Exit status of an image that found its answer wrong.
pub const FAILED: i32 = 1;

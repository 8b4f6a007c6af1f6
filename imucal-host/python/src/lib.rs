//! The compiled part of the Python module `imucal`.
//!
//! ```text
//!  recording ──► calibration ──► correction
//!      ├───────► diagnosis         arrays in, arrays out
//!      └◄──────── simulation      noise: of a file
//! ```
//!
//! It holds what is large and computes what takes long; results go to Python as the text of the program's JSON, and the
//! classes around them are Python's. Everything that takes long runs while other threads of Python run: see `work`.

use pyo3::prelude::*;

mod calibration;
mod correction;
mod diagnosis;
mod failure;
mod manifest;
mod noise;
mod page;
mod recording;
mod simulation;
mod work;

/// The compiled part of `imucal`; use the package's own names.
#[pymodule]
mod _native {
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::{
        calibration::{Calibration, calibrate, load},
        correction::{apply, correct},
        diagnosis::diagnose,
        failure::{ImucalError, MismatchError, OptionError, ReadError, WriteError},
        noise::noise,
        recording::{Recording, from_arrays, read, read_stream},
        simulation::simulate,
    };

    #[pymodule_init]
    fn init(_module: &Bound<'_, PyModule>) {
        imucal_host::allocator::keep_freed_memory();
    }
}

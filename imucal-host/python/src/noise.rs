//! The noise of a unit at rest.

use std::path::PathBuf;

use imucal_host::{allan, store::noise_file::NoiseFile};
use pyo3::prelude::*;

use crate::{
    recording::{Columns, explained},
    work,
};

/// The text of `imucal noise --json`. The file is read by parts, so that it may be longer than the memory.
#[pyfunction]
pub(crate) fn noise(py: Python<'_>, path: PathBuf, columns: Columns) -> PyResult<String> {
    let (mapping, limits) = columns.parse()?;
    let at = path.clone();
    let estimated = work::run(py, move || {
        let noise = allan::noise(&path, &mapping, &limits)?;
        let messages = noise.messages();
        Ok(NoiseFile::new(&noise, messages).text())
    })?;
    estimated.map_err(|error| explained(&at, &error, &limits))
}

//! The noise of a unit at rest.

use std::path::PathBuf;

use imucal_host::{allan, store::noise_file::NoiseFile};
use pyo3::prelude::*;

use crate::{
    recording::{explained, limits, mapping},
    work,
};

/// The text of `imucal noise --json`. The file is read by parts, so that it may be longer than the memory.
#[pyfunction]
#[pyo3(signature = (path, map, unit, time, max_size, max_columns))]
pub(crate) fn noise(
    py: Python<'_>,
    path: PathBuf,
    map: Vec<String>,
    unit: Vec<String>,
    time: Option<String>,
    max_size: Option<&str>,
    max_columns: Option<usize>,
) -> PyResult<String> {
    let limits = limits(max_size, max_columns)?;
    let mapping = mapping(&map, &unit, time.as_deref())?;
    let at = path.clone();
    let estimated = work::run(py, move || {
        let noise = allan::noise(&path, &mapping, &limits)?;
        let messages = noise.messages();
        Ok(NoiseFile::new(&noise, messages).text())
    })?;
    estimated.map_err(|error| explained(&at, &error, &limits))
}

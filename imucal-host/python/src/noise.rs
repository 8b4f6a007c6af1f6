//! The noise of a unit at rest.

use std::path::PathBuf;

use imucal_host::{
    allan, page,
    store::{noise_file::NoiseFile, today},
};
use pyo3::prelude::*;

use crate::{
    failure,
    page::page as asked,
    recording::{Columns, explained},
    work,
};

/// The text of `imucal noise --json`, and the page of `--html` where it is asked for. The file is read by parts, so that it may be longer than the memory.
#[pyfunction]
pub(crate) fn noise(
    py: Python<'_>,
    path: PathBuf,
    columns: Columns,
    html: bool,
) -> PyResult<(String, Option<String>)> {
    let (mapping, limits) = columns.parse()?;
    let at = path.clone();
    let estimated = work::run(py, move || {
        let noise = allan::noise(&path, &mapping, &limits)?;
        let messages = noise.messages();
        let file = NoiseFile::new(&noise, messages);
        let html = asked(html, &path, || page::of_noise(&file, &path, today()));
        Ok((file.text(), html))
    })?;
    let (text, html) = estimated.map_err(|error| explained(&at, &error, &limits))?;
    Ok((text, html.map_err(failure::unread)?))
}

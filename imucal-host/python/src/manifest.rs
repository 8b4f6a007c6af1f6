//! A manifest from Python: JSON of the same keys as the TOML.

use std::path::Path;

use imucal_host::recording::{Manifest, Warning, manifest::FORMAT};
use pyo3::PyResult;

use crate::failure;

/// The manifest of a recording's name, checked as that of a file; with it come warnings.
pub(crate) fn parse(json: &str, name: &str) -> PyResult<(Manifest, Vec<Warning>)> {
    let mut table: toml::Table = serde_json::from_str(json).map_err(failure::option)?;
    table.entry("format").or_insert_with(|| FORMAT.into());
    let text = toml::to_string(&table).map_err(failure::option)?;
    let path = Manifest::path_for(Path::new(name)).unwrap_or_else(|| Path::new(name).with_extension("toml"));
    Manifest::parse(&text, &path).map_err(failure::unread)
}

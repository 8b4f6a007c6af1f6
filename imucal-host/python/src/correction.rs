//! Samples corrected by the core in `f32`, as a device corrects them.

use std::{path::Path, sync::Arc};

use imucal_core::nonlinearity::TooSteep;
use imucal_host::{
    apply::{Correction, check, corrector},
    recording::Recording as Recorded,
};
use nalgebra::Vector3;
use numpy::{PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::{
    calibration::Calibration,
    failure,
    recording::{Recording, sensor, shaped},
    work,
};

/// What messages call a calibration that is in memory.
const NAME: &str = "the calibration";

/// A recording with its calibrated sensors corrected, and warnings: that nobody can know whether both belong together, and what is not
/// as the calibration's terms of temperature want it.
#[pyfunction]
pub(crate) fn apply(
    py: Python<'_>,
    recording: &Recording,
    calibration: &Calibration,
    other_serial: bool,
) -> PyResult<(Recording, Vec<String>)> {
    let stored = calibration.stored();
    let record = stored.to_record(Path::new(NAME)).map_err(failure::mismatch)?;
    let recording = Arc::clone(&recording.0);
    let warning = check(&recording, &stored, &record, other_serial).map_err(failure::mismatch)?;
    let corrected = work::run(py, move || {
        let mut correction = Correction::new(&stored, &record)?;
        let corrected = correction.correct(Recorded::clone(&recording));
        Ok::<_, TooSteep>((corrected, correction.remarks()))
    })?;
    let (corrected, remarks) = corrected.map_err(failure::mismatch)?;
    Ok((Recording::new(corrected), warning.into_iter().chain(remarks).collect()))
}

/// Raw samples of one sensor, corrected; `raw` is read where it is, and the result is not copied.
#[pyfunction]
pub(crate) fn correct<'py>(
    py: Python<'py>,
    calibration: &Calibration,
    kind: &str,
    raw: PyReadonlyArray2<'py, f32>,
    temperature: Option<PyReadonlyArray1<'py, f32>>,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let found = sensor(kind);
    let kind = found
        .ok_or_else(|| failure::option(format!("found the sensor `{kind}`, expected acc, gyr or mag")))?;
    let stored = calibration.stored();
    let record = stored.to_record(Path::new(NAME)).map_err(failure::mismatch)?;
    let core = corrector(&record, kind).map_err(failure::mismatch)?;
    let mut core = core.ok_or_else(|| {
        failure::mismatch(format!(
            "{kind}: found samples, expected none, since the calibration has no such sensor"
        ))
    })?;
    let shape = raw.as_array().dim();
    let (samples, rest) = raw.as_slice().map_err(failure::option)?.as_chunks::<3>();
    if shape.1 != 3 || !rest.is_empty() {
        let (rows, columns) = shape;
        return Err(failure::unread(format!(
            "{kind}: found an array of {rows} × {columns}, expected 3 columns, one row a sample; transpose it"
        )));
    }
    let warmth = temperature.as_ref().map(PyReadonlyArray1::as_slice).transpose().map_err(failure::option)?;
    if let Some(found) = warmth.map(<[f32]>::len).filter(|found| *found != samples.len()) {
        let expected = samples.len();
        return Err(failure::unread(format!(
            "temperature: found {found} rows, expected {expected} as {kind} has; give one a sample"
        )));
    }
    let corrected: Vec<f32> = py.detach(|| {
        let at = |row: usize| warmth.and_then(|warmth| warmth.get(row)).copied().unwrap_or(f32::NAN);
        let rows = samples.iter().enumerate();
        rows.flat_map(|(row, raw)| <[f32; 3]>::from(core.apply_at(&Vector3::from(*raw), at(row)))).collect()
    });
    shaped(py, corrected, shape.0)
}

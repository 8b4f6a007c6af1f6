//! Calibrations: made of a recording, loaded, and written.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use imucal_host::{
    calibrate::{
        Calibration as Made, calibrate as fit,
        request::{ModelOf, Request},
    },
    file::OutputSet,
    page,
    recording::SensorKind,
    report,
    store::{SaveError, StoredCalibration, today},
};
use pyo3::prelude::*;

use crate::{failure, page::page as asked, recording::Recording, work};

/// A calibration in the memory of the library.
#[pyclass(frozen, module = "imucal._native")]
pub(crate) struct Calibration {
    origin: Origin,
    /// The page of `imucal calibrate --html`, where it was asked for.
    #[pyo3(get)]
    html: Option<String>,
}

/// Where a calibration comes from.
enum Origin {
    /// From a recording, as it was asked for.
    Made(Arc<Made>, Request),
    /// From a file.
    Loaded(Box<StoredCalibration>),
}

impl Calibration {
    /// What is stored of it: the sensors that have passed.
    pub(crate) fn stored(&self) -> StoredCalibration {
        match &self.origin {
            Origin::Loaded(stored) => StoredCalibration::clone(stored),
            Origin::Made(made, request) if request.accept_suspect => {
                StoredCalibration::with_suspects(made, today())
            }
            Origin::Made(made, _) => StoredCalibration::of(made, today()),
        }
    }

    fn write(
        &self,
        path: &Path,
        add: impl Fn(&StoredCalibration, &mut OutputSet) -> Result<(), SaveError>,
    ) -> PyResult<()> {
        let stored = self.stored();
        if SensorKind::ALL.into_iter().all(|kind| stored.triad(kind).is_none()) {
            return Err(failure::unwritten(format!(
                "{}: not written, since no sensor was accepted",
                path.display()
            )));
        }
        let mut files = OutputSet::default();
        add(&stored, &mut files).map_err(failure::unwritten)?;
        files.commit().map_err(failure::unwritten)
    }
}

#[pymethods]
impl Calibration {
    /// The text of `imucal calibrate --json`; of a calibration that was loaded, what its file holds.
    fn json(&self) -> PyResult<String> {
        match &self.origin {
            Origin::Made(made, _) => Ok(report::json::text(made)),
            Origin::Loaded(stored) => {
                let text = serde_json::to_string_pretty(stored).map_err(failure::unread)?;
                Ok(text + "\n")
            }
        }
    }

    /// Whether the program would end with the status 0; a calibration that was loaded is one that was accepted.
    #[getter]
    fn ok(&self) -> bool {
        match &self.origin {
            Origin::Made(made, request) => request.is_met(made),
            Origin::Loaded(_) => true,
        }
    }

    /// Writes the calibration for people.
    fn write_toml(&self, path: PathBuf) -> PyResult<()> {
        self.write(&path, |stored, files| stored.write_toml(&path, files))
    }

    /// Writes the record for the device.
    fn write_record(&self, path: PathBuf) -> PyResult<()> {
        self.write(&path, |stored, files| stored.write_record(&path, files))
    }
}

/// Calibrates what a recording allows.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // One an option of the program.
#[pyo3(signature = (recording, models, compare, temperature, threshold, accept_suspect, html))]
pub(crate) fn calibrate(
    py: Python<'_>,
    recording: &Recording,
    models: Vec<String>,
    compare: bool,
    temperature: bool,
    threshold: Option<f64>,
    accept_suspect: bool,
    html: bool,
) -> PyResult<Calibration> {
    let models: Vec<ModelOf> =
        models.iter().map(|text| text.parse()).collect::<Result<_, _>>().map_err(failure::option)?;
    let mut request = Request::default().with_models(&models).map_err(failure::option)?;
    if let Some(found) = threshold.filter(|multiple| !(multiple.is_finite() && *multiple > 0.0)) {
        return Err(failure::option(format!("threshold: found {found}, expected a number above 0")));
    }
    (request.compare, request.no_temperature) = (compare, !temperature);
    (request.threshold, request.accept_suspect) = (threshold, accept_suspect);
    recording.check_page(html)?;
    let recording = Arc::clone(&recording.0);
    request.check(&recording).map_err(failure::option)?;
    let options = request.options();
    let (made, html) = work::run(py, move || {
        let made = fit(&recording, &options, &|_| {});
        let parts = || [page::calibration::calibration(&made, &recording)];
        let html = asked(html, &recording.path, || page::of_recording(&recording, today(), &parts()));
        (made, html)
    })?;
    let html = html.map_err(failure::unread)?;
    Ok(Calibration { origin: Origin::Made(Arc::new(made), request), html })
}

/// Loads a calibration from TOML or from a record.
#[pyfunction]
pub(crate) fn load(path: PathBuf) -> PyResult<Calibration> {
    let stored = StoredCalibration::load(&path).map_err(failure::unread)?;
    Ok(Calibration { origin: Origin::Loaded(Box::new(stored)), html: None })
}

//! Recordings: read, made of arrays, and given as arrays.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use imucal_host::{
    file::{Limits, limits::Size},
    recording::{self, Manifest, Mapping, ReadError, Samples, SensorKind, layout_guess},
    report::layout,
};
use nalgebra::Vector3;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::{failure, manifest, work};

/// A recording in the memory of the library, and whether it is what its file holds.
#[pyclass(frozen, module = "imucal._native")]
pub(crate) struct Recording(pub(crate) Arc<recording::Recording>, bool);

impl Recording {
    /// One that was made in memory; a file of its name is another one.
    pub(crate) fn new(recording: recording::Recording) -> Self {
        Self(Arc::new(recording), false)
    }

    fn of_file(recording: recording::Recording) -> Self {
        Self(Arc::new(recording), true)
    }

    /// Refuses a page, where it is asked for, of a recording that has no file whose hash the page could state.
    pub(crate) fn check_page(&self, asked: bool) -> PyResult<()> {
        if !asked || self.1 {
            return Ok(());
        }
        Err(failure::option(format!(
            "html: found `{}`, which was made in memory, expected a recording of a file, whose hash the page states; write \
             it, and read it again",
            self.0.name
        )))
    }
}

#[pymethods]
impl Recording {
    /// Name of the samples file.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// Number of rows.
    #[getter]
    fn rows(&self) -> usize {
        self.0.rows()
    }

    /// Time of the first row on an absolute clock, ns; None where the times are not absolute.
    #[getter]
    fn epoch_ns(&self) -> Option<i128> {
        self.0.epoch.map(|epoch| epoch.picoseconds().div_euclid(1000))
    }

    /// What the reader noticed.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.warnings.iter().map(ToString::to_string).collect()
    }

    /// The manifest as JSON.
    fn manifest(&self) -> PyResult<String> {
        serde_json::to_string(&self.0.manifest).map_err(failure::unread)
    }

    /// Times, s: a new array.
    fn times<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.0.time)
    }

    /// Temperatures, °C: a new array.
    fn temperatures<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        Some(PyArray1::from_slice(py, self.0.temperature.as_ref()?))
    }

    /// The rows of `acc`, `gyr`, `mag`, `gimbal`, `reference` or `position`: a new array; None where there are none.
    fn columns<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let rows = match name {
            "acc" | "gyr" | "mag" => sensor(name)
                .and_then(|kind| self.0.sensor(kind))
                .map(|triple| flat(&triple.values, |value| (*value).into())),
            "gimbal" => self.0.gimbal.as_ref().map(|rows| rows.as_flattened().to_vec()),
            "reference" => self.0.reference.as_ref().map(|rows| rows.as_flattened().to_vec()),
            "position" => self.0.position.as_ref().map(|rows| rows.as_flattened().to_vec()),
            _ => return Err(failure::option(format!("found `{name}`, expected columns of a recording"))),
        };
        rows.map(|rows| shaped(py, rows, self.0.rows())).transpose()
    }

    /// Writes samples and manifest, over a former recording of this name; what the file's format does not hold.
    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<Option<String>> {
        let manifest_path = Manifest::path_for(&path).filter(|manifest_path| manifest_path.exists());
        if let Some(manifest_path) =
            manifest_path.filter(|manifest_path| !Manifest::is_manifest(manifest_path))
        {
            return Err(failure::unwritten(format!(
                "{}: found a file that is no manifest, expected one or none, since it would be lost; choose another name; \
                 nothing was written",
                manifest_path.display()
            )));
        }
        let recording = Arc::clone(&self.0);
        let written = py.detach(move || recording.write(&path)).map_err(failure::unwritten)?;
        Ok(written.left_out.map(|warning| warning.to_string()))
    }
}

/// The numbers of rows, one after another.
fn flat<T, const N: usize>(rows: &[T], row: impl Fn(&T) -> [f64; N]) -> Vec<f64> {
    rows.iter().flat_map(row).collect()
}

/// An array of so many rows that takes the numbers over.
pub(crate) fn shaped<T: numpy::Element>(
    py: Python<'_>,
    numbers: Vec<T>,
    rows: usize,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let width = numbers.len() / rows.max(1);
    numbers.into_pyarray(py).reshape([rows, width])
}

/// A sensor by its name.
pub(crate) fn sensor(name: &str) -> Option<SensorKind> {
    SensorKind::ALL.into_iter().find(|kind| kind.prefix() == name)
}

/// Columns by the names of a recording and topics of a log, as the program's options.
#[derive(FromPyObject)]
pub(crate) struct Columns {
    #[pyo3(item)]
    map: Vec<String>,
    #[pyo3(item)]
    unit: Vec<String>,
    #[pyo3(item)]
    time: Option<String>,
    #[pyo3(item)]
    topic: Vec<String>,
    #[pyo3(item)]
    max_size: Option<String>,
    #[pyo3(item)]
    max_columns: Option<usize>,
}

impl Columns {
    /// What they mean.
    pub(crate) fn parse(&self) -> PyResult<(Mapping, Limits)> {
        let mut limits = Limits::default();
        if let Some(size) = &self.max_size {
            let size = size.parse::<Size>();
            limits.size = size.map_err(|wrong| failure::option(format!("max_size: {wrong}")))?.0;
        }
        limits.columns = self.max_columns.unwrap_or(limits.columns);
        let mapping = Mapping::parse(&self.map, &self.unit, self.time.as_deref())
            .and_then(|mapping| mapping.with_topics(&self.topic));
        Ok((mapping.map_err(failure::option)?, limits))
    }
}

/// An error of reading, with what the file's columns probably are where these are not known, or a topic that would do.
pub(crate) fn explained(path: &Path, error: &ReadError, limits: &Limits) -> PyErr {
    if let ReadError::Topics { fault, .. } = error
        && let Some(options) = fault.remedy()
    {
        return failure::unread(format!("{error}\n\nFor example:\n  {}", in_python(&options)));
    }
    let unknown = matches!(
        error,
        ReadError::Header { .. } | ReadError::ManifestMissing { .. } | ReadError::Mapping { .. }
    );
    let Some(guess) = layout_guess::guess(path, limits).filter(|_| unknown) else {
        return failure::unread(error);
    };
    let with = if guess.unknown_units.is_empty() {
        ""
    } else {
        ", with a unit such as g or deg/s in place of UNIT, or for counts how many make one, such as 16384/g"
    };
    let arguments = in_python(&layout::with_unknown_units(&guess));
    let columns = layout::columns(&guess);
    failure::unread(format!("{error}\n\n{columns}Then these arguments read it{with}:\n  {arguments}"))
}

/// Options of the program as arguments of `read`.
fn in_python(options: &[String]) -> String {
    let values = |option: &str| -> Vec<String> {
        let pairs = options.windows(2).filter(|pair| pair[0] == option);
        pairs.map(|pair| format!("{:?}", pair[1])).collect()
    };
    let one = |name: &str| values(&format!("--{name}")).first().map(|value| format!("{name}={value}"));
    let list = |name: &str| {
        let values = values(&format!("--{name}"));
        (!values.is_empty()).then(|| format!("{name}=[{}]", values.join(", ")))
    };
    let arguments = [one("time"), list("map"), one("unit"), list("topic")];
    arguments.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// Reads a recording, another program's file as one, or a log.
#[pyfunction]
pub(crate) fn read(py: Python<'_>, path: PathBuf, columns: Columns) -> PyResult<Recording> {
    let (mapping, limits) = columns.parse()?;
    read_as(py, path, mapping, limits)
}

/// Reads a simulator's file, and the topic that is still to be chosen of it.
#[pyfunction]
pub(crate) fn read_stream(
    py: Python<'_>,
    path: PathBuf,
    topic: Option<String>,
) -> PyResult<(Recording, Option<String>)> {
    let (mapping, topic) = Mapping::of_stream(&path, topic.as_deref()).map_err(failure::option)?;
    let topic = topic.map(str::to_owned);
    Ok((read_as(py, path, mapping, Limits::default())?, topic))
}

fn read_as(py: Python<'_>, path: PathBuf, mapping: Mapping, limits: Limits) -> PyResult<Recording> {
    let at = path.clone();
    let read = work::run(py, move || recording::Recording::read_as(&path, &mapping, &limits))?;
    read.map(Recording::of_file).map_err(|error| explained(&at, &error, &limits))
}

/// A recording of arrays in the units of a manifest; each is copied once.
#[pyfunction]
#[pyo3(signature = (name, manifest, t, acc, gyr, mag, temperature, gimbal, reference, position))]
#[allow(clippy::too_many_arguments)] // One an array.
pub(crate) fn from_arrays(
    py: Python<'_>,
    name: String,
    manifest: &str,
    t: PyReadonlyArray1<'_, f64>,
    acc: Option<PyReadonlyArray2<'_, f64>>,
    gyr: Option<PyReadonlyArray2<'_, f64>>,
    mag: Option<PyReadonlyArray2<'_, f64>>,
    temperature: Option<PyReadonlyArray1<'_, f64>>,
    gimbal: Option<PyReadonlyArray2<'_, f64>>,
    reference: Option<PyReadonlyArray2<'_, f64>>,
    position: Option<PyReadonlyArray2<'_, f64>>,
) -> PyResult<Recording> {
    let manifest = manifest::parse(manifest, &name)?;
    let vectors = |what, array: Option<PyReadonlyArray2<'_, f64>>| -> PyResult<Option<Vec<Vector3<f64>>>> {
        rows::<3, _>(what, array, Vector3::from)
    };
    let samples = Samples {
        time: t.as_array().iter().copied().collect(),
        acc: vectors("acc", acc)?,
        gyr: vectors("gyr", gyr)?,
        mag: vectors("mag", mag)?,
        temperature: temperature.map(|array| array.as_array().iter().copied().collect()),
        gimbal: rows::<3, _>("gimbal", gimbal, |row| row)?,
        reference: rows::<4, _>("reference", reference, |row| row)?,
        position: rows::<3, _>("position", position, |row| row)?,
    };
    let made = work::run(py, move || recording::Recording::of_samples(&name, manifest, samples))?;
    made.map(Recording::new).map_err(failure::unread)
}

/// The rows of an array of N columns.
fn rows<const N: usize, T>(
    what: &str,
    array: Option<PyReadonlyArray2<'_, f64>>,
    row: impl Fn([f64; N]) -> T,
) -> PyResult<Option<Vec<T>>> {
    let Some(array) = array else { return Ok(None) };
    let array = array.as_array();
    if array.ncols() != N {
        let (n, columns) = array.dim();
        return Err(failure::unread(format!(
            "{what}: found an array of {n} × {columns}, expected {N} columns, one row a sample; transpose it, or leave \
             columns out"
        )));
    }
    Ok(Some(array.rows().into_iter().map(|values| row(std::array::from_fn(|k| values[k]))).collect()))
}

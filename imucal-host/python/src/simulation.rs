//! Simulated recordings.

use std::path::PathBuf;

use imucal_host::{
    effect::{UnknownName, user},
    file::Limits,
    simulator::{Programme, Simulation, UnitKind},
};
use pyo3::prelude::*;

use crate::{failure, recording::Recording, work};

/// Simulates a recording, as `imucal simulate`.
#[pyfunction]
#[pyo3(signature = (name, unit, programme, effects, own_effects, seed, rate, duration, si, noise))]
#[allow(clippy::too_many_arguments)] // One an option of the program.
pub(crate) fn simulate(
    py: Python<'_>,
    name: String,
    unit: &str,
    programme: &str,
    effects: Vec<(String, f64)>,
    own_effects: Option<PathBuf>,
    seed: u64,
    rate: f64,
    duration: Option<f64>,
    si: bool,
    noise: bool,
) -> PyResult<Recording> {
    let own = own_effects.as_deref().map(|path| user::read(path, &Limits::default())).transpose();
    let own = own.map_err(failure::unread)?.unwrap_or_default();
    let unknown_unit = || failure::option(UnknownName::of("unit", unit, UnitKind::ALL.map(UnitKind::name)));
    let unknown_programme =
        || failure::option(UnknownName::of("programme", programme, Programme::ALL.map(Programme::name)));
    let mut simulation = Simulation {
        unit: UnitKind::find(unit).ok_or_else(unknown_unit)?,
        programme: Programme::find(programme).ok_or_else(unknown_programme)?,
        rate,
        duration,
        seed,
        noise,
        counts: !si,
        ..Simulation::default()
    };
    for (id, size) in effects {
        let effect = user::named("effect", &id, &own).map_err(failure::option)?;
        if !size.is_finite() {
            return Err(failure::option(format!(
                "the size {size} of {id} is no number; expected for instance 2"
            )));
        }
        simulation.add(effect, size).map_err(failure::option)?;
    }
    let recorded = work::run(py, move || simulation.record(&name))?;
    recorded.map(Recording::new).map_err(failure::option)
}

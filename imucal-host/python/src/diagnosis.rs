//! Diagnoses: where a recording and a simulator disagree, and why.

use std::{path::PathBuf, sync::Arc};

use imucal_host::{
    diagnosis::{self, Options, proposal::confirmation},
    effect::user,
    file::Limits,
    page,
    recording::Stream,
    store::{today, watch_file},
};
use pyo3::prelude::*;

use crate::{calibration::Calibration, failure, page::page as asked, recording::Recording, work};

/// The text of `imucal diagnose --json`, that of the effects that are proposed, and the page of `--html` where it is asked for.
#[pyfunction]
#[pyo3(signature = (recording, sim, sim_topic, model, without, effects, frozen, watch, html))]
#[allow(clippy::too_many_arguments)] // One an option of the program.
pub(crate) fn diagnose(
    py: Python<'_>,
    recording: &Recording,
    sim: Option<&Recording>,
    sim_topic: Option<&str>,
    model: Option<&Calibration>,
    without: Vec<String>,
    effects: Option<PathBuf>,
    frozen: bool,
    watch: Option<PathBuf>,
    html: bool,
) -> PyResult<(String, String, Option<String>)> {
    recording.check_page(html)?;
    let limits = Limits::default();
    let own =
        effects.as_deref().map(|path| user::read(path, &limits)).transpose().map_err(failure::unread)?;
    let own = own.unwrap_or_default();
    let without =
        user::known(&without, &own).map_err(|unknown| failure::option(format!("without: {unknown}")))?;
    let frozen = effects.as_deref().filter(|_| frozen).map(|path| confirmation::frozen(path, &own, &limits));
    let frozen = frozen.transpose().map_err(failure::unread)?;
    let stream = sim.map(|sim| {
        Stream::chosen(&sim.0, &recording.0, sim_topic)
            .map_err(|error| failure::unread(format!("{}: {error}", sim.0.name)))
    });
    let stream = stream.transpose()?;
    let watch = watch.as_deref().map(|path| watch_file::read_of(path, &recording.0, &limits));
    let watch = watch.transpose().map_err(failure::unread)?;
    let model = model.map(Calibration::stored);
    let options = Options { without, model, stream, effects: own, frozen, watch, settings: None };
    let recording = Arc::clone(&recording.0);
    let (text, proposed, html) = work::run(py, move || {
        let found = diagnosis::diagnose(&recording, &options, &|_| {});
        let proposed: String = found.proposals.iter().map(|proposal| proposal.toml.as_str()).collect();
        let parts = || [page::diagnosis::diagnosis(&found)];
        let html = asked(html, &recording.path, || page::of_recording(&recording, today(), &parts()));
        (found.text(), proposed, html)
    })?;
    Ok((text, proposed, html.map_err(failure::unread)?))
}

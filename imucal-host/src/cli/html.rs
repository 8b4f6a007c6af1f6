//! The page of a result, for a browser or for paper.

use std::{
    io,
    path::{Path, PathBuf},
};

use anyhow::Context;
use clap::Args;

use super::{calibrate::today, overwrite::Planned};
use crate::{
    file::OutputSet,
    page::{self, Part, Provenance},
    recording::Recording,
};

/// Where a command writes its page.
#[derive(Args, Clone, Debug, Default)]
pub(super) struct Html {
    /// Write a page with drawings for a browser, which prints as a certificate on A4
    #[arg(long, value_name = "PAGE.html")]
    html: Option<PathBuf>,
}

impl Html {
    /// Where the page goes, if one is asked for.
    pub(super) fn path(&self) -> Option<&Path> {
        self.html.as_deref()
    }

    /// The page as a file that is going to be written.
    pub(super) fn planned(&self) -> Option<Planned> {
        self.html.clone().map(Planned::new)
    }

    /// Adds the page of a recording's result; nothing is made where none is asked for.
    pub(super) fn add(
        &self,
        files: &mut OutputSet,
        recording: &Recording,
        parts: &dyn Fn() -> Vec<Part>,
    ) -> anyhow::Result<()> {
        self.add_page(files, &recording.path, &|| page::of_recording(recording, today(), &parts()))
    }

    /// Adds a page that is made of a recording's file.
    pub(super) fn add_page(
        &self,
        files: &mut OutputSet,
        recording: &Path,
        page: &dyn Fn() -> io::Result<String>,
    ) -> anyhow::Result<()> {
        let Some(path) = &self.html else { return Ok(()) };
        let text = page().with_context(|| again(recording))?;
        Ok(files.add(path, text.as_bytes())?)
    }

    /// Adds a page with the hashes of the files it comes from, and further facts.
    pub(super) fn add_of(
        &self,
        files: &mut OutputSet,
        title: &str,
        inputs: &[(&str, &Path)],
        further: &dyn Fn(Provenance) -> anyhow::Result<Provenance>,
        parts: &dyn Fn() -> Vec<Part>,
    ) -> anyhow::Result<()> {
        let Some(path) = &self.html else { return Ok(()) };
        let mut provenance = Provenance::new(today());
        for (what, input) in inputs {
            provenance = provenance.with_file(what, input).with_context(|| again(input))?;
        }
        let text = page::page(title, &further(provenance)?, &parts());
        Ok(files.add(path, text.as_bytes())?)
    }
}

fn again(path: &Path) -> String {
    format!("{}: cannot be read again", path.display())
}

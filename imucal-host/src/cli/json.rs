//! A result as JSON, in a file or on the screen.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use serde::Serialize;

use super::{output, overwrite::Planned};
use crate::file::OutputSet;

/// Where a command writes its JSON.
#[derive(Args, Clone, Debug, Default)]
pub(super) struct Json {
    /// Write everything as JSON; `-` prints it instead of the text
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

impl Json {
    /// Whether it takes the place of the text.
    pub(super) fn on_screen(&self) -> bool {
        self.json.as_ref().is_some_and(|path| path.as_os_str() == "-")
    }

    /// Its file, where there is one.
    pub(super) fn path(&self) -> Option<&Path> {
        self.json.as_deref().filter(|_| !self.on_screen())
    }

    /// The file that is going to be written.
    pub(super) fn planned(&self) -> Option<Planned> {
        self.path().map(Planned::new)
    }

    /// Prints what is asked for, the JSON or the text, and adds the file.
    pub(super) fn give(
        &self,
        files: &mut OutputSet,
        result: &impl Serialize,
        text: &dyn Fn() -> String,
    ) -> anyhow::Result<()> {
        let json = || serde_json::to_string_pretty(result).context("the result cannot be spelt as JSON");
        if self.on_screen() {
            return output::document(&(json()? + "\n"));
        }
        output::text(&text())?;
        if let Some(path) = self.path() {
            files.add(path, (json()? + "\n").as_bytes())?;
        }
        Ok(())
    }
}

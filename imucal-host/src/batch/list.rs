//! A list of recordings, as TOML or CSV with the same keys, each with options of its own.
//!
//! ```text
//! format = "imucal-batch/1"          path,name,model
//!                                    a/run.csv,board 7,acc=T6
//! [[recording]]                      b/run.csv,board 8,
//! path = "a/run.csv"
//! name = "board 7"
//! model = "acc=T6"
//! ```

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::{Method, source::SourceFault};
use crate::{
    calibrate::request::ModelOf,
    file::Limits,
    recording::{Manifest, Mapping},
};

/// What the TOML begins with.
const FORMAT: &str = "imucal-batch/1";

/// One recording of a list. Paths are relative to the list's folder.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Row {
    pub(super) path: PathBuf,
    /// The unit's name, which its outputs are called by.
    pub(super) name: Option<String>,
    /// As `--model`, in place of the command's.
    model: Option<String>,
    /// As `--map`, several separated by semicolons. This, `unit`, `time` and `topic` together take the place of the command's.
    map: Option<String>,
    /// As `--unit`.
    unit: Option<String>,
    /// As `--time`.
    time: Option<String>,
    /// As `--topic`, several separated by semicolons.
    topic: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct List {
    format: String,
    #[serde(default)]
    recording: Vec<Row>,
}

/// A CSV file is a list where its header has the column `path`, which no recording needs.
pub(super) fn is_list(path: &Path, limits: &Limits) -> bool {
    let first = first_line(path, limits).unwrap_or_default();
    first.split(',').any(|name| name.trim() == "path")
}

fn first_line(path: &Path, limits: &Limits) -> Option<String> {
    use std::io::{BufRead, BufReader, Read};
    let file = std::fs::File::open(path).ok()?;
    let mut line = Vec::new();
    BufReader::new(file.take(limits.line() as u64)).read_until(b'\n', &mut line).ok()?;
    String::from_utf8(line).ok()
}

/// Reads a list.
pub(super) fn read(path: &Path, limits: &Limits) -> Result<Vec<Row>, SourceFault> {
    let wrong = |found: String| SourceFault::List { path: path.to_path_buf(), found };
    let bytes = limits.read_small(path).map_err(|fault| wrong(fault.to_string()))?;
    let is_toml = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml"));
    if !is_toml {
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(&bytes[..]);
        return reader.deserialize().map(|row| row.map_err(|fault| wrong(fault.to_string()))).collect();
    }
    if Manifest::is_manifest(path) {
        return Err(wrong("the manifest of a recording".to_owned()));
    }
    let text = std::str::from_utf8(&bytes).map_err(|fault| wrong(fault.to_string()))?;
    let list: List = toml::from_str(text).map_err(|fault| wrong(fault.to_string().trim().to_owned()))?;
    if list.format != FORMAT {
        Err(wrong(format!("the format `{}`", list.format)))
    } else {
        Ok(list.recording)
    }
}

impl Row {
    /// The command's method, with what this recording has of its own.
    pub(super) fn method(&self, list: &Path, method: &Method) -> Result<Method, SourceFault> {
        let wrong = |fault: String| SourceFault::List {
            path: list.to_path_buf(),
            found: format!("{}: {fault}", self.path.display()),
        };
        let mut method = method.clone();
        if let Some(text) = &self.model {
            let models: Result<Vec<ModelOf>, _> = text.split(',').map(|one| one.trim().parse()).collect();
            let asked = models.and_then(|models| method.request.clone().with_models(&models));
            method.request = asked.map_err(|fault| wrong(fault.to_string()))?;
        }
        if [&self.map, &self.unit, &self.time, &self.topic].into_iter().any(Option::is_some) {
            let split = |text: &Option<String>, at: char| -> Vec<String> {
                text.iter().flat_map(|text| text.split(at)).map(|part| part.trim().to_owned()).collect()
            };
            let mapping =
                Mapping::parse(&split(&self.map, ';'), &split(&self.unit, ','), self.time.as_deref());
            let mapping = mapping.and_then(|columns| columns.with_topics(&split(&self.topic, ';')));
            method.mapping = mapping.map_err(|fault| wrong(fault.to_string()))?;
        }
        Ok(method)
    }
}

//! Which recordings there are, in which order, and what their outputs are called.
//!
//! The order is that of names. A recording's name is its path without the ending, seen from the deepest folder that all sources have
//! in common; a list may give another. Two recordings of one name keep their endings in it.

use std::{
    collections::BTreeMap,
    fs, io,
    path::{Component, Path, PathBuf, absolute},
};

use super::{Method, list};
use crate::recording::{Format, Manifest, is_bag_folder};

/// A recording to be calibrated.
#[derive(Clone, Debug)]
pub struct Source {
    /// What its outputs are called; may name folders, separated by `/`.
    pub name: String,
    /// Its samples, as they are opened.
    pub path: PathBuf,
    /// The same from the folder that all have in common, separated by `/`: alike on all machines.
    pub from_root: String,
    /// How it is read and calibrated.
    pub method: Method,
}

/// Why it is not known which recordings there are.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)] // The fields are those of each message.
pub enum SourceFault {
    /// The system refuses.
    #[error("{path}: cannot be read: {cause}; check the path and its permissions")]
    System { path: PathBuf, cause: io::Error },
    /// Neither a folder, nor a file that is known, nor a pattern.
    #[error(
        "{path}: found no such file or folder, expected a folder, a pattern such as `data/*.csv`, a list or recordings; check the path"
    )]
    Missing { path: PathBuf },
    /// A file of another kind.
    #[error(
        "{path}: found a file that is neither a recording nor a list, expected NAME.csv, NAME.csv.gz, NAME.parquet, NAME.mat, a log, or a list as TOML or CSV"
    )]
    Foreign { path: PathBuf },
    /// A pattern that cannot be understood.
    #[error(
        "{pattern}: found a pattern that cannot be understood ({cause}), expected such as `data/**/*.csv`; write it in quotes"
    )]
    Pattern { pattern: String, cause: String },
    /// A source without a recording.
    #[error(
        "{path}: found no recording, expected NAME.csv, NAME.csv.gz, NAME.parquet, NAME.mat or a log; check the path"
    )]
    Nothing { path: PathBuf },
    /// A list that cannot be understood.
    #[error(
        "{path}: found {found}, expected a list of recordings: TOML with format = \"imucal-batch/1\" and [[recording]], or CSV, \
         with the keys path, name, model, map, unit, time, topic; correct it"
    )]
    List { path: PathBuf, found: String },
    /// A name that is no name of a file.
    #[error(
        "{path}: found the name `{name}`, expected one of a file without a folder, which does not begin with a dot; change it in the list"
    )]
    Name { path: PathBuf, name: String },
    /// Two recordings whose outputs would have one name.
    #[error("found the name `{name}` for {a} and for {b}, expected two; give each a name in a list")]
    Twice { name: String, a: PathBuf, b: PathBuf },
}

/// A recording that was found, before it has a name.
struct Found {
    path: PathBuf,
    /// Where it is: its folder without links.
    place: PathBuf,
    name: Option<String>,
    method: Method,
}

/// Finds the recordings of folders (and the folders in them), patterns, lists and single files. What is hidden or lies in `excluded`
/// is not looked for.
///
/// # Errors
///
/// [`SourceFault`].
pub fn find(from: &[PathBuf], excluded: &[PathBuf], method: &Method) -> Result<Vec<Source>, SourceFault> {
    let mut search =
        Search { excluded: excluded.iter().map(|path| place(path)).collect(), roots: Vec::new() };
    let mut found = Vec::new();
    for path in from {
        let before = found.len();
        search.source(path, method, &mut found)?;
        if found.len() == before {
            return Err(SourceFault::Nothing { path: path.clone() });
        }
    }
    found.sort_by(|a, b| (&a.place, &a.name).cmp(&(&b.place, &b.name)));
    // Twice by two methods is a fault that the names show.
    let is_same = |a: &Found, b: &Found| {
        a.place == b.place && a.name == b.name && a.method.options() == b.method.options()
    };
    found.dedup_by(|a, b| is_same(a, b));
    named(found, &common(&search.roots))
}

struct Search {
    excluded: Vec<PathBuf>,
    roots: Vec<PathBuf>,
}

impl Search {
    fn source(&mut self, path: &Path, method: &Method, found: &mut Vec<Found>) -> Result<(), SourceFault> {
        let text = path.to_string_lossy();
        if is_bag_folder(path) {
            self.single(Found::new(path.to_path_buf(), None, method.clone()), found)
        } else if path.is_dir() {
            self.roots.push(place(path));
            self.folder(path, method, found)
        } else if path.is_file() {
            self.file(path, method, found)
        } else if text.contains(['*', '?', '[']) {
            self.pattern(&text, method, found)
        } else {
            Err(SourceFault::Missing { path: path.to_path_buf() })
        }
    }

    fn folder(&self, folder: &Path, method: &Method, found: &mut Vec<Found>) -> Result<(), SourceFault> {
        let failed = |cause| SourceFault::System { path: folder.to_path_buf(), cause };
        for entry in fs::read_dir(folder).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            let path = entry.path();
            if entry.file_name().as_encoded_bytes().starts_with(b".") || self.is_excluded(&path) {
                continue;
            }
            // Links to folders are not followed: they may lead back.
            if is_recording(&path) {
                found.push(Found::new(path, None, method.clone()));
            } else if entry.file_type().map_err(failed)?.is_dir() {
                self.folder(&path, method, found)?;
            }
        }
        Ok(())
    }

    fn file(&mut self, path: &Path, method: &Method, found: &mut Vec<Found>) -> Result<(), SourceFault> {
        let is_toml = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml"));
        if !is_toml && Format::of(path).is_err() {
            return Err(SourceFault::Foreign { path: path.to_path_buf() });
        }
        if !is_toml && !list::is_list(path, &method.limits) {
            return self.single(Found::new(path.to_path_buf(), None, method.clone()), found);
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        for row in list::read(path, &method.limits)? {
            let method = row.method(path, method)?;
            if let Some(name) = row.name.as_ref().filter(|name| !is_name(name)) {
                return Err(SourceFault::Name { path: path.to_path_buf(), name: name.clone() });
            }
            self.single(Found::new(folder.join(&row.path), row.name, method), found)?;
        }
        Ok(())
    }

    fn pattern(&mut self, pattern: &str, method: &Method, found: &mut Vec<Found>) -> Result<(), SourceFault> {
        let wrong = |cause: String| SourceFault::Pattern { pattern: pattern.to_owned(), cause };
        // The part before the first component with a wildcard.
        let fixed = Path::new(pattern)
            .components()
            .take_while(|part| !part.as_os_str().to_string_lossy().contains(['*', '?', '[']));
        self.roots.push(place(&fixed.collect::<PathBuf>()));
        let paths = glob::glob(pattern).map_err(|fault| wrong(fault.to_string()))?;
        for path in paths {
            let path = path.map_err(|fault| SourceFault::System {
                path: fault.path().to_path_buf(),
                cause: fault.into(),
            })?;
            if is_recording(&path) && !self.is_excluded(&path) {
                found.push(Found::new(path, None, method.clone()));
            }
        }
        Ok(())
    }

    fn single(&mut self, one: Found, found: &mut Vec<Found>) -> Result<(), SourceFault> {
        self.roots.extend(one.place.parent().map(Path::to_path_buf));
        found.push(one);
        Ok(())
    }

    fn is_excluded(&self, path: &Path) -> bool {
        // Where outputs go into a folder above the recordings, these are not excluded by it.
        let holds_root = |excluded: &Path| self.roots.last().is_some_and(|root| root.starts_with(excluded));
        !self.excluded.is_empty() && {
            let place = place(path);
            self.excluded.iter().any(|excluded| place.starts_with(excluded) && !holds_root(excluded))
        }
    }
}

impl Found {
    fn new(path: PathBuf, name: Option<String>, method: Method) -> Self {
        Self { place: place(&path), path, name, method }
    }
}

/// A file by the name of a recording, or a bag that is a folder; a link that leads nowhere is one that cannot be read.
fn is_recording(path: &Path) -> bool {
    let is_file = || fs::metadata(path).map_or(true, |found| found.is_file());
    is_bag_folder(path) || (Format::of(path).is_ok() && is_file())
}

/// A name of a file, without a folder.
fn is_name(name: &str) -> bool {
    let plain = Path::new(name).components().eq([Component::Normal(name.as_ref())]);
    plain && !name.starts_with('.') && !name.contains(['/', '\\']) && !name.contains(char::is_control)
}

/// A path without links in its folders, whether or not it is there. A link to a file keeps its own name.
pub(super) fn place(path: &Path) -> PathBuf {
    if let Some(folder) = path.canonicalize().ok().filter(|real| real.is_dir()) {
        return folder;
    }
    let mut plain = PathBuf::new();
    for part in absolute(path).unwrap_or_else(|_| path.to_path_buf()).components() {
        match part {
            Component::ParentDir => drop(plain.pop()),
            part => plain.push(part),
        }
    }
    match (plain.parent().and_then(|folder| folder.canonicalize().ok()), plain.file_name()) {
        (Some(folder), Some(name)) => folder.join(name),
        _ => plain,
    }
}

/// The deepest folder that holds all of these.
fn common(folders: &[PathBuf]) -> PathBuf {
    let mut folders = folders.iter();
    let first = folders.next().cloned().unwrap_or_default();
    folders.fold(first, |common, folder| {
        let shared = common.components().zip(folder.components()).take_while(|(a, b)| a == b);
        shared.map(|(part, _)| part).collect()
    })
}

/// Gives each recording its name; in the order of names.
fn named(found: Vec<Found>, root: &Path) -> Result<Vec<Source>, SourceFault> {
    let from_root = |path: &Path| {
        let below = path.strip_prefix(root).unwrap_or(path);
        below.components().map(|part| part.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
    };
    let stem = |found: &Found| {
        found.name.clone().unwrap_or_else(|| {
            let manifest = Manifest::path_for(&found.place).unwrap_or_else(|| found.place.clone());
            from_root(&manifest.with_extension(""))
        })
    };
    let mut often = BTreeMap::new();
    found.iter().for_each(|found| *often.entry(stem(found)).or_insert(0) += 1);
    let mut sources = BTreeMap::new();
    for found in found {
        let (stem, path) = (stem(&found), from_root(&found.place));
        let alone = found.name.is_some() || often.get(&stem) == Some(&1);
        let name = if alone { stem } else { path.clone() };
        let source = Source { name: name.clone(), path: found.path, from_root: path, method: found.method };
        if let Some(other) = sources.insert(name.clone(), source) {
            let b = sources.remove(&name).map_or_else(PathBuf::new, |source| source.path);
            return Err(SourceFault::Twice { name, a: other.path, b });
        }
    }
    Ok(sources.into_values().collect())
}

#[cfg(test)]
mod tests;

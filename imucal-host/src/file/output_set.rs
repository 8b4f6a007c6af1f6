//! Files that belong together: all of them are replaced, or none.
//!
//! Each is written next to its target first. Then all are renamed; where one rename fails, those before it are taken
//! back. A former file is kept under another name (`.imucal-PROCESS-NUMBER.old`) until the last rename is done, so
//! that a power cut between two renames loses neither.

use std::fs;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use super::output_error::OutputError;
use super::part::{self, Part};
use super::target::{Stream, Target, folder_of};

/// Files that appear together or not at all. Dropped without a commit it leaves every target as it was.
#[derive(Debug, Default)]
pub struct OutputSet {
    outputs: Vec<Output>,
    /// Files that may be replaced; none is spared where this is `None`.
    replaceable: Option<Vec<PathBuf>>,
}

/// One file of a set, to be written to. Nothing is at its target before the set is committed.
#[derive(Debug)]
pub struct Output {
    named: PathBuf,
    to: Destination,
}

#[derive(Debug)]
enum Destination {
    File { target: PathBuf, spared: bool, part: Part },
    Stream { stream: Stream, bytes: Vec<u8> },
}

impl OutputSet {
    /// A set that replaces these files alone (paths as [`Target`] gives them), and spares every other that is there.
    #[must_use]
    pub fn sparing_all_but(replaceable: Vec<PathBuf>) -> Self {
        Self { outputs: Vec::new(), replaceable: Some(replaceable) }
    }

    /// Starts a file that is to become `path`.
    ///
    /// # Errors
    ///
    /// [`OutputError`], when nothing can be written there.
    pub fn create(&mut self, path: &Path) -> Result<&mut Output, OutputError> {
        let to = match Target::of(path)? {
            Target::Stream(stream) => Destination::Stream { stream, bytes: Vec::new() },
            Target::File { path: target, found } => {
                part::sweep_once(folder_of(&target));
                let part = Part::next_to(&target, found.as_ref()).map_err(OutputError::system(path))?;
                let spared = self.replaceable.as_ref().is_some_and(|files| !files.contains(&target));
                Destination::File { target, spared, part }
            }
        };
        self.outputs.push(Output { named: path.to_path_buf(), to });
        // It was just pushed.
        self.outputs.last_mut().ok_or_else(|| OutputError::Folder { path: path.to_path_buf() })
    }

    /// Adds a whole file.
    ///
    /// # Errors
    ///
    /// [`OutputError`], when nothing can be written there or the disk is full.
    pub fn add(&mut self, path: &Path, content: &[u8]) -> Result<(), OutputError> {
        let failed = OutputError::system(path);
        self.create(path)?.write_all(content).map_err(failed)
    }

    /// Brings all files to the disk, sends what is written through, and puts the files in their targets' places.
    ///
    /// # Errors
    ///
    /// [`OutputError`]; then every file is as it was and nothing is left next to it.
    pub fn commit(mut self) -> Result<(), OutputError> {
        for output in &mut self.outputs {
            if let Destination::File { part, .. } = &mut output.to {
                part.finish().map_err(OutputError::system(&output.named))?;
            }
        }
        for output in &self.outputs {
            if let Destination::Stream { stream, bytes } = &output.to {
                let path = &output.named;
                stream.send(bytes).map_err(|cause| OutputError::Stream { path: path.clone(), cause })?;
            }
        }
        place_all(&mut self.outputs)
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.to {
            Destination::File { part, .. } => part.write(bytes),
            Destination::Stream { bytes: kept, .. } => kept.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.to {
            Destination::File { part, .. } => part.flush(),
            Destination::Stream { .. } => Ok(()),
        }
    }
}

/// A file that was put in place, and what was there before.
struct Placed<'a> {
    target: &'a Path,
    former: Option<PathBuf>,
}

fn place_all(outputs: &mut [Output]) -> Result<(), OutputError> {
    // A signal waits for the end of this, so that it finds all files replaced or none.
    let _held = part::held();
    let mut placed = Vec::new();
    for output in outputs {
        let Destination::File { target, spared, part } = &mut output.to else { continue };
        match place(target, *spared, part, &output.named) {
            Ok(former) => placed.push(Placed { target, former }),
            Err(cause) => return Err(take_back(placed, cause)),
        }
    }
    for former in placed.into_iter().filter_map(|placed| placed.former) {
        let _ = fs::remove_file(former);
    }
    Ok(())
}

/// Renames one part onto its target; gives the name under which a former file is kept.
fn place(target: &Path, spared: bool, part: &mut Part, named: &Path) -> Result<Option<PathBuf>, OutputError> {
    let failed = OutputError::system(named);
    let former = match fs::symlink_metadata(target) {
        Ok(found) if found.is_dir() => return Err(OutputError::Folder { path: named.to_path_buf() }),
        Ok(found) if spared && found.len() > 0 => {
            return Err(OutputError::Appeared { path: named.to_path_buf() });
        }
        Ok(_) => Some(keep(target).map_err(&failed)?),
        Err(cause) if cause.kind() == ErrorKind::NotFound => None,
        Err(cause) => return Err(failed(cause)),
    };
    match part.rename(target) {
        Ok(()) => Ok(former),
        Err(cause) => {
            former.iter().for_each(|former| drop(fs::remove_file(former)));
            Err(failed(cause))
        }
    }
}

/// Gives a file a second name, or copies it where the file system knows no second names.
fn keep(target: &Path) -> io::Result<PathBuf> {
    let former = part::name_with(target, ".old");
    match fs::hard_link(target, &former) {
        Ok(()) => Ok(former),
        Err(_) => fs::copy(target, &former).map(|_| former),
    }
}

/// Undoes, last first, what was put in place before `cause`.
fn take_back(placed: Vec<Placed<'_>>, cause: OutputError) -> OutputError {
    let mut cause = cause;
    for Placed { target, former } in placed.into_iter().rev() {
        match former {
            None => drop(fs::remove_file(target)),
            Some(kept) => {
                if fs::rename(&kept, target).is_err() {
                    let (changed, before) = (target.to_path_buf(), Box::new(cause));
                    cause = OutputError::NotUndone { changed, kept, cause: before };
                }
            }
        }
    }
    cause
}

#[cfg(test)]
mod tests;

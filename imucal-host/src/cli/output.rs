//! What a command prints, and where it writes.

use std::{
    fmt::{Arguments, Display},
    io::{ErrorKind, Write},
    path::{Path, PathBuf},
};

use anyhow::Context;

use crate::recording::{AtomicFile, Manifest};

/// A line on standard output. A reader that has closed the pipe has read all it wanted, which is no failure.
pub(super) fn line(text: Arguments<'_>) -> anyhow::Result<()> {
    match writeln!(std::io::stdout(), "{text}") {
        Err(cause) if cause.kind() != ErrorKind::BrokenPipe => {
            Err(cause).context("standard output cannot be written; check where it leads")
        }
        _ => Ok(()),
    }
}

/// A line on standard output, as `println!`, but a failure is an error and a closed pipe is none.
macro_rules! say {
    ($($part:tt)*) => { $crate::cli::output::line(format_args!($($part)*))? };
}
pub(super) use say;

/// Text that ends its own lines.
pub(super) fn text(text: &str) -> anyhow::Result<()> {
    line(format_args!("{}", text.strip_suffix('\n').unwrap_or(text)))
}

/// A line for the user on standard error; where nobody can read it, there is nobody to tell.
pub(super) fn tell(what: &str, message: &dyn Display) {
    let _ = writeln!(std::io::stderr(), "imucal: {what}: {message}");
}

/// Writes a file whole or not at all, with an error that names it.
pub(super) fn file(path: &Path, content: &str) -> anyhow::Result<()> {
    AtomicFile::write_whole(path, content.as_bytes()).map_err(|cause| {
        anyhow::anyhow!(
            "{}: cannot be written: {cause}; check the folder and its permissions; nothing was changed",
            path.display()
        )
    })
}

/// The samples of a recording and the manifest beside them.
pub(super) fn files_of(recording: &Path) -> Vec<PathBuf> {
    let manifest = Manifest::path_beside(recording);
    std::iter::once(recording.to_path_buf()).chain(manifest).collect()
}

/// Refuses outputs that would replace what was read, or each other. To be asked before anything is written.
pub(super) fn check(inputs: &[PathBuf], outputs: &[PathBuf]) -> anyhow::Result<()> {
    for (index, output) in outputs.iter().enumerate() {
        let place = place(output);
        if let Some(input) = inputs.iter().find(|input| self::place(input) == place) {
            anyhow::bail!(
                "{}: found an output of the same name as the input {}, expected another, since that one would be \
                 lost; choose another name; nothing was written",
                output.display(),
                input.display()
            );
        }
        if outputs[..index].iter().any(|other| self::place(other) == place) {
            anyhow::bail!(
                "{}: found two outputs of this name, expected one; choose another name for one of them; nothing was \
                 written",
                output.display()
            );
        }
    }
    Ok(())
}

/// Where a path leads, whether or not a file is there.
fn place(path: &Path) -> PathBuf {
    if let Ok(real) = path.canonicalize() {
        return real;
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match (folder.canonicalize(), path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path.to_path_buf(),
    }
}

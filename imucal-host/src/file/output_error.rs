//! Why a file could not be written.

use std::io;
use std::path::{Path, PathBuf};

/// A failure to write; its text names the file, what was found, what was expected and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)] // The fields are those of each message.
pub enum OutputError {
    /// The system refuses.
    #[error(
        "{path}: cannot be written ({cause}), expected a writable place with room; check the folder, its permissions and the disk; nothing was changed"
    )]
    System { path: PathBuf, cause: io::Error },
    /// What is no plain file did not take all of it; files of the same set are as they were.
    #[error("{path}: cannot be written to its end ({cause}); check who reads it; no file was changed")]
    Stream { path: PathBuf, cause: io::Error },
    /// A folder of that name.
    #[error(
        "{path}: cannot be written: found a folder of this name, expected a file or none; check the folder, or choose another name; nothing was changed"
    )]
    Folder { path: PathBuf },
    /// The file may not be changed.
    #[error(
        "{path}: cannot be written: found a file that is read-only, expected a writable one; make it writable, or choose another name; nothing was changed"
    )]
    ReadOnly { path: PathBuf },
    /// A file has come meanwhile.
    #[error(
        "{path}: cannot be written: found a file that was not there when the program started, expected none; move it away, or choose another name; nothing was changed"
    )]
    Appeared { path: PathBuf },
    /// A failed set could not be taken back.
    #[error(
        "{changed}: cannot be put back as it was; its former content is in {kept}: rename it. This came after: {cause}"
    )]
    NotUndone { changed: PathBuf, kept: PathBuf, cause: Box<OutputError> },
}

impl OutputError {
    /// The system's refusal, with the path as it was given.
    pub(super) fn system(path: &Path) -> impl Fn(io::Error) -> Self {
        let path = path.to_path_buf();
        move |cause| Self::System { path: path.clone(), cause }
    }
}

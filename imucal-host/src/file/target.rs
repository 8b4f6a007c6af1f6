//! What the path of an output leads to.

use std::fs::{self, Metadata, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use super::output_error::OutputError;

/// More links than this in a row are taken for a circle, as Linux does.
const LINKS: usize = 40;

/// What a path leads to once its links are followed.
#[derive(Debug)]
pub enum Target {
    /// A plain file, or none yet: replaced as a whole.
    File {
        /// Where it is, or is to be.
        path: PathBuf,
        /// What is there now.
        found: Option<Metadata>,
    },
    /// A device or a pipe: written through.
    Stream(Stream),
}

/// What is written through.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Stream {
    /// The standard output of this process.
    StandardOutput,
    /// Its standard error.
    StandardError,
    /// A device, a FIFO or another open descriptor.
    Other(PathBuf),
}

impl Target {
    /// Follows a path and looks at what is there; nothing is changed.
    ///
    /// # Errors
    ///
    /// [`OutputError`], where nothing can be written: a folder, a read-only file, no such folder.
    pub fn of(named: &Path) -> Result<Self, OutputError> {
        let failed = OutputError::system(named);
        let path = followed(named).map_err(&failed)?;
        if let Some(stream) = descriptor(&path) {
            return Ok(Self::Stream(stream));
        }
        match fs::metadata(&path) {
            Ok(found) if found.is_dir() => Err(OutputError::Folder { path: named.to_path_buf() }),
            Ok(found) if found.is_file() => {
                refuse_read_only(named, &path, &found)?;
                Ok(Self::File { path, found: Some(found) })
            }
            Ok(_) => Ok(Self::Stream(Stream::Other(path))),
            Err(cause) if cause.kind() == ErrorKind::NotFound => {
                refuse_missing_folder(&path).map_err(&failed)?;
                Ok(Self::File { path, found: None })
            }
            Err(cause) => Err(failed(cause)),
        }
    }
}

impl Stream {
    /// Sends everything. A reader of the standard output that has closed it has read all it wanted.
    pub(super) fn send(&self, bytes: &[u8]) -> io::Result<()> {
        let sent = match self {
            Self::StandardOutput => send_to(io::stdout().lock(), bytes),
            Self::StandardError => send_to(io::stderr().lock(), bytes),
            Self::Other(path) => return send_to(OpenOptions::new().write(true).open(path)?, bytes),
        };
        sent.or_else(|cause| if cause.kind() == ErrorKind::BrokenPipe { Ok(()) } else { Err(cause) })
    }
}

fn send_to(mut to: impl Write, bytes: &[u8]) -> io::Result<()> {
    to.write_all(bytes)?;
    to.flush()
}

/// Where a path leads, link by link; the last of them may lead to nothing yet. Open descriptors end the way: what
/// they are linked to is a name for people.
fn followed(named: &Path) -> io::Result<PathBuf> {
    let mut path = named.to_path_buf();
    for _ in 0..LINKS {
        if descriptor(&path).is_some() {
            return Ok(path);
        }
        match fs::read_link(&path) {
            Ok(next) => path = folder_of(&path).join(next),
            // Not a link, or nothing there.
            Err(cause) if matches!(cause.kind(), ErrorKind::InvalidInput | ErrorKind::NotFound) => {
                return Ok(path);
            }
            Err(cause) => return Err(cause),
        }
    }
    Err(io::Error::other("found a circle of links"))
}

/// An open descriptor of this process by one of its names.
fn descriptor(path: &Path) -> Option<Stream> {
    let number = |at: &Path| at.file_name()?.to_str()?.parse::<u32>().ok();
    let numbered = ["/dev/fd", "/proc/self/fd"].iter().any(|folder| path.parent() == Some(Path::new(folder)));
    match path.to_str() {
        Some("/dev/stdout") => Some(Stream::StandardOutput),
        Some("/dev/stderr") => Some(Stream::StandardError),
        _ if numbered => match number(path)? {
            1 => Some(Stream::StandardOutput),
            2 => Some(Stream::StandardError),
            _ => Some(Stream::Other(path.to_path_buf())),
        },
        _ => None,
    }
}

/// The folder that a path is in.
pub(super) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn refuse_missing_folder(path: &Path) -> io::Result<()> {
    if path.file_name().is_none() {
        return Err(io::Error::new(ErrorKind::InvalidInput, "the path ends in no file name"));
    }
    let folder = folder_of(path);
    match fs::metadata(folder) {
        Ok(found) if found.is_dir() => Ok(()),
        Ok(_) => Err(io::Error::new(ErrorKind::NotADirectory, format!("{} is no folder", folder.display()))),
        Err(cause) => Err(io::Error::new(cause.kind(), format!("{}: {cause}", folder.display()))),
    }
}

/// A rename asks for no permission of the file that it replaces, so it is asked for here.
fn refuse_read_only(named: &Path, path: &Path, found: &Metadata) -> Result<(), OutputError> {
    // The superuser may open a read-only file all the same; it was made so for a reason.
    let denied = found.permissions().readonly()
        || OpenOptions::new()
            .write(true)
            .open(path)
            .is_err_and(|cause| cause.kind() == ErrorKind::PermissionDenied);
    if denied { Err(OutputError::ReadOnly { path: named.to_path_buf() }) } else { Ok(()) }
}

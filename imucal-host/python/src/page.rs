//! Pages of results, where they are asked for.

use std::{io, path::Path};

/// A page that is asked for; the recording's file is read again for its hash.
pub(crate) fn page(
    asked: bool,
    recording: &Path,
    make: impl FnOnce() -> io::Result<String>,
) -> Result<Option<String>, String> {
    let again = |cause| format!("{}: cannot be read again ({cause})", recording.display());
    asked.then(make).transpose().map_err(again)
}

//! Where the recordings are that the tests need and the project does not hold.

use std::path::PathBuf;

/// The folder named by `IMUCAL_DATA`, by default `../shared/data` next to the project.
///
/// Without it the test is skipped, loudly; under `CI=true` it fails.
pub fn folder() -> Option<PathBuf> {
    let folder = std::env::var_os("IMUCAL_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    if folder.join("real").is_dir() {
        return Some(folder);
    }
    let missing = format!("no recordings in {}: set IMUCAL_DATA", folder.display());
    assert!(std::env::var_os("CI").is_none_or(|ci| ci != "true"), "{missing}");
    eprintln!("\n*** SKIPPED: {missing} ***\n");
    None
}

/// A recording of a real sensor by its file name, where the folder is there.
pub fn real(file: &str) -> Option<PathBuf> {
    Some(folder()?.join("real").join(file))
}

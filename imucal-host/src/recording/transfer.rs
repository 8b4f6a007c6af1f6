//! To a file, part after part in constant memory: one thread makes a part, or reads and alters it, another one writes.

use std::{
    ops::ControlFlow,
    panic,
    path::Path,
    sync::mpsc::{SyncSender, sync_channel},
    thread,
};

use super::{ReadError, Recording, Source, Warning, WriteError, Written};
use crate::file::OutputSet;

/// Parts that wait for the writer.
const WAITING: usize = 1;

/// What has gone from file to file.
#[derive(Clone, Debug, PartialEq)]
pub struct Transferred {
    /// Its rows.
    pub rows: usize,
    /// What was odd but harmless in it.
    pub warnings: Vec<Warning>,
}

/// Why a recording did not go from file to file.
#[derive(Debug, thiserror::Error)]
pub enum TransferError {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// It cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Reads a recording by parts and writes what `alter` makes of each into files of a set that is to be committed. It ends where
/// `alter` makes nothing of one.
///
/// # Errors
/// [`TransferError`]; then the set is not to be committed.
pub fn transfer(
    source: Source<'_>,
    out: &Path,
    files: &mut OutputSet,
    alter: impl FnMut(Recording) -> Option<Recording>,
) -> Result<Transferred, TransferError> {
    let (read, written) = write_as_made(out, files, |parts| read(source, parts, alter));
    let mut warnings = read?;
    let Written { rows, left_out } = written?;
    warnings.extend(left_out);
    Ok(Transferred { rows, warnings })
}

/// Writes the parts that `make` sends into files of a set, while it makes the next; what `make` returned, and what was written. Nobody
/// takes a part any more once the system has refused one.
pub fn write_as_made<T>(
    out: &Path,
    files: &mut OutputSet,
    make: impl FnOnce(SyncSender<Recording>) -> T,
) -> (T, Result<Written, WriteError>) {
    thread::scope(|scope| {
        let (parts, made) = sync_channel(WAITING);
        let writer = scope.spawn(move || Recording::write_parts(made, out, files));
        let ended = make(parts);
        (ended, writer.join().unwrap_or_else(|panicked| panic::resume_unwind(panicked)))
    })
}

/// Sends what `alter` makes of each part, until it makes nothing of one or nobody takes it any more.
fn read(
    source: Source<'_>,
    parts: SyncSender<Recording>,
    mut alter: impl FnMut(Recording) -> Option<Recording>,
) -> Result<Vec<Warning>, ReadError> {
    Recording::read_parts(source, &mut |part| {
        let sent = alter(part).is_some_and(|part| parts.send(part).is_ok());
        if sent { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::{file::Limits, recording::Mapping};

    #[test]
    fn a_recording_of_several_parts_goes_from_file_to_file_as_its_whole_does() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let row =
            |k: usize| format!("{},{},0.5,-9.75,{}\n", k as f64 / 128.0, (k % 31) as f64 / 64.0, k / 500);
        let text =
            (0..2 * 65_536 + 7).fold("t,acc_x,acc_y,acc_z,segment\n".to_owned(), |text, k| text + &row(k));
        fs::write(path("run.csv"), text).unwrap();
        fs::write(path("run.toml"), "format = \"imucal-recording/1\"\n[units]\nt = \"s\"\nacc = \"m/s^2\"\n")
            .unwrap();
        let whole = Recording::read(&path("run.csv")).unwrap();
        whole.write(&path("whole.csv.gz")).unwrap();
        let (run, mapping, limits) = (path("run.csv"), Mapping::default(), Limits::default());
        let source = Source { path: &run, mapping: &mapping, manifest: None, limits: &limits };
        let mut files = OutputSet::default();
        let done = transfer(source, &path("parts.csv.gz"), &mut files, Some).unwrap();
        files.commit().unwrap();
        assert_eq!((done.rows, &done.warnings), (whole.rows(), &whole.warnings));
        let bytes = |name: &str| fs::read(path(name)).unwrap();
        assert!(bytes("parts.csv.gz") == bytes("whole.csv.gz"));
        assert_eq!(bytes("parts.toml"), bytes("whole.toml"));
    }
}

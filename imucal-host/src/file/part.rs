//! A part: a file that is written in its target's folder until it takes the target's place.
//!
//! Parts are named `.imucal-PROCESS-NUMBER.part`. Each is locked (`flock`) as long as its process lives, whichever
//! container or machine that runs in, so a part that can be locked is stale: its process was killed, or the power
//! failed. Stale parts are removed by the next program that writes into the folder. Where the file system has no
//! locks, none is removed.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::target::folder_of;

const PREFIX: &str = ".imucal-";
const SUFFIX: &str = ".part";

static NUMBER: AtomicU32 = AtomicU32::new(0);
/// The parts of this process.
static PARTS: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// A name in the target's folder that nothing else of this process has.
pub(super) fn name_with(target: &Path, suffix: &str) -> PathBuf {
    let number = NUMBER.fetch_add(1, Ordering::Relaxed);
    folder_of(target).join(format!("{PREFIX}{}-{number}{suffix}", std::process::id()))
}

/// A file under way; removed when dropped, unless [`Part::rename`] has put it in place.
#[derive(Debug)]
pub(super) struct Part {
    path: PathBuf,
    writer: BufWriter<File>,
    placed: bool,
}

impl Part {
    /// Starts a file in the target's folder, with owner and mode of the one that it is to replace.
    pub(super) fn next_to(target: &Path, replaced: Option<&Metadata>) -> io::Result<Self> {
        loop {
            let path = name_with(target, SUFFIX);
            // Held until the part is known, so that a signal between finds it.
            let mut parts = held();
            let file = match OpenOptions::new().write(true).create_new(true).open(&path) {
                // Of a process of the same number, elsewhere.
                Err(cause) if cause.kind() == ErrorKind::AlreadyExists => continue,
                opened => opened?,
            };
            parts.insert(path.clone());
            drop(parts);
            let part = Self { path, writer: BufWriter::new(file), placed: false };
            // A sweep of another process may have had the lock for an instant, and then it has removed the file.
            let _ = part.writer.get_ref().lock();
            if part.path.exists() {
                if let Some(replaced) = replaced {
                    keep_owner_and_mode(part.writer.get_ref(), replaced)?;
                }
                return Ok(part);
            }
        }
    }

    /// Brings what was written to the disk.
    pub(super) fn finish(&mut self) -> io::Result<()> {
        self.writer.flush()?;
        self.writer.get_ref().sync_all()
    }

    /// Puts the file in its target's place, over a former one of that name. The lock goes with the part, after that.
    pub(super) fn rename(&mut self, target: &Path) -> io::Result<()> {
        fs::rename(&self.path, target)?;
        self.placed = true;
        Ok(())
    }
}

impl Write for Part {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        let mut parts = held();
        if !self.placed {
            let _ = fs::remove_file(&self.path);
        }
        parts.remove(&self.path);
    }
}

/// Gives a new file what it can of the owner, and the mode, of the one that it replaces.
fn keep_owner_and_mode(file: &File, replaced: &Metadata) -> io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::{MetadataExt, fchown};
        // Only the superuser can give files away, and others only to groups of their own.
        let _ = fchown(file, None, Some(replaced.gid()));
        let _ = fchown(file, Some(replaced.uid()), None);
    }
    file.set_permissions(replaced.permissions())
}

/// While this is held no part is made, removed or put in place by others: a set is put in place within it, and a
/// signal waits for that.
pub(super) fn held() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    PARTS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The end of all parts of this process: as long as it is held, none is made or put in place any more.
#[derive(Debug)]
pub struct Abandoned(
    #[expect(dead_code, reason = "held for its end")] MutexGuard<'static, BTreeSet<PathBuf>>,
);

/// Removes the parts of this process, for one that a signal is about to end.
#[must_use]
pub fn abandon_parts() -> Abandoned {
    let parts = held();
    for path in parts.iter() {
        let _ = fs::remove_file(path);
    }
    Abandoned(parts)
}

/// The folders that this process has swept: once is enough, and a folder may have many files.
static SWEPT: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Sweeps a folder that this process is about to write into, the first time.
pub(super) fn sweep_once(folder: &Path) {
    let first = SWEPT.lock().unwrap_or_else(PoisonError::into_inner).insert(folder.to_path_buf());
    if first {
        sweep(folder);
    }
}

/// Removes the parts in a folder whose processes are gone.
fn sweep(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if is_part(&entry.file_name()) && entry.file_type().is_ok_and(|kind| kind.is_file()) {
            remove_stale(&entry.path());
        }
    }
}

fn is_part(name: &OsStr) -> bool {
    let middle = name.to_str().and_then(|name| name.strip_prefix(PREFIX)?.strip_suffix(SUFFIX));
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    middle
        .and_then(|middle| middle.split_once('-'))
        .is_some_and(|(process, number)| is_number(process) && is_number(number))
}

fn remove_stale(path: &Path) {
    let file = OpenOptions::new().write(true).open(path);
    // The lock is held until the file is gone, so that who has just made it waits and sees that.
    if file.as_ref().is_ok_and(|file| file.try_lock().is_ok()) {
        let _ = fs::remove_file(path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_unlocked_parts_are_swept() {
        let folder = tempfile::tempdir().unwrap();
        let others =
            [".imucal-1.part", ".imucal-1-.part", ".imucal-1-2.old", ".a.1-2.part", "imucal-1-2.part"];
        for name in others.into_iter().chain([".imucal-4194304-0.part"]) {
            fs::write(folder.path().join(name), "left").unwrap();
        }
        let mine = Part::next_to(&folder.path().join("a.csv"), None).unwrap();
        sweep(folder.path());
        let kept = |name: &str| folder.path().join(name).exists();
        assert!(!kept(".imucal-4194304-0.part"));
        assert!(others.into_iter().all(kept) && mine.path.exists());
        drop(mine);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), others.len());
    }
}

//! Files that appear whole or not at all.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

static SERIAL: AtomicU32 = AtomicU32::new(0);

/// A file written beside its target and renamed onto it by [`AtomicFile::commit`].
///
/// Dropped without a commit it removes what it wrote and leaves the target as it was.
#[derive(Debug)]
pub struct AtomicFile {
    target: PathBuf,
    temporary: PathBuf,
    writer: Option<BufWriter<File>>,
}

impl AtomicFile {
    /// Starts a file that is to become `target`, whose directory must be there and writable.
    ///
    /// # Errors
    ///
    /// What the system says, when no file can be made in the target's directory.
    pub fn create(target: &Path) -> io::Result<Self> {
        let temporary = temporary_beside(target)?;
        let file = OpenOptions::new().write(true).create_new(true).open(&temporary)?;
        Ok(Self { target: target.to_path_buf(), temporary, writer: Some(BufWriter::new(file)) })
    }

    /// Flushes the file to the disk and puts it in the target's place, over a former file of that name.
    ///
    /// # Errors
    ///
    /// What the system says, when the rest cannot be written or the file cannot be renamed; then the
    /// target is as it was and nothing is left beside it.
    pub fn commit(mut self) -> io::Result<()> {
        let writer = self.writer.take().ok_or_else(|| io::Error::other("the file is closed"))?;
        let file = writer.into_inner().map_err(io::IntoInnerError::into_error)?;
        file.sync_all()?;
        drop(file);
        fs::rename(&self.temporary, &self.target)
    }

    /// Writes a whole file at once.
    ///
    /// # Errors
    ///
    /// As [`AtomicFile::create`] and [`AtomicFile::commit`], and when the disk is full.
    pub fn write_whole(target: &Path, content: &[u8]) -> io::Result<()> {
        let mut file = Self::create(target)?;
        file.write_all(content)?;
        file.commit()
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.writer {
            Some(writer) => writer.write(bytes),
            None => Err(io::Error::other("the file is closed")),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.as_mut().map_or(Ok(()), BufWriter::flush)
    }
}

impl Drop for AtomicFile {
    fn drop(&mut self) {
        // After a successful rename there is nothing of this name, and then nothing to report.
        drop(self.writer.take());
        let _ = fs::remove_file(&self.temporary);
    }
}

/// A name of the same directory, so that the rename stays within one file system.
fn temporary_beside(target: &Path) -> io::Result<PathBuf> {
    let name = target
        .file_name()
        .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "the path ends in no file name"))?;
    let mut temporary = OsString::from(".");
    temporary.push(name);
    let serial = SERIAL.fetch_add(1, Ordering::Relaxed);
    temporary.push(format!(".{}-{serial}.part", std::process::id()));
    Ok(target.with_file_name(temporary))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<OsString> {
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name()).collect()
    }

    #[test]
    fn a_committed_file_replaces_its_target_and_leaves_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.csv");
        fs::write(&target, "old").unwrap();
        AtomicFile::write_whole(&target, b"new").unwrap();
        assert_eq!(fs::read_to_string(&target).unwrap(), "new");
        assert_eq!(names(folder.path()), ["a.csv"]);
    }

    #[test]
    fn an_abandoned_file_leaves_the_target_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.csv");
        fs::write(&target, "old").unwrap();
        let mut file = AtomicFile::create(&target).unwrap();
        file.write_all(b"half").unwrap();
        file.flush().unwrap();
        drop(file);
        assert_eq!(fs::read_to_string(&target).unwrap(), "old");
        assert_eq!(names(folder.path()), ["a.csv"]);
    }

    #[test]
    fn a_target_that_cannot_be_replaced_is_an_error_and_nothing_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.csv");
        fs::create_dir(&target).unwrap();
        assert!(AtomicFile::write_whole(&target, b"new").is_err());
        assert_eq!(names(folder.path()), ["a.csv"]);
    }

    #[test]
    fn a_missing_directory_and_a_nameless_path_are_errors() {
        let folder = tempfile::tempdir().unwrap();
        assert!(AtomicFile::create(&folder.path().join("none/a.csv")).is_err());
        assert!(AtomicFile::create(Path::new("/")).is_err());
    }
}

//! How much memory the samples of a file may take.

use std::{cell::Cell, path::Path};

use crate::{file::limits::Size, recording::read_error::ReadError};

/// Bytes that the samples take in memory, against those they may take.
pub(crate) struct Memory<'a> {
    path: &'a Path,
    limit: u64,
    taken: Cell<u64>,
}

impl<'a> Memory<'a> {
    pub(crate) fn new(path: &'a Path, limit: u64) -> Self {
        Self { path, limit, taken: Cell::new(0) }
    }

    /// Counts so many more; whether they are allowed.
    pub(crate) fn take(&self, bytes: u64) -> bool {
        self.taken.set(self.taken.get().saturating_add(bytes));
        self.taken.get() <= self.limit
    }

    pub(crate) fn check(&self) -> Result<(), ReadError> {
        if self.take(0) {
            return Ok(());
        }
        Err(ReadError::TooManySamples { path: self.path.to_path_buf(), limit: Size(self.limit) })
    }
}

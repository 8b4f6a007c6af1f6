//! A serial driver of embedded-io as a [`ByteLink`].
//!
//! | the driver says | the link |
//! | --- | --- |
//! | not ready, or `Interrupted` | has no byte, or no room, now: the same is tried in the next turn |
//! | any other error while it reads | has no byte now; it is counted |
//! | any other error while it writes | leaves the byte out; it is counted |
//! | end of file, or a write of nothing | has no byte, or no room, now |
//!
//! A frame that lacks a byte fails its checksum, and the host asks again. A byte that is never taken would keep the
//! co-processor from all further requests.

use embedded_io::{Error, ErrorKind, Read, ReadReady, Write, WriteReady};

use crate::board::ByteLink;

/// A driver that reads and writes; it is never asked for what it would wait for.
///
/// What the driver has taken, it sends by itself: `flush` is not called, since it waits.
#[derive(Debug)]
pub struct IoLink<T> {
    line: T,
    errors: u32,
}

impl<T> IoLink<T> {
    /// Over this driver.
    pub const fn new(line: T) -> Self {
        Self { line, errors: 0 }
    }

    /// Errors of the driver so far, up to `u32::MAX`.
    pub const fn errors(&self) -> u32 {
        self.errors
    }

    /// The driver.
    pub fn into_inner(self) -> T {
        self.line
    }
}

impl<T: Read + ReadReady + Write + WriteReady> ByteLink for IoLink<T> {
    fn receive(&mut self) -> Option<u8> {
        let mut byte = [0];
        let read = match self.line.read_ready() {
            Ok(true) => self.line.read(&mut byte),
            Ok(false) => Ok(0),
            Err(error) => Err(error),
        };
        match read {
            Ok(0) => None,
            Ok(_) => Some(byte[0]),
            Err(error) => {
                self.errors = self.errors.saturating_add(u32::from(!passes(&error)));
                None
            }
        }
    }

    fn send(&mut self, byte: u8) -> bool {
        let written = match self.line.write_ready() {
            Ok(true) => self.line.write(&[byte]),
            Ok(false) => Ok(0),
            Err(error) => Err(error),
        };
        match written {
            Ok(taken) => taken > 0,
            Err(error) if passes(&error) => false,
            Err(_) => {
                self.errors = self.errors.saturating_add(1);
                true
            }
        }
    }
}

/// Nothing was done, and the next try may do it.
pub(super) fn passes(error: &impl Error) -> bool {
    error.kind() == ErrorKind::Interrupted
}

//! How much of recordings this process has read, for who waits for it.

use std::{
    io::{self, Read},
    sync::atomic::{AtomicU64, Ordering},
};

static READ: AtomicU64 = AtomicU64::new(0);

/// Bytes that all [`Metered`] sources have given so far.
#[must_use]
pub fn bytes_read() -> u64 {
    READ.load(Ordering::Relaxed)
}

/// A source whose bytes are counted.
pub struct Metered<R>(pub R);

impl<R: Read> Read for Metered<R> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let read = self.0.read(to)?;
        READ.fetch_add(read as u64, Ordering::Relaxed);
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_read_is_counted() {
        let before = bytes_read();
        let mut text = Vec::new();
        Metered([7; 1000].as_slice()).read_to_end(&mut text).unwrap();
        assert_eq!(text.len(), 1000);
        assert!(bytes_read() >= before + 1000);
    }
}

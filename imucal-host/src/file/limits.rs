//! How much of a file is read: as much as the data need, so that a foreign file cannot fill the memory.

use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Bytes of a line for each column that is allowed. A number takes 25 at most.
const PER_COLUMN: usize = 64;
/// A manifest or a calibration may come to a 1024th of [`Limits::size`], or to this.
const SMALL: u64 = 1 << 20;

/// What one file may come to. The default holds a day of nine axes at 100 Hz.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of a recording's samples: as text, after decompression, and in memory.
    pub size: u64,
    /// Columns of a recording.
    pub columns: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self { size: 1 << 30, columns: 1024 }
    }
}

impl Limits {
    /// Bytes of one line of samples.
    #[must_use]
    pub fn line(&self) -> usize {
        self.columns.saturating_mul(PER_COLUMN)
    }

    /// Bytes of a manifest or a calibration.
    #[must_use]
    pub fn small(&self) -> u64 {
        (self.size / 1024).max(SMALL)
    }

    /// The whole of a manifest or a calibration.
    ///
    /// # Errors
    ///
    /// [`ReadFault`].
    pub fn read_small(&self, path: &Path) -> Result<Vec<u8>, ReadFault> {
        read_within(File::open(path)?, self.small())
    }

    /// The whole of a file that may be as long as a recording.
    ///
    /// # Errors
    ///
    /// [`ReadFault`].
    pub fn read_large(&self, path: &Path) -> Result<Vec<u8>, ReadFault> {
        read_within(File::open(path)?, self.size)
    }
}

fn read_within(source: impl Read, limit: u64) -> Result<Vec<u8>, ReadFault> {
    let mut bytes = Vec::new();
    source.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit { Err(ReadFault::TooLarge { limit }) } else { Ok(bytes) }
}

/// Why a file was not read to its end.
#[derive(Debug, thiserror::Error)]
pub enum ReadFault {
    /// The system refuses.
    #[error(transparent)]
    System(#[from] io::Error),
    /// It is longer than its kind of file is.
    #[error("more than {}", Size(*.limit))]
    TooLarge {
        /// Bytes that are allowed.
        limit: u64,
    },
}

/// A number of bytes, in words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size(pub u64);

/// Letters of the powers of 1024.
const POWERS: [(char, u64); 4] = [('T', 1 << 40), ('G', 1 << 30), ('M', 1 << 20), ('K', 1 << 10)];

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match POWERS.into_iter().find(|(_, power)| self.0 >= *power && self.0.is_multiple_of(*power)) {
            Some((letter, power)) => write!(f, "{} {letter}iB", self.0 / power),
            None => write!(f, "{} bytes", self.0),
        }
    }
}

impl std::str::FromStr for Size {
    type Err = String;

    /// `4G`, `512M`, `64K` or bytes; the letters are powers of 1024.
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is no size; expected for instance 512M or 4G");
        let bare = text.trim_end_matches("iB");
        let power = POWERS.into_iter().find(|(letter, _)| bare.to_ascii_uppercase().ends_with(*letter));
        let (digits, factor) = power.map_or((bare, 1), |(_, power)| (&bare[..bare.len() - 1], power));
        let count: u64 = digits.trim_end().parse().map_err(|_| wrong())?;
        count.checked_mul(factor).filter(|size| *size > 0).map(Self).ok_or_else(wrong)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_that_does_not_end_is_read_up_to_its_limit() {
        let read = |limit| read_within(io::repeat(0), limit);
        assert!(matches!(read(1000), Err(ReadFault::TooLarge { limit: 1000 })));
        assert_eq!(read_within(&b"abc"[..], 3).unwrap(), b"abc");
        assert!(read_within(&b"abcd"[..], 3).is_err());
    }

    #[test]
    fn sizes_are_read_as_they_are_printed() {
        for (text, size) in [("1 GiB", 1u64 << 30), ("512 MiB", 512 << 20), ("1000 bytes", 1000)] {
            assert_eq!(Size(size).to_string(), text);
        }
        for (text, size) in [("4G", 4u64 << 30), ("512m", 512 << 20), ("64KiB", 64 << 10), ("1000", 1000)] {
            assert_eq!(text.parse(), Ok(Size(size)), "{text}");
        }
        for wrong in ["", "G", "-1", "1.5G", "big", "0", "99999999999T"] {
            assert!(wrong.parse::<Size>().unwrap_err().contains("expected for instance 512M"), "{wrong}");
        }
    }
}

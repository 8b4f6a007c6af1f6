//! Summary to bytes and back: framed as a [record](crate::record) is, with another magic.
//!
//! ```text
//! 0        4       5       6          8                  8+n       12+n
//! ├────────┼───────┼───────┼──────────┼───────────────────┼─────────┤
//! │ "IMUW" │ major │ minor │ n, u16   │ payload, n bytes  │ CRC-32  │
//! └────────┴───────┴───────┴──────────┴───────────────────┴─────────┘
//! ```
//!
//! The payload is [`WatchSummary`] in postcard 1. The minor rises when fields are appended to it; another major is refused.

use core::fmt;

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

use super::WatchSummary;

/// Major and minor version of the format.
pub const VERSION: (u8, u8) = (1, 0);

const MAGIC: [u8; 4] = *b"IMUW";
const HEADER: usize = 8;
const CHECKSUM: usize = 4;
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// A buffer of this length suffices for [`encode`].
pub const MAX_LEN: usize = HEADER + longest::SUMMARY + CHECKSUM;

/// Longest encoding of each part, in postcard's terms.
mod longest {
    const TAG: usize = 1;
    const F32: usize = 4;
    const U32: usize = 5;
    const U16: usize = 3;
    const TEXT: usize = 1 + 32;
    const SHIFT: usize = 2 * U32 + 2 * F32 + (TAG + F32) + TAG;
    const SPELL: usize = 2 * U32 + F32;
    const STATISTIC: usize = U32 + 9 * F32 + 2 * U16 + (TAG + SHIFT) + (TAG + SPELL);
    const TEMPERATURE: usize = 2 * F32 + U32;
    pub const SUMMARY: usize = 2 * TEXT + U32 + F32 + 10 * U32 + (TAG + TEMPERATURE) + 6 * STATISTIC;
}

/// Why no summary was written or read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SummaryError {
    /// The buffer is too short, or the bytes end before the summary does.
    Short {
        /// Bytes given.
        have: usize,
        /// Bytes needed, as far as is known.
        need: usize,
    },
    /// The bytes do not begin with `IMUW`.
    Foreign,
    /// A format of another major version.
    Version {
        /// Of the summary.
        found: u8,
    },
    /// Damaged after it was written.
    Damaged,
    /// Intact, but no summary of the version it claims.
    Malformed,
}

/// Writes a summary to the start of `buffer`; gives the bytes written.
///
/// # Errors
///
/// [`SummaryError::Short`]; [`MAX_LEN`] always suffices.
pub fn encode<'b>(summary: &WatchSummary, buffer: &'b mut [u8]) -> Result<&'b [u8], SummaryError> {
    let have = buffer.len();
    let short = SummaryError::Short { have, need: MAX_LEN };
    let room = buffer.get_mut(HEADER..).ok_or(short)?;
    let length = postcard::to_slice(summary, room).map_err(|_| short)?.len();
    let whole = buffer.get_mut(..HEADER + length + CHECKSUM).ok_or(short)?;
    let (checked, checksum) = whole.split_last_chunk_mut::<CHECKSUM>().ok_or(short)?;
    let header = checked.first_chunk_mut::<HEADER>().ok_or(short)?;
    let ([m, u, c, w], [a, b]) = (MAGIC, (length as u16).to_le_bytes());
    *header = [m, u, c, w, VERSION.0, VERSION.1, a, b];
    *checksum = CRC.checksum(checked).to_le_bytes();
    Ok(whole)
}

/// Reads the summary at the start of `bytes`; what follows its checksum is ignored.
///
/// # Errors
///
/// [`SummaryError`].
pub fn decode(bytes: &[u8]) -> Result<WatchSummary, SummaryError> {
    let have = bytes.len();
    let short = |need| SummaryError::Short { have, need };
    let (header, _) = bytes.split_first_chunk::<HEADER>().ok_or(short(HEADER + CHECKSUM))?;
    let [m, u, c, w, major, minor, a, b] = *header;
    if [m, u, c, w] != MAGIC {
        return Err(SummaryError::Foreign);
    }
    if major != VERSION.0 {
        return Err(SummaryError::Version { found: major });
    }
    let need = HEADER + usize::from(u16::from_le_bytes([a, b])) + CHECKSUM;
    let whole = bytes.get(..need).ok_or(short(need))?;
    let (checked, stored) = whole.split_last_chunk::<CHECKSUM>().ok_or(short(need))?;
    if u32::from_le_bytes(*stored) != CRC.checksum(checked) {
        return Err(SummaryError::Damaged);
    }
    let payload = checked.get(HEADER..).ok_or(short(need))?;
    let (summary, appended) = postcard::take_from_bytes(payload).map_err(|_| SummaryError::Malformed)?;
    if minor <= VERSION.1 && !appended.is_empty() {
        return Err(SummaryError::Malformed);
    }
    Ok(summary)
}

impl fmt::Display for SummaryError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Short { have, need } => write!(f, "{have} bytes, where a summary takes {need}"),
            Self::Foreign => f.write_str("not a summary of a watch: it does not begin with IMUW"),
            Self::Version { found } => {
                write!(f, "summary of format {found}, but this program reads format {}", VERSION.0)
            }
            Self::Damaged => f.write_str("damaged: its checksum is another"),
            Self::Malformed => f.write_str("intact, but not a summary of the version it claims"),
        }
    }
}

impl core::error::Error for SummaryError {}

//! Record to bytes and back, in the caller's buffers.

use core::fmt;

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

use super::payload::serialize;
use super::{CalibrationRecord, Defect, Provenance};

/// Major version of the format, and the newest minor, that this library reads and writes.
pub const VERSION: (u8, u8) = (1, 1);

/// The minor that appended the triads' provenance.
pub(super) const WITH_PROVENANCE: u8 = 1;

const MAGIC: [u8; 4] = *b"IMUC";
const HEADER: usize = MAGIC.len() + 2 + 2;
const CHECKSUM: usize = 4;
/// Without a table: a record is read once a start, and a table costs a kilobyte of flash.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// The longest record of this version, bytes: a buffer of this length always suffices for [`encode`].
///
/// A newer minor may write longer ones, which [`decode`] reads all the same.
pub const MAX_LEN: usize = HEADER + longest::RECORD + CHECKSUM;

// The header holds the length of the payload in 16 bits.
const _: () = assert!(longest::RECORD <= u16::MAX as usize);

/// Longest encoding of each part, in postcard's terms.
mod longest {
    const TAG: usize = 1;
    const F32: usize = 4;
    /// A varint holds 7 bits a byte.
    const U32: usize = 5;
    const U8: usize = 1;
    const fn text(bytes: usize) -> usize {
        1 + bytes
    }
    const TEMPERATURE: usize = F32 + 3 * F32 + 3 * F32;
    const QUALITY: usize = 9 * F32 + 3 * F32 + F32 + (TAG + F32) + U32 + U8 + F32 + F32 + (TAG + F32);
    const TRIAD: usize = 9 * F32 + 3 * F32 + TAG + TAG + text(8) + (TAG + TEMPERATURE) + QUALITY;
    const PROVENANCE: usize = text(32) + U32;
    pub const RECORD: usize = text(32) + text(32) + U32 + 3 * (TAG + TRIAD) + 3 * (TAG + PROVENANCE);
}

/// Why a record was not written.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum EncodeError {
    /// The buffer is shorter than the record; [`MAX_LEN`] always suffices.
    BufferTooSmall {
        /// Bytes given.
        have: usize,
        /// Bytes the record takes.
        need: usize,
    },
    /// The record could not be used if it were read.
    Unusable(Defect),
}

/// Why no record was read.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum DecodeError {
    /// The bytes end before the record does.
    Truncated {
        /// Bytes given.
        have: usize,
        /// Bytes the record takes, as far as is known.
        need: usize,
    },
    /// The bytes do not begin with `IMUC`: no record, or a page that was erased.
    BadMagic,
    /// A format of another major version.
    UnsupportedVersion {
        /// Major version of the record.
        found: u8,
        /// Major version this library reads.
        supported: u8,
    },
    /// The bytes were damaged after they were written.
    BadCrc {
        /// As the record has it.
        stored: u32,
        /// Of the bytes as they are.
        computed: u32,
    },
    /// Intact, but not a record of the version it claims: a faulty writer, or a variant newer than this library.
    Malformed,
    /// Intact, but not fit for use.
    Unusable(Defect),
}

/// Writes a record to the start of `buffer`; gives the bytes written.
///
/// # Errors
///
/// [`EncodeError`]; the buffer's content is then unspecified.
///
/// # Examples
///
/// ```
/// use imucal_core::record::{self, CalibrationRecord, Date, MAX_LEN, SensorIdentity};
///
/// let sensor = SensorIdentity { name: "MTx".parse()?, serial: "00300017".parse()? };
/// let record = CalibrationRecord::empty(sensor, Date::from_unix(1_700_000_000));
/// let mut page = [0xFF; MAX_LEN];
/// record::encode(&record, &mut page)?;
/// assert_eq!(record::decode(&page)?, record);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub fn encode<'b>(record: &CalibrationRecord, buffer: &'b mut [u8]) -> Result<&'b [u8], EncodeError> {
    record.check().map_err(EncodeError::Unusable)?;
    let have = buffer.len();
    // Serialising has no way to fail; were there one, the longest record asks for the largest buffer.
    let room = buffer.get_mut(HEADER..).unwrap_or_default();
    let (minor, payload) = serialize(record, room).unwrap_or((VERSION.1, longest::RECORD));
    let need = HEADER + payload + CHECKSUM;
    let short = EncodeError::BufferTooSmall { have, need };

    let whole = buffer.get_mut(..need).ok_or(short)?;
    let (checked, checksum) = whole.split_last_chunk_mut::<CHECKSUM>().ok_or(short)?;
    let header = checked.first_chunk_mut::<HEADER>().ok_or(short)?;
    let [a, b] = (payload as u16).to_le_bytes();
    let [m, u, c, l] = MAGIC;
    *header = [m, u, c, l, VERSION.0, minor, a, b];
    *checksum = CRC.checksum(checked).to_le_bytes();
    Ok(whole)
}

/// Reads the record at the start of `bytes`; what follows its checksum is ignored.
///
/// # Errors
///
/// [`DecodeError`]. Whatever the bytes, there is no panic and no half-read record.
pub fn decode(bytes: &[u8]) -> Result<CalibrationRecord, DecodeError> {
    let have = bytes.len();
    let truncated = |need| DecodeError::Truncated { have, need };

    let short = truncated(HEADER + CHECKSUM);
    let (header, _) = bytes.split_first_chunk::<HEADER>().ok_or(short)?;
    let [m, u, c, l, major, minor, a, b] = *header;
    if [m, u, c, l] != MAGIC {
        return Err(DecodeError::BadMagic);
    }
    if major != VERSION.0 {
        return Err(DecodeError::UnsupportedVersion { found: major, supported: VERSION.0 });
    }

    let need = HEADER + usize::from(u16::from_le_bytes([a, b])) + CHECKSUM;
    let whole = bytes.get(..need).ok_or(truncated(need))?;
    let (checked, stored) = whole.split_last_chunk::<CHECKSUM>().ok_or(truncated(need))?;
    let (stored, computed) = (u32::from_le_bytes(*stored), CRC.checksum(checked));
    if stored != computed {
        return Err(DecodeError::BadCrc { stored, computed });
    }

    let payload = checked.get(HEADER..).ok_or(truncated(need))?;
    let (mut record, mut appended) =
        postcard::take_from_bytes::<CalibrationRecord>(payload).map_err(|_| DecodeError::Malformed)?;
    if minor >= WITH_PROVENANCE {
        appended = take_provenance(&mut record, appended)?;
    }
    if minor <= VERSION.1 && !appended.is_empty() {
        return Err(DecodeError::Malformed);
    }
    record.check().map_err(DecodeError::Unusable)?;
    Ok(record)
}

/// Reads what minor 1 appended; gives what follows.
#[inline(never)]
fn take_provenance<'a>(record: &mut CalibrationRecord, appended: &'a [u8]) -> Result<&'a [u8], DecodeError> {
    let (provenance, rest) =
        postcard::take_from_bytes::<[Option<Provenance>; 3]>(appended).map_err(|_| DecodeError::Malformed)?;
    record.provenance = provenance;
    Ok(rest)
}

impl fmt::Display for EncodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BufferTooSmall { have, need } => {
                write!(f, "the record takes {need} bytes, the buffer has {have}")
            }
            Self::Unusable(defect) => defect.fmt(f),
        }
    }
}

impl core::error::Error for EncodeError {}

impl fmt::Display for DecodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Truncated { have, need } => {
                write!(f, "cut short: {have} bytes of a record of at least {need}")
            }
            Self::BadMagic => f.write_str("not a calibration record: it does not begin with IMUC"),
            Self::UnsupportedVersion { found, supported } => {
                write!(f, "record format {found}, but this program reads format {supported}")
            }
            Self::BadCrc { stored, computed } => {
                write!(f, "damaged: the checksum is {computed:08x} where the record says {stored:08x}")
            }
            Self::Malformed => f.write_str("intact, but not a record of the version it claims"),
            Self::Unusable(defect) => defect.fmt(f),
        }
    }
}

impl core::error::Error for DecodeError {}

//! Record to bytes and back, in the caller's buffers.

use core::fmt;

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

use serde::Deserialize;

use super::payload::serialize;
use super::{
    CalibrationRecord, Date, Defect, FirstOrder, HigherOrder, Order, Provenance, SensorIdentity, TriadRecord,
};

/// Major version of the format, and the newest minor, that this library reads and writes: those of [`HigherOrder`].
pub const VERSION: (u8, u8) = HigherOrder::VERSION;

/// Major and minor of a record, in the order in which they appended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Version {
    pub(super) major: u8,
    pub(super) minor: u8,
}

impl Version {
    /// The first there was.
    pub(super) const FIRST: Self = Self { major: 1, minor: 0 };
    /// With the provenance of each triad.
    pub(super) const WITH_PROVENANCE: Self = Self { major: 1, minor: 1 };
    /// With span and errors of temperature terms.
    pub(super) const WITH_TEMPERATURE_QUALITY: Self = Self { major: 1, minor: 2 };
    /// With terms that change what is corrected.
    pub(super) const HIGHER_ORDER: Self = Self { major: 2, minor: 0 };

    /// An order knows all that a record of this version holds.
    fn is_known<O: Order>(self) -> bool {
        let newest = Self { major: O::VERSION.0, minor: O::VERSION.1 };
        let of_major = if self.major < newest.major { Self::WITH_TEMPERATURE_QUALITY } else { newest };
        self <= of_major
    }
}

const MAGIC: [u8; 4] = *b"IMUC";
const HEADER: usize = MAGIC.len() + 2 + 2;
const CHECKSUM: usize = 4;
/// Without a table: a record is read once a start, and a table costs a kilobyte of flash.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// The longest record of first order, bytes: a buffer of this length always suffices for [`encode`] of one.
pub const MAX_LEN: usize = FirstOrder::MAX_LEN;

// The header holds the length of the payload in 16 bits.
const _: () = assert!(HigherOrder::MAX_LEN <= u16::MAX as usize);

/// Longest encoding of each part, in postcard's terms, and of whole records.
pub(super) mod longest {
    use super::{CHECKSUM, HEADER};

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
    const RECORD: usize = text(32) + text(32) + U32 + 3 * (TAG + TRIAD) + 3 * (TAG + PROVENANCE);
    const WARMTH: usize = 2 * F32 + 6 * F32;
    const CURVATURE: usize = 2 * 6 * F32;
    const NONLINEARITY: usize = F32 + 2 * 15 * F32;
    pub const FIRST_ORDER: usize = HEADER + RECORD + CHECKSUM;
    pub const HIGHER_ORDER: usize =
        FIRST_ORDER + 3 * (TAG + WARMTH) + 3 * (TAG + CURVATURE) + 3 * (TAG + NONLINEARITY);
}

/// Why a record was not written.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum EncodeError {
    /// The buffer is shorter than the record; [`Order::MAX_LEN`] always suffices.
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
        /// Newest major version that was asked for: that of the [`Order`].
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

/// Writes a record to the start of `buffer`, in the lowest version that holds it; gives the bytes written.
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
pub fn encode<'b, O: Order>(
    record: &CalibrationRecord<O>,
    buffer: &'b mut [u8],
) -> Result<&'b [u8], EncodeError> {
    record.check().map_err(EncodeError::Unusable)?;
    let have = buffer.len();
    // Serialising has no way to fail; were there one, the longest record asks for the largest buffer.
    let room = buffer.get_mut(HEADER..).unwrap_or_default();
    let longest = (Version::FIRST, O::MAX_LEN - HEADER - CHECKSUM);
    let (Version { major, minor }, payload) = serialize(record, room).unwrap_or(longest);
    let need = HEADER + payload + CHECKSUM;
    let short = EncodeError::BufferTooSmall { have, need };

    let whole = buffer.get_mut(..need).ok_or(short)?;
    let (checked, checksum) = whole.split_last_chunk_mut::<CHECKSUM>().ok_or(short)?;
    let header = checked.first_chunk_mut::<HEADER>().ok_or(short)?;
    let [a, b] = (payload as u16).to_le_bytes();
    let [m, u, c, l] = MAGIC;
    *header = [m, u, c, l, major, minor, a, b];
    *checksum = CRC.checksum(checked).to_le_bytes();
    Ok(whole)
}

/// Reads the record of first order at the start of `bytes`; what follows its checksum is ignored.
///
/// # Errors
///
/// [`DecodeError`]; for a record of higher order [`DecodeError::UnsupportedVersion`]. Whatever the bytes, there is no
/// panic and no half-read record.
#[inline]
pub fn decode(bytes: &[u8]) -> Result<CalibrationRecord, DecodeError> {
    decode_as::<FirstOrder>(bytes)
}

/// Reads the record at the start of `bytes`, of that order or lower; what follows its checksum is ignored.
///
/// # Errors
///
/// As [`decode`].
///
/// # Examples
///
/// ```
/// use imucal_core::record::{self, HigherOrder, Order};
/// # let record = record::CalibrationRecord::<HigherOrder>::empty(Default::default(), record::Date::from_days(0));
/// let mut page = [0xFF; HigherOrder::MAX_LEN];
/// record::encode(&record, &mut page)?;
/// assert_eq!(record::decode_as::<HigherOrder>(&page)?, record);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub fn decode_as<O: Order>(bytes: &[u8]) -> Result<CalibrationRecord<O>, DecodeError> {
    let mut record = CalibrationRecord::empty(SensorIdentity::default(), Date::from_days(0));
    decode_into(bytes, &mut record)?;
    Ok(record)
}

/// The same into a record that is there: a stack holds no copy of it, nor of more than one triad. After an error what it holds
/// is not to be used.
///
/// # Errors
///
/// As [`decode`].
#[inline(never)]
pub fn decode_into<O: Order>(bytes: &[u8], record: &mut CalibrationRecord<O>) -> Result<(), DecodeError> {
    let have = bytes.len();
    let truncated = |need| DecodeError::Truncated { have, need };

    let short = truncated(HEADER + CHECKSUM);
    let (header, _) = bytes.split_first_chunk::<HEADER>().ok_or(short)?;
    let [m, u, c, l, major, minor, a, b] = *header;
    if [m, u, c, l] != MAGIC {
        return Err(DecodeError::BadMagic);
    }
    if !(1..=O::VERSION.0).contains(&major) {
        return Err(DecodeError::UnsupportedVersion { found: major, supported: O::VERSION.0 });
    }
    let version = Version { major, minor };

    let need = HEADER + usize::from(u16::from_le_bytes([a, b])) + CHECKSUM;
    let whole = bytes.get(..need).ok_or(truncated(need))?;
    let (checked, stored) = whole.split_last_chunk::<CHECKSUM>().ok_or(truncated(need))?;
    let (stored, computed) = (u32::from_le_bytes(*stored), CRC.checksum(checked));
    if stored != computed {
        return Err(DecodeError::BadCrc { stored, computed });
    }

    let payload = checked.get(HEADER..).ok_or(truncated(need))?;
    let mut appended = take_unit(record, payload)?;
    // Part by part, as the record's own implementation would.
    for triad in [&mut record.acc, &mut record.gyr, &mut record.mag] {
        appended = take_triad(triad, appended)?;
    }
    record.provenance = [const { None }; 3];
    if version >= Version::WITH_PROVENANCE {
        appended = take_provenance(&mut record.provenance, appended)?;
    }
    appended = O::read(record, version, appended)?;
    if version.is_known::<O>() && !appended.is_empty() {
        return Err(DecodeError::Malformed);
    }
    record.check().map_err(DecodeError::Unusable)
}

/// Reads whose record it is, and of which day; gives what follows.
#[inline(never)]
fn take_unit<'a, O>(record: &mut CalibrationRecord<O>, bytes: &'a [u8]) -> Result<&'a [u8], DecodeError> {
    let (sensor, rest) = taken(bytes)?;
    record.sensor = sensor;
    let (date, rest) = taken(rest)?;
    record.date = date;
    Ok(rest)
}

/// Reads what is of the first order in a triad; gives what follows.
#[inline(never)]
fn take_triad<'a, O: Order>(
    triad: &mut Option<TriadRecord<O>>,
    bytes: &'a [u8],
) -> Result<&'a [u8], DecodeError> {
    let (found, rest) = taken(bytes)?;
    *triad = found;
    Ok(rest)
}

/// Reads what minor 1 appended; gives what follows.
#[inline(never)]
fn take_provenance<'a>(
    provenance: &mut [Option<Provenance>; 3],
    appended: &'a [u8],
) -> Result<&'a [u8], DecodeError> {
    let (all, rest) = taken(appended)?;
    *provenance = all;
    Ok(rest)
}

/// Reads a value from the start of `bytes`; gives what follows as well.
pub(super) fn taken<'a, V: Deserialize<'a>>(bytes: &'a [u8]) -> Result<(V, &'a [u8]), DecodeError> {
    postcard::take_from_bytes(bytes).map_err(|_| DecodeError::Malformed)
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

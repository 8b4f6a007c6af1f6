//! The payload, written by postcard into an end of our own.
//!
//! It goes on counting where the room ends, so that one pass writes, and gives what a buffer too small would need.
//! Its functions stay out of line: inlined at each of a record's hundred figures they cost half a kilobyte of flash.

use postcard::{Result, ser_flavors::Flavor, serialize_with_flavor};
use serde::Serialize;

use super::{CalibrationRecord, Order, codec::Version};

/// Writes as much of the payload as fits into `room`; gives the version that it takes and the length of all of it.
pub(super) fn serialize<O: Order>(
    record: &CalibrationRecord<O>,
    room: &mut [u8],
) -> Result<(Version, usize)> {
    let mut out = Counting { room, length: 0 };
    out.write(record)?;
    let own = record.provenance.iter().any(Option::is_some);
    let older = if own { Version::WITH_PROVENANCE } else { Version::FIRST };
    let version = O::version(record).unwrap_or(older);
    if version >= Version::WITH_PROVENANCE {
        out.write(&record.provenance)?;
    }
    O::write(record, version, &mut out)?;
    Ok((version, out.length))
}

/// Where a payload is written to.
#[derive(Debug)]
pub struct Counting<'b> {
    room: &'b mut [u8],
    length: usize,
}

impl Counting<'_> {
    /// Writes one more value.
    pub(super) fn write(&mut self, value: &impl Serialize) -> Result<()> {
        serialize_with_flavor(value, Appending(self))
    }
}

/// Postcard takes its end by value.
struct Appending<'a, 'b>(&'a mut Counting<'b>);

impl Flavor for Appending<'_, '_> {
    type Output = ();

    #[inline(never)]
    fn try_push(&mut self, byte: u8) -> Result<()> {
        self.try_extend(&[byte])
    }

    #[inline(never)]
    fn try_extend(&mut self, bytes: &[u8]) -> Result<()> {
        for (slot, byte) in self.0.room.iter_mut().skip(self.0.length).zip(bytes) {
            *slot = *byte;
        }
        self.0.length += bytes.len();
        Ok(())
    }

    fn finalize(self) -> Result<()> {
        Ok(())
    }
}

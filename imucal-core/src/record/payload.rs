//! The payload, written by postcard into an end of our own.
//!
//! It goes on counting where the room ends, so that one pass writes, and gives what a buffer too small would need.
//! Its functions stay out of line: inlined at each of a record's hundred figures they cost half a kilobyte of flash.

use postcard::{Result, ser_flavors::Flavor, serialize_with_flavor};

use super::{CalibrationRecord, codec::WITH_PROVENANCE};

/// Writes as much of the payload as fits into `room`; gives the minor version that it takes and the length of all of
/// it.
pub(super) fn serialize(record: &CalibrationRecord, room: &mut [u8]) -> Result<(u8, usize)> {
    let first = serialize_with_flavor(record, Counting { room: &mut *room, length: 0 })?;
    if record.provenance.iter().all(Option::is_none) {
        return Ok((0, first));
    }
    let rest = room.get_mut(first..).unwrap_or_default();
    Ok((
        WITH_PROVENANCE,
        first + serialize_with_flavor(&record.provenance, Counting { room: rest, length: 0 })?,
    ))
}

struct Counting<'b> {
    room: &'b mut [u8],
    length: usize,
}

impl Flavor for Counting<'_> {
    type Output = usize;

    #[inline(never)]
    fn try_push(&mut self, byte: u8) -> Result<()> {
        self.try_extend(&[byte])
    }

    #[inline(never)]
    fn try_extend(&mut self, bytes: &[u8]) -> Result<()> {
        for (slot, byte) in self.room.iter_mut().skip(self.length).zip(bytes) {
            *slot = *byte;
        }
        self.length += bytes.len();
        Ok(())
    }

    fn finalize(self) -> Result<usize> {
        Ok(self.length)
    }
}

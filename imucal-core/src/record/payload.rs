//! The payload, written by postcard into an end of our own.
//!
//! It goes on counting where the room ends, so that one pass writes, and tells what a buffer too small would need.
//! Its functions stay out of line: inlined at each of a record's hundred figures they cost half a kilobyte of flash.

use postcard::{Result, ser_flavors::Flavor, serialize_with_flavor};

use super::CalibrationRecord;

/// Writes as much of the payload as fits into `room`; gives the length of all of it.
pub(super) fn serialize(record: &CalibrationRecord, room: &mut [u8]) -> Result<usize> {
    serialize_with_flavor(record, Counting { room, length: 0 })
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

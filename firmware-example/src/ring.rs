//! Bytes that a DMA controller writes round and round, read from behind.
//!
//! The controller puts byte n of the line into place n mod N by itself, and a timer counts the bytes. While the core
//! fits, or stands still for the erase of a page, nothing is lost, as long as it reads N bytes behind at the most.

/// Bytes on their way from the counter to the memory, and room between who writes and who reads.
const MARGIN: u32 = 16;

/// How far a ring of N bytes has been read.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ring<const N: usize> {
    /// Bytes read.
    read: u32,
    /// Bytes counted at the last look.
    seen: u32,
}

impl<const N: usize> Ring<N> {
    /// Nothing was read.
    pub const fn new() -> Self {
        // Otherwise byte n would be elsewhere once the counter has come round.
        assert!(N.is_power_of_two() && N as u32 > MARGIN);
        Self { read: 0, seen: 0 }
    }

    /// Place of the next byte, after so many came over the line. A byte that has come since the last look is left to the
    /// next: it was counted, but may not be in memory. What was written over is passed by with all before it; its frames
    /// lack bytes, and their checksums say so.
    pub fn next(&mut self, counted: u32) -> Option<usize> {
        let settled = core::mem::replace(&mut self.seen, counted);
        if counted.wrapping_sub(self.read) > N as u32 - MARGIN {
            self.read = counted;
            return None;
        }
        if self.read == settled {
            return None;
        }
        let place = self.read as usize % N;
        self.read = self.read.wrapping_add(1);
        Some(place)
    }
}

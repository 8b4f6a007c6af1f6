//! A record on its way into flash, piece by piece.

use imucal_core::record;

use super::{CHECKSUM, CRC, HEADER, PIECE};

/// A record on its way into flash. Its slot is made up as it is written: what it takes of memory is the record's.
#[derive(Clone, Debug)]
pub struct Writing {
    bytes: [u8; record::MAX_LEN],
    length: usize,
    checksum: [u8; CHECKSUM],
    pub(super) sequence: u32,
    /// Where its slot starts, bytes.
    pub(super) at: usize,
    pub(super) phase: Phase,
    /// Slots that did not take the record.
    pub(super) failed: usize,
}

/// What is done next.
#[derive(Clone, Copy, Debug)]
pub(super) enum Phase {
    /// Nothing: it is stored already.
    Stored,
    /// Is a block blank that never held a record?
    Fresh,
    /// Is the slot blank?
    Look,
    /// Erase from this page of the block on.
    Erase(usize),
    /// Write the block's head.
    Head,
    /// Write from this piece on.
    Write(usize),
    /// Does the slot hold what was written?
    Verify,
    /// Write the seal.
    Seal,
    /// Does it stand?
    Count,
}

impl Writing {
    /// `None` for bytes that are longer than a record.
    pub(super) fn new(sequence: u32, record: &[u8]) -> Option<Self> {
        let mut bytes = [0xFF; record::MAX_LEN];
        bytes.get_mut(..record.len())?.copy_from_slice(record);
        let mut writing = Self {
            bytes,
            length: record.len(),
            checksum: [0; CHECKSUM],
            sequence,
            at: 0,
            phase: Phase::Look,
            failed: 0,
        };
        let mut digest = CRC.digest();
        digest.update(&writing.header());
        digest.update(record);
        writing.checksum = digest.finalize().to_le_bytes();
        Some(writing)
    }

    /// The record's bytes.
    pub fn record(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }

    /// Bytes of the slot that are written.
    pub(super) fn length(&self) -> usize {
        HEADER + self.length + CHECKSUM
    }

    fn header(&self) -> [u8; HEADER] {
        let ([a, b, c, d], [l, h]) = (self.sequence.to_le_bytes(), (self.length as u16).to_le_bytes());
        [a, b, c, d, l, h, !l, !h]
    }

    /// A piece of the slot; ones behind the checksum.
    pub(super) fn piece(&self, index: usize) -> [u8; PIECE] {
        let mut piece = [0xFF; PIECE];
        let header = self.header();
        let all = header.iter().chain(self.record()).chain(&self.checksum);
        for (slot, byte) in piece.iter_mut().zip(all.skip(index * PIECE)) {
            *slot = *byte;
        }
        piece
    }
}

/// The last piece of a slot that is whole.
pub(super) fn seal(sequence: u32) -> [u8; PIECE] {
    let mut piece = [0xFF; PIECE];
    let both = sequence.to_le_bytes().into_iter().chain((!sequence).to_le_bytes());
    for (slot, byte) in piece.iter_mut().zip(both) {
        *slot = byte;
    }
    piece
}

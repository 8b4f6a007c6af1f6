//! What a slot of flash holds: a whole record, one that was whole, or nothing.

use crc::{Digest, NoTable};
use embedded_storage::nor_flash::NorFlash;

use super::{
    CHECKSUM, CRC, HEADER, PIECE, Slots, StorageError,
    layout::{SEAL, Slot},
    of_flash,
};

/// What a slot holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Found {
    Nothing,
    /// Sequence number and length of a whole record.
    Whole(u32, usize),
    /// A record that was whole once, or seems so.
    Damaged(u32),
}

impl<F: NorFlash> Slots<F> {
    /// What a slot holds.
    pub(super) fn examine(&mut self, at: usize, slot: Slot) -> Result<Found, StorageError> {
        let mut piece = [0; PIECE];
        self.flash.read(at as u32, &mut piece).map_err(of_flash)?;
        let header = header(&piece, slot);
        if let Some((sequence, length)) = header
            && self.is_whole(at, HEADER + length)?
        {
            return Ok(Found::Whole(sequence, length));
        }
        let claimed = header.map(|(sequence, _)| sequence);
        let once = if slot.sealed {
            let (sealed, complement) = self.seal(at, slot)?;
            // An erase that was cut has turned zeros into ones: it has added bits to a number, and taken some from one that is kept as
            // its complement. Where the two agree, neither has changed. A seal that is blank was never written.
            (sealed == complement || claimed == Some(complement)).then_some(complement)
        } else {
            claimed
        };
        Ok(once.map_or(Found::Nothing, Found::Damaged))
    }

    /// Sequence number in the seal of a slot, and that of which its complement lies there; equal where the seal is whole.
    fn seal(&mut self, at: usize, slot: Slot) -> Result<(u32, u32), StorageError> {
        let mut piece = [0; PIECE];
        self.flash.read((at + slot.size - SEAL) as u32, &mut piece).map_err(of_flash)?;
        let [a, b, c, d, na, nb, nc, nd, ..] = piece;
        Ok((u32::from_le_bytes([a, b, c, d]), !u32::from_le_bytes([na, nb, nc, nd])))
    }

    /// Sequence number in the seal of a slot, where the seal is whole.
    pub(super) fn sealed(&mut self, at: usize, slot: Slot) -> Result<Option<u32>, StorageError> {
        let (sealed, complement) = self.seal(at, slot)?;
        Ok((sealed == complement).then_some(sealed))
    }

    /// The CRC behind the first `end` bytes of a slot is theirs.
    fn is_whole(&mut self, at: usize, end: usize) -> Result<bool, StorageError> {
        let (mut digest, mut stored) = (CRC.digest(), [0; CHECKSUM]);
        let mut piece = [0; PIECE];
        for from in (0..end + CHECKSUM).step_by(PIECE) {
            self.flash.read((at + from) as u32, &mut piece).map_err(of_flash)?;
            take(&piece, from, end, &mut digest, &mut stored);
        }
        Ok(digest.finalize() == u32::from_le_bytes(stored))
    }
}

/// Sequence number and length at the start of a slot.
fn header(piece: &[u8; PIECE], slot: Slot) -> Option<(u32, usize)> {
    let [a, b, c, d, l, h, nl, nh] = *piece.first_chunk::<HEADER>()?;
    let length = u16::from_le_bytes([l, h]);
    let intact = u16::from_le_bytes([nl, nh]) == !length && usize::from(length) <= slot.room();
    intact.then_some((u32::from_le_bytes([a, b, c, d]), length.into()))
}

/// Of a piece at `at`: what lies before `end` goes into the digest, the four bytes after it are the stored one.
fn take(
    piece: &[u8],
    at: usize,
    end: usize,
    digest: &mut Digest<'_, u32, NoTable>,
    stored: &mut [u8; CHECKSUM],
) {
    let (body, rest) = piece.split_at_checked(end.saturating_sub(at)).unwrap_or((piece, &[]));
    digest.update(body);
    let from = (at + body.len()).saturating_sub(end);
    for (slot, byte) in stored.iter_mut().skip(from).zip(rest) {
        *slot = *byte;
    }
}

//! A record in NOR flash that outlives power cuts: slots in a ring of erase blocks, the last whole one counts.
//!
//! ```text
//! 0          4        6         8            8+n      12+n
//! ├──────────┼────────┼─────────┼────────────┼────────┤
//! │ sequence │ n, u16 │ !n, u16 │ bytes, n B │ CRC-32 │  ones to the end of the slot
//! └──────────┴────────┴─────────┴────────────┴────────┘
//! ```
//!
//! * A slot is written from its start to its end, into erased flash, and the CRC over all before it comes last: a
//!   slot is whole, or it is none. It is read back before it counts.
//! * The next slot of the same block is taken while one is blank; then the next block is erased. The newest slot never
//!   lies in the block that is erased, so a cut anywhere leaves the old record or the new one.
//! * Blocks are used in turn: the erases of any two differ by one at the most, cuts apart.
//! * [`Slots::step`] does one flash operation, so that samples are corrected in between. The longest is the erase of a
//!   page, during which many controllers halt.
//!
//! Slots of our own rather than `sequential-storage` 8: that keeps panic paths, which the images' gate refuses, and
//! takes 10 KiB of flash as a map of one key, where this takes two. Wear is the same ring of pages.
//!
//! Not covered: bits that read differently each time after a cut. A slot whose last word was cut is taken or not by
//! what the next start reads; whoever needs more writes a second copy.

use crc::{CRC_32_ISO_HDLC, Crc, Digest, NoTable};
use embedded_storage::nor_flash::{NorFlash, NorFlashError, NorFlashErrorKind};
use imucal_core::record;

/// Flash is read and written in pieces of this size, bytes; a multiple of every write size.
const PIECE: usize = 64;
const HEADER: usize = 8;
const CHECKSUM: usize = 4;
/// A slot holds the longest record, bytes.
pub const SLOT: usize = (HEADER + record::MAX_LEN + CHECKSUM).next_multiple_of(PIECE);

const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Why flash was not read or written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StorageError {
    /// The flash's own error.
    Flash(NorFlashErrorKind),
    /// The region has no two blocks, or its write size does not divide 64.
    Unsuited,
    /// Longer than [`record::MAX_LEN`].
    TooLong,
    /// No block took the record as it was written.
    Worn,
}

/// The newest whole slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Newest {
    /// Number of the record since the flash was empty, from 1 on.
    pub sequence: u32,
    /// Its length, bytes.
    pub length: usize,
    /// Index of the slot.
    slot: usize,
}

/// Slots in a region of flash, all of which is theirs.
#[derive(Debug)]
pub struct Slots<F> {
    flash: F,
    newest: Option<Newest>,
}

/// A record on its way into flash.
#[derive(Clone, Debug)]
pub struct Writing {
    image: [u8; SLOT],
    sequence: u32,
    length: usize,
    slot: usize,
    phase: Phase,
    /// Slots that did not take the record.
    failed: usize,
}

#[derive(Clone, Copy, Debug)]
enum Phase {
    /// Is the slot blank?
    Look,
    /// Erase from this page of the block on.
    Erase(usize),
    /// Write from this piece on.
    Write(usize),
    /// Does the slot hold what was written?
    Verify,
}

impl<F: NorFlash> Slots<F> {
    /// Bytes of a block: whole pages, with room for a slot.
    const BLOCK: usize = SLOT.next_multiple_of(F::ERASE_SIZE);
    /// Slots of a block.
    const PER_BLOCK: usize = Self::BLOCK / SLOT;

    /// Looks for the newest whole slot.
    ///
    /// # Errors
    ///
    /// [`StorageError::Unsuited`], and the flash's.
    pub fn open(flash: F) -> Result<Self, StorageError> {
        let mut slots = Self { flash, newest: None };
        if slots.blocks() < 2 || F::WRITE_SIZE == 0 || !PIECE.is_multiple_of(F::WRITE_SIZE) {
            return Err(StorageError::Unsuited);
        }
        for slot in 0..slots.blocks() * Self::PER_BLOCK {
            if let Some(found) = slots.whole(slot)?
                && slots.newest.is_none_or(|newest| found.sequence > newest.sequence)
            {
                slots.newest = Some(found);
            }
        }
        Ok(slots)
    }

    /// The newest whole slot; `None` where nothing was ever stored.
    pub fn newest(&self) -> Option<Newest> {
        self.newest
    }

    /// Gives the flash back.
    pub fn close(self) -> F {
        self.flash
    }

    /// The stored bytes, into a buffer; empty where nothing is stored.
    ///
    /// # Errors
    ///
    /// The flash's.
    pub fn read<'b>(&mut self, buffer: &'b mut [u8; SLOT]) -> Result<&'b [u8], StorageError> {
        let Some(newest) = self.newest else { return Ok(&[]) };
        let start = Self::address(newest.slot);
        for (index, piece) in buffer.chunks_exact_mut(PIECE).enumerate() {
            self.flash.read((start + index * PIECE) as u32, piece).map_err(of_flash)?;
        }
        Ok(buffer.get(HEADER..HEADER + newest.length).unwrap_or_default())
    }

    /// Begins to store bytes; nothing is done before the first [`step`](Self::step).
    ///
    /// # Errors
    ///
    /// [`StorageError::TooLong`].
    pub fn begin(&self, bytes: &[u8]) -> Result<Writing, StorageError> {
        let sequence = self.newest.map_or(1, |newest| newest.sequence.saturating_add(1));
        let image = image(sequence, bytes).ok_or(StorageError::TooLong)?;
        let next = self.newest.map(|newest| newest.slot + 1).filter(|slot| slot % Self::PER_BLOCK != 0);
        let (slot, phase) = match next {
            Some(slot) => (slot, Phase::Look),
            None => (self.next_block(self.newest.map(|newest| newest.slot)), Phase::Erase(0)),
        };
        Ok(Writing { image, sequence, length: bytes.len(), slot, phase, failed: 0 })
    }

    /// One flash operation; the record's sequence number, once it is whole.
    ///
    /// # Errors
    ///
    /// Those of the flash, and [`StorageError::Worn`]. The old record is still there.
    pub fn step(&mut self, writing: &mut Writing) -> Result<Option<u32>, StorageError> {
        let start = Self::address(writing.slot);
        writing.phase = match writing.phase {
            Phase::Look if self.is_blank(start)? => Phase::Write(0),
            Phase::Look => self.pass_over(writing),
            Phase::Erase(page) => {
                let from = start + page * F::ERASE_SIZE;
                self.flash.erase(from as u32, (from + F::ERASE_SIZE) as u32).map_err(of_flash)?;
                let next = page + 1;
                if next * F::ERASE_SIZE < Self::BLOCK { Phase::Erase(next) } else { Phase::Write(0) }
            }
            Phase::Write(piece) => match writing.image.chunks_exact(PIECE).nth(piece) {
                Some(bytes) if piece * PIECE < HEADER + writing.length + CHECKSUM => {
                    self.flash.write((start + piece * PIECE) as u32, bytes).map_err(of_flash)?;
                    Phase::Write(piece + 1)
                }
                _ => Phase::Verify,
            },
            Phase::Verify => {
                let found = self.whole(writing.slot)?;
                if found.is_some_and(|found| found.sequence == writing.sequence) {
                    self.newest = found;
                    return Ok(Some(writing.sequence));
                }
                writing.failed += 1;
                if writing.failed > self.blocks() {
                    return Err(StorageError::Worn);
                }
                self.pass_over(writing)
            }
        };
        Ok(None)
    }

    /// On to the next slot that may be written.
    fn pass_over(&self, writing: &mut Writing) -> Phase {
        writing.slot += 1;
        if writing.slot.is_multiple_of(Self::PER_BLOCK) {
            writing.slot = self.next_block(Some(writing.slot - 1));
            Phase::Erase(0)
        } else {
            Phase::Look
        }
    }

    /// First slot of the block after that of a slot; never that of the newest.
    fn next_block(&self, slot: Option<usize>) -> usize {
        let after = |slot: usize| (slot / Self::PER_BLOCK + 1) % self.blocks().max(1);
        let newest = self.newest.map(|newest| newest.slot / Self::PER_BLOCK);
        let next = slot.map_or(0, after);
        let block = if newest == Some(next) { after(next * Self::PER_BLOCK) } else { next };
        block * Self::PER_BLOCK
    }

    fn blocks(&self) -> usize {
        self.flash.capacity() / Self::BLOCK
    }

    fn address(slot: usize) -> usize {
        slot / Self::PER_BLOCK * Self::BLOCK + slot % Self::PER_BLOCK * SLOT
    }

    fn is_blank(&mut self, start: usize) -> Result<bool, StorageError> {
        let mut piece = [0; PIECE];
        for index in 0..SLOT / PIECE {
            self.flash.read((start + index * PIECE) as u32, &mut piece).map_err(of_flash)?;
            if piece.iter().any(|byte| *byte != 0xFF) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// What a slot holds, if it is whole.
    fn whole(&mut self, slot: usize) -> Result<Option<Newest>, StorageError> {
        let start = Self::address(slot);
        let mut piece = [0; PIECE];
        self.flash.read(start as u32, &mut piece).map_err(of_flash)?;
        let Some((sequence, length)) = header(&piece) else { return Ok(None) };
        let mut digest = CRC.digest();
        let mut stored = [0; CHECKSUM];
        let end = HEADER + length;
        for index in 0..SLOT / PIECE {
            if index > 0 {
                self.flash.read((start + index * PIECE) as u32, &mut piece).map_err(of_flash)?;
            }
            take(&piece, index * PIECE, end, &mut digest, &mut stored);
        }
        let found = Newest { sequence, length, slot };
        Ok((digest.finalize() == u32::from_le_bytes(stored)).then_some(found))
    }
}

/// Sequence number and length at the start of a slot.
fn header(piece: &[u8; PIECE]) -> Option<(u32, usize)> {
    let [a, b, c, d, l, h, nl, nh] = *piece.first_chunk::<HEADER>()?;
    let length = u16::from_le_bytes([l, h]);
    let intact = u16::from_le_bytes([nl, nh]) == !length && usize::from(length) <= record::MAX_LEN;
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

fn image(sequence: u32, bytes: &[u8]) -> Option<[u8; SLOT]> {
    if bytes.len() > record::MAX_LEN {
        return None;
    }
    let mut image = [0xFF; SLOT];
    let length = bytes.len() as u16;
    let ([a, b, c, d], [l, h], [nl, nh]) =
        (sequence.to_le_bytes(), length.to_le_bytes(), (!length).to_le_bytes());
    *image.first_chunk_mut::<HEADER>()? = [a, b, c, d, l, h, nl, nh];
    let end = HEADER + bytes.len();
    image.get_mut(HEADER..end)?.copy_from_slice(bytes);
    let checksum = CRC.checksum(image.get(..end)?).to_le_bytes();
    image.get_mut(end..end + CHECKSUM)?.copy_from_slice(&checksum);
    Some(image)
}

fn of_flash(error: impl NorFlashError) -> StorageError {
    StorageError::Flash(error.kind())
}

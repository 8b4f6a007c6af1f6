//! A record in NOR flash that outlives power cuts: slots in a ring of erase blocks, the last whole one counts.
//!
//! ```text
//! 0          4        6         8            8+n      12+n            slot − 64
//! ├──────────┼────────┼─────────┼────────────┼────────┼┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┼──────────┬───────────┤
//! │ sequence │ n, u16 │ !n, u16 │ bytes, n B │ CRC-32 │ ones          │ sequence │ !sequence │  ones
//! └──────────┴────────┴─────────┴────────────┴────────┴┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┴──────────┴───────────┘
//!                                                                       seal
//! ```
//!
//! * A slot is written from its start to its CRC, into erased flash: it is whole, or it is none. It is read back, and
//!   then sealed.
//! * A sealed slot that is not whole has lost bits since: [`Slots::lost`] says so where the record before it counts. One
//!   without a seal was cut off while it was written, and nobody was informed that it is stored.
//! * The next slot of the same block is taken while one is blank; then the next block is erased. The newest slot never
//!   lies in the block that is erased, so a cut anywhere leaves the old record or the new one.
//! * Blocks are used in turn: the erases of any two differ by one at the most, cuts apart.
//! * Nothing is written but a record: not at the start, not where flash is blank, and not a record that is stored
//!   already. A region of an older layout ([`layout`]) is read as it is; the next record goes into the next block in the
//!   layout of this firmware, so that a cut leaves the old record in the old layout, or the new one in the new.
//! * [`Slots::step`] does one flash operation, so that samples are corrected in between. The longest is the erase of a
//!   page, during which many controllers halt.
//!
//! Slots of our own rather than `sequential-storage` 8: that keeps panic paths, which the images' gate refuses, and
//! takes 10 KiB of flash as a map of one key, where this takes two. Wear is the same ring of pages.
//!
//! Not covered: bits that read differently each time after a cut. A slot whose last word was cut is taken or not by
//! what the next start reads; whoever needs more writes a second copy. Nor damage to both ends of a slot at once, which
//! looks as if it had never been sealed.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use embedded_storage::nor_flash::{NorFlash, NorFlashError, NorFlashErrorKind};
use imucal_core::record;

mod examination;
pub mod layout;
mod writing;

use examination::Found;
use layout::{Head, Row, SEAL, Slot};
pub use writing::Writing;
use writing::{Phase, seal};

/// Flash is read and written in pieces of this size, bytes; a multiple of every write size.
const PIECE: usize = 64;
const HEADER: usize = 8;
const CHECKSUM: usize = 4;

const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Why flash was not read or written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StorageError {
    /// The flash's own error.
    Flash(NorFlashErrorKind),
    /// The region has no two blocks, or its write size does not divide 64.
    Unsuited,
    /// Longer than [`record::MAX_LEN`]: no record of this firmware's.
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
    /// Where its slot starts, bytes, and ends.
    at: usize,
    end: usize,
    /// Where the next record may go, in the same block.
    next: Option<usize>,
}

/// Slots in a region of flash, all of which is theirs.
#[derive(Debug)]
pub struct Slots<F> {
    flash: F,
    newest: Option<Newest>,
    /// The whole slot before it.
    previous: Option<Newest>,
    lost: Option<u32>,
    newer: Option<u32>,
}

impl<F: NorFlash> Slots<F> {
    /// Bytes of a block: whole pages, with room for a slot.
    const BLOCK: usize = Row::block(F::ERASE_SIZE);
    /// The slots of a block.
    const ROW: Row = Row::written(F::ERASE_SIZE);

    /// Looks for the newest whole slot, of any layout.
    ///
    /// # Errors
    ///
    /// [`StorageError::Unsuited`], and the flash's.
    pub fn open(flash: F) -> Result<Self, StorageError> {
        let mut slots = Self { flash, newest: None, previous: None, lost: None, newer: None };
        if slots.blocks() < 2 || F::WRITE_SIZE == 0 || !PIECE.is_multiple_of(F::WRITE_SIZE) {
            return Err(StorageError::Unsuited);
        }
        for block in 0..slots.blocks() {
            match slots.head(block)? {
                None => slots.look(block * Self::BLOCK, Self::ROW, false)?,
                Some(head) => match head.row(Self::BLOCK) {
                    Some(row) => slots.look(block * Self::BLOCK, row, row == Self::ROW)?,
                    None => slots.newer = slots.newer.max(Some(head.since)),
                },
            }
        }
        slots.look_for_first()?;
        let latest = slots.newest.map(|newest| newest.sequence);
        slots.lost = slots.lost.filter(|lost| Some(*lost) > latest);
        slots.newer = slots.newer.filter(|since| Some(*since) > latest);
        Ok(slots)
    }

    /// The newest whole slot; `None` where there is none.
    pub fn newest(&self) -> Option<Newest> {
        self.newest
    }

    /// Number of the record that was stored last, where it has lost bits since; [`newest`](Self::newest) is one before
    /// it, or none. In layout 1 it may have been cut off while it was written.
    pub fn lost(&self) -> Option<u32> {
        self.lost
    }

    /// A record of newer firmware lies here, in a layout that this one cannot read.
    pub fn is_newer(&self) -> bool {
        self.newer.is_some()
    }

    /// Gives the flash back.
    pub fn close(self) -> F {
        self.flash
    }

    /// The stored bytes, into a buffer; empty where nothing is stored.
    ///
    /// # Errors
    ///
    /// [`StorageError::TooLong`] for a record of newer firmware, and the flash's.
    pub fn read<'b>(&mut self, buffer: &'b mut [u8; record::MAX_LEN]) -> Result<&'b [u8], StorageError> {
        self.read_slot(self.newest, buffer)
    }

    /// The bytes stored before those, into a buffer; empty where nothing was. Where a block has several slots or there are
    /// three blocks, a cut while the next record is stored leaves them too.
    ///
    /// # Errors
    ///
    /// As of [`read`](Self::read).
    pub fn read_previous<'b>(
        &mut self,
        buffer: &'b mut [u8; record::MAX_LEN],
    ) -> Result<&'b [u8], StorageError> {
        self.read_slot(self.previous, buffer)
    }

    fn read_slot<'b>(
        &mut self,
        slot: Option<Newest>,
        buffer: &'b mut [u8; record::MAX_LEN],
    ) -> Result<&'b [u8], StorageError> {
        let Some(slot) = slot else { return Ok(&[]) };
        let bytes = buffer.get_mut(..slot.length).ok_or(StorageError::TooLong)?;
        let mut piece = [0; PIECE];
        for from in (0..HEADER + slot.length).step_by(PIECE) {
            self.flash.read((slot.at + from) as u32, &mut piece).map_err(of_flash)?;
            // Of the first piece the header is left out.
            let (own, to) = (piece.get(HEADER.saturating_sub(from)..), from.saturating_sub(HEADER));
            for (slot, byte) in bytes.iter_mut().skip(to).zip(own.unwrap_or_default()) {
                *slot = *byte;
            }
        }
        Ok(bytes)
    }

    /// Begins to store bytes; nothing is written before the first [`step`](Self::step), and nothing at all where they
    /// are stored already.
    ///
    /// # Errors
    ///
    /// [`StorageError::TooLong`], and the flash's.
    pub fn begin(&mut self, bytes: &[u8]) -> Result<Writing, StorageError> {
        let before = self.newest.map_or(0, |newest| newest.sequence);
        let latest = before.max(self.lost.unwrap_or(0)).max(self.newer.unwrap_or(0));
        let mut writing = Writing::new(latest.saturating_add(1), bytes).ok_or(StorageError::TooLong)?;
        if let Some(newest) = self.newest.filter(|_| latest == before)
            && self.holds(bytes)?
        {
            (writing.sequence, writing.at) = (before, newest.at);
            writing.phase = if self.lacks_seal(&newest)? { Phase::Seal } else { Phase::Stored };
            return Ok(writing);
        }
        (writing.at, writing.phase) = match self.newest {
            // Flash that never held a record may be blank; what a cut has left half erased is not asked.
            None => (Self::ROW.at, Phase::Fresh),
            Some(newest) => match newest.next {
                Some(next) => (next, Phase::Look),
                None => (self.next_block(newest.at)?, Phase::Erase(0)),
            },
        };
        Ok(writing)
    }

    /// One flash operation; the record's sequence number, once it is stored.
    ///
    /// # Errors
    ///
    /// Those of the flash, and [`StorageError::Worn`]. The old record is still there.
    pub fn step(&mut self, writing: &mut Writing) -> Result<Option<u32>, StorageError> {
        let block = writing.at / Self::BLOCK * Self::BLOCK;
        writing.phase = match writing.phase {
            Phase::Stored => return Ok(self.newest.map(|newest| newest.sequence)),
            Phase::Fresh if self.is_blank(block, Self::BLOCK)? => Phase::Head,
            Phase::Fresh => Phase::Erase(0),
            Phase::Look if self.is_blank(writing.at, layout::SLOT)? => Phase::Write(0),
            Phase::Look => self.pass_over(writing)?,
            Phase::Erase(page) => {
                let from = block + page * F::ERASE_SIZE;
                self.flash.erase(from as u32, (from + F::ERASE_SIZE) as u32).map_err(of_flash)?;
                let next = page + 1;
                if next * F::ERASE_SIZE < Self::BLOCK { Phase::Erase(next) } else { Phase::Head }
            }
            Phase::Head => {
                self.write(block, &Head::written(F::ERASE_SIZE, writing.sequence).piece())?;
                Phase::Write(0)
            }
            Phase::Write(piece) if piece * PIECE < writing.length() => {
                self.write(writing.at + piece * PIECE, &writing.piece(piece))?;
                Phase::Write(piece + 1)
            }
            Phase::Write(_) => Phase::Verify,
            Phase::Verify => match self.examine(writing.at, Slot::WRITTEN)? {
                Found::Whole(sequence, _) if sequence == writing.sequence => Phase::Seal,
                _ => self.pass_over(writing)?,
            },
            Phase::Seal => {
                self.write(writing.at + layout::SLOT - SEAL, &seal(writing.sequence))?;
                Phase::Count
            }
            Phase::Count => {
                if self.sealed(writing.at, Slot::WRITTEN)? == Some(writing.sequence) {
                    return Ok(Some(self.count(writing)));
                }
                self.pass_over(writing)?
            }
        };
        Ok(None)
    }

    /// The power went before a whole record was sealed.
    fn lacks_seal(&mut self, newest: &Newest) -> Result<bool, StorageError> {
        let seal = newest.at + layout::SLOT - SEAL;
        Ok(newest.end == newest.at + layout::SLOT && self.is_blank(seal, SEAL)?)
    }

    /// The record counts from now on; its sequence number.
    fn count(&mut self, writing: &Writing) -> u32 {
        if self.newest.is_some_and(|newest| newest.at == writing.at) {
            return writing.sequence;
        }
        self.previous = self.newest.replace(Newest {
            sequence: writing.sequence,
            length: writing.length() - HEADER - CHECKSUM,
            at: writing.at,
            end: writing.at + layout::SLOT,
            next: Self::next_slot(writing.at),
        });
        (self.lost, self.newer) = (None, None);
        writing.sequence
    }

    /// On to the next slot that may be written.
    fn pass_over(&self, writing: &mut Writing) -> Result<Phase, StorageError> {
        if !matches!(writing.phase, Phase::Look) {
            writing.failed += 1;
        }
        if writing.failed > self.blocks() {
            return Err(StorageError::Worn);
        }
        Ok(match Self::next_slot(writing.at) {
            Some(next) => {
                writing.at = next;
                Phase::Look
            }
            None => {
                writing.at = self.next_block(writing.at)?;
                Phase::Erase(0)
            }
        })
    }

    /// The slot behind another of the same block.
    fn next_slot(at: usize) -> Option<usize> {
        let (block, next) = (at / Self::BLOCK * Self::BLOCK, at + layout::SLOT);
        (next + layout::SLOT <= block + Self::ROW.at + Self::ROW.count * layout::SLOT).then_some(next)
    }

    /// First slot of the block after that of an address; never of one in which the newest lies.
    fn next_block(&self, at: usize) -> Result<usize, StorageError> {
        let (count, first) = (self.blocks(), at / Self::BLOCK + 1);
        let mut starts = (first..first + count).map(|block| block % count.max(1) * Self::BLOCK);
        let is_free = |start: &usize| {
            self.newest.is_none_or(|newest| newest.end <= *start || *start + Self::BLOCK <= newest.at)
        };
        starts.find(is_free).map(|start| start + Self::ROW.at).ok_or(StorageError::Unsuited)
    }

    fn blocks(&self) -> usize {
        self.flash.capacity() / Self::BLOCK
    }

    /// What stands at the start of a block.
    fn head(&mut self, block: usize) -> Result<Option<Head>, StorageError> {
        let mut piece = [0; PIECE];
        self.flash.read((block * Self::BLOCK) as u32, &mut piece).map_err(of_flash)?;
        Ok(Head::read(&piece))
    }

    /// Looks at the slots of a block; `own` where the next record may go into the same block.
    fn look(&mut self, block: usize, row: Row, own: bool) -> Result<(), StorageError> {
        for index in 0..row.count {
            let at = block + row.at + index * row.slot.size;
            match self.examine(at, row.slot)? {
                Found::Nothing => {}
                Found::Damaged(sequence) => self.lost = self.lost.max(Some(sequence)),
                Found::Whole(sequence, length) => {
                    let next = if own { Self::next_slot(at) } else { None };
                    self.rank(Newest { sequence, length, at, end: at + row.slot.size, next });
                }
            }
        }
        Ok(())
    }

    /// Keeps a whole slot if it is one of the two newest.
    fn rank(&mut self, slot: Newest) {
        let above = |other: &Option<Newest>| other.is_none_or(|other| slot.sequence > other.sequence);
        if above(&self.newest) {
            self.previous = self.newest.replace(slot);
        } else if above(&self.previous) {
            self.previous = Some(slot);
        }
    }

    /// Looks at the slots of layout 1, where no block of a later one begins.
    fn look_for_first(&mut self) -> Result<(), StorageError> {
        let (block, row) = (Row::first_block(F::ERASE_SIZE), Row::first(F::ERASE_SIZE));
        for start in (0..self.flash.capacity() / block).map(|index| index * block) {
            let last = ((start + block - 1) / Self::BLOCK).min(self.blocks().saturating_sub(1));
            let mut later = false;
            for overlapped in start / Self::BLOCK..=last {
                later |= self.head(overlapped)?.is_some();
            }
            if !later {
                self.look(start, row, false)?;
            }
        }
        Ok(())
    }

    fn write(&mut self, at: usize, piece: &[u8; PIECE]) -> Result<(), StorageError> {
        self.flash.write(at as u32, piece).map_err(of_flash)
    }

    fn is_blank(&mut self, start: usize, length: usize) -> Result<bool, StorageError> {
        let mut piece = [0; PIECE];
        for at in (start..start + length).step_by(PIECE) {
            self.flash.read(at as u32, &mut piece).map_err(of_flash)?;
            if piece.iter().any(|byte| *byte != 0xFF) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The newest slot holds these bytes.
    fn holds(&mut self, bytes: &[u8]) -> Result<bool, StorageError> {
        let mut stored = [0; record::MAX_LEN];
        match self.read(&mut stored) {
            Ok(stored) => Ok(stored == bytes),
            Err(StorageError::TooLong) => Ok(false),
            Err(error) => Err(error),
        }
    }
}

fn of_flash(error: impl NorFlashError) -> StorageError {
    StorageError::Flash(error.kind())
}

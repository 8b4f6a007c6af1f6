//! Where the slots of a region lie, and what stands at the start of each block of them.
//!
//! ```text
//! block of layout 2                     0      4         5        6           8            10      12          16
//! ├──────┬────────┬────────┬┄┄┄┤ head:  ├──────┼─────────┼────────┼───────────┼────────────┼───────┼───────────┼────────┤
//! │ head │ slot   │ slot   │   │        │ IMUS │ version │ 0xFF   │ slot, u16 │ count, u16 │ ones  │ since, u32│ CRC-32 │
//! └──────┴────────┴────────┴┄┄┄┘        └──────┴─────────┴────────┴───────────┴────────────┴───────┴───────────┴────────┘
//!  64 B    960 B
//! ```
//!
//! The head keeps its place and its fields in every later layout: `slot` and `count` are the size of the block's slots,
//! bytes, and their number; `since` is the sequence number of the first record that the block took. So firmware that is
//! older than a block's layout knows that something newer lies there, and keeps it.
//!
//! A slot's size belongs to the layout, not to the longest record of a format's version: a longer record moves no
//! slot. Layout 1, of firmware before this one, had slots of 640 B, no head and no seal. It is read and never written.

use imucal_core::record;

use super::{CHECKSUM, CRC, HEADER, PIECE};

/// Version of the layout that is written.
pub const VERSION: u8 = 2;

/// Size of a slot, bytes.
pub const SLOT: usize = 960;
/// What a block begins with, bytes.
const HEAD: usize = PIECE;
/// What a slot ends with, bytes: the seal.
pub(super) const SEAL: usize = PIECE;
/// Size of a slot of layout 1, bytes.
const FIRST_SLOT: usize = 640;

const _: () = assert!(record::MAX_LEN <= Slot::WRITTEN.room(), "a longer record needs a layout of its own");

const MAGIC: [u8; 4] = *b"IMUS";

/// What a slot has room for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Slot {
    /// Its size, bytes.
    pub(super) size: usize,
    /// A seal shows that it was whole once.
    pub(super) sealed: bool,
}

impl Slot {
    /// As they are written.
    pub(super) const WRITTEN: Self = Self { size: SLOT, sealed: true };
    /// Of layout 1.
    pub(super) const FIRST: Self = Self { size: FIRST_SLOT, sealed: false };

    /// Longest record, bytes.
    pub(super) const fn room(self) -> usize {
        self.size - HEADER - CHECKSUM - if self.sealed { SEAL } else { 0 }
    }
}

/// Slots of a block, from `at` bytes behind its start on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Row {
    pub(super) at: usize,
    pub(super) slot: Slot,
    pub(super) count: usize,
}

impl Row {
    /// Bytes of a block of whole pages.
    pub(super) const fn block(page: usize) -> usize {
        (HEAD + SLOT).next_multiple_of(page)
    }

    /// As they are written.
    pub(super) const fn written(page: usize) -> Self {
        Self { at: HEAD, slot: Slot::WRITTEN, count: (Self::block(page) - HEAD) / SLOT }
    }

    /// Bytes of a block of layout 1.
    pub(super) const fn first_block(page: usize) -> usize {
        FIRST_SLOT.next_multiple_of(page)
    }

    /// Of layout 1.
    pub(super) const fn first(page: usize) -> Self {
        Self { at: 0, slot: Slot::FIRST, count: Self::first_block(page) / FIRST_SLOT }
    }
}

/// What stands at the start of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Head {
    version: u8,
    slot: u16,
    count: u16,
    /// Sequence number of the first record of the block.
    pub(super) since: u32,
}

impl Head {
    /// Of a block as they are written.
    pub(super) fn written(page: usize, since: u32) -> Self {
        Self { version: VERSION, slot: SLOT as u16, count: Row::written(page).count as u16, since }
    }

    pub(super) fn read(piece: &[u8; PIECE]) -> Option<Self> {
        let [m, a, g, i, version, _, s, t, c, d, _, _, e, f, h, k, stored @ ..] =
            *piece.first_chunk::<{ 16 + CHECKSUM }>()?;
        let checked = piece.first_chunk::<16>()?;
        let whole = [m, a, g, i] == MAGIC && CRC.checksum(checked) == u32::from_le_bytes(stored);
        whole.then_some(Self {
            version,
            slot: u16::from_le_bytes([s, t]),
            count: u16::from_le_bytes([c, d]),
            since: u32::from_le_bytes([e, f, h, k]),
        })
    }

    pub(super) fn piece(self) -> [u8; PIECE] {
        let [m, a, g, i] = MAGIC;
        let ([s, t], [c, d]) = (self.slot.to_le_bytes(), self.count.to_le_bytes());
        let [e, f, h, k] = self.since.to_le_bytes();
        let checked = [m, a, g, i, self.version, 0xFF, s, t, c, d, 0xFF, 0xFF, e, f, h, k];
        let mut piece = [0xFF; PIECE];
        for (slot, byte) in piece.iter_mut().zip(checked.iter().chain(&CRC.checksum(&checked).to_le_bytes()))
        {
            *slot = *byte;
        }
        piece
    }

    /// The slots of such a block; `None` where only newer firmware knows.
    pub(super) fn row(self, block: usize) -> Option<Row> {
        let (size, count) = (usize::from(self.slot), usize::from(self.count));
        let possible =
            size > HEADER + CHECKSUM + SEAL && size.is_multiple_of(PIECE) && HEAD + size * count <= block;
        (self.version == VERSION && possible).then_some(Row {
            at: HEAD,
            slot: Slot { size, sealed: true },
            count,
        })
    }
}

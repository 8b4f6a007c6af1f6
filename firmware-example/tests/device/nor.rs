//! NOR flash that is simulated with its rules, its wear and its power cuts.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

/// Size of a page, bytes.
pub const PAGE: usize = 4096;
const WORD: usize = 4;
/// A cut may leave a page erased up to any multiple of this, bytes.
const ERASE_GRAIN: usize = 256;

/// Why the flash did nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NorError {
    /// Not aligned, or outside.
    Misused(NorFlashErrorKind),
    /// A word was written that was not erased.
    NotErased,
    /// The power was cut.
    Cut,
}

impl NorFlashError for NorError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Misused(kind) => *kind,
            _ => NorFlashErrorKind::Other,
        }
    }
}

/// Flash of some pages, erased at first.
#[derive(Clone, Debug)]
pub struct Nor {
    /// What it holds.
    pub bytes: Vec<u8>,
    /// Erases of each page.
    pub erases: Vec<u32>,
    /// Operations (a word written, some bytes erased) before the power is cut; `None`: it is not.
    pub left: Option<u32>,
    /// Bits of the word under way that a cut lets in, of those that were to be cleared.
    pub torn: u32,
    /// Operations done.
    pub operations: u32,
}

impl Nor {
    /// Erased flash.
    pub fn new(pages: usize) -> Self {
        Self { bytes: vec![0xFF; pages * PAGE], erases: vec![0; pages], left: None, torn: 0, operations: 0 }
    }

    /// Counts an operation; whether the power is cut in it.
    fn is_cut(&mut self) -> bool {
        if self.left == Some(0) {
            return true;
        }
        self.left = self.left.map(|left| left - 1);
        self.operations += 1;
        false
    }
}

impl ErrorType for Nor {
    type Error = NorError;
}

impl ReadNorFlash for Nor {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorError> {
        check_read(self, offset, bytes.len()).map_err(NorError::Misused)?;
        bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Nor {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorError> {
        check_erase(self, from, to).map_err(NorError::Misused)?;
        for at in (from as usize..to as usize).step_by(ERASE_GRAIN) {
            if self.is_cut() {
                return Err(NorError::Cut);
            }
            if at.is_multiple_of(PAGE) {
                self.erases[at / PAGE] += 1;
            }
            self.bytes[at..at + ERASE_GRAIN].fill(0xFF);
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorError> {
        check_write(self, offset, bytes.len()).map_err(NorError::Misused)?;
        for (index, word) in bytes.chunks_exact(WORD).enumerate() {
            let at = offset as usize + index * WORD;
            let old = u32::from_le_bytes(self.bytes[at..at + WORD].try_into().expect("a word"));
            let new = u32::from_le_bytes(word.try_into().expect("a word"));
            if old != u32::MAX {
                return Err(NorError::NotErased);
            }
            let cut = self.is_cut();
            let written = if cut { new | !self.torn } else { new };
            self.bytes[at..at + WORD].copy_from_slice(&written.to_le_bytes());
            if cut {
                return Err(NorError::Cut);
            }
        }
        Ok(())
    }
}

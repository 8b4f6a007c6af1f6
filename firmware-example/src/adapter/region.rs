//! A region of a flash whose driver knows only the whole of it.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

/// `length` bytes from `start` on, both multiples of what is erased at once; offsets count from there.
#[derive(Debug)]
pub struct Region<F> {
    flash: F,
    start: u32,
    length: u32,
}

/// Why a region is none, or what it cannot do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RegionError<E> {
    /// It is empty, ends outside of its flash, or within what is erased at once.
    Bounds,
    /// Beyond the region, or not aligned.
    Access(NorFlashErrorKind),
    /// The flash's own.
    Flash(E),
}

impl<E: NorFlashError> NorFlashError for RegionError<E> {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Bounds => NorFlashErrorKind::OutOfBounds,
            Self::Access(kind) => *kind,
            Self::Flash(error) => error.kind(),
        }
    }
}

impl<F: NorFlash> Region<F> {
    /// Of this flash.
    ///
    /// # Errors
    ///
    /// [`RegionError::Bounds`].
    pub fn new(flash: F, start: u32, length: u32) -> Result<Self, RegionError<F::Error>> {
        let whole = |at: u32| (at as usize).is_multiple_of(F::ERASE_SIZE);
        let end = start.checked_add(length);
        let inside = end.is_some_and(|end| end as usize <= flash.capacity());
        if length == 0 || !whole(start) || !whole(length) || !inside {
            return Err(RegionError::Bounds);
        }
        Ok(Self { flash, start, length })
    }

    /// The whole flash.
    pub fn into_inner(self) -> F {
        self.flash
    }
}

impl<F: NorFlash> ErrorType for Region<F> {
    type Error = RegionError<F::Error>;
}

impl<F: NorFlash> ReadNorFlash for Region<F> {
    const READ_SIZE: usize = F::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        check_read(self, offset, bytes.len()).map_err(RegionError::Access)?;
        self.flash.read(self.start + offset, bytes).map_err(RegionError::Flash)
    }

    fn capacity(&self) -> usize {
        self.length as usize
    }
}

impl<F: NorFlash> NorFlash for Region<F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        check_erase(self, from, to).map_err(RegionError::Access)?;
        self.flash.erase(self.start + from, self.start + to).map_err(RegionError::Flash)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        check_write(self, offset, bytes.len()).map_err(RegionError::Access)?;
        self.flash.write(self.start + offset, bytes).map_err(RegionError::Flash)
    }
}

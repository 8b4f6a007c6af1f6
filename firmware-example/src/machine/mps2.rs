//! mps2-an386 and mps2-an505: CMSDK UART 0, and flash in the board's PSRAM.

use core::num::NonZeroU32;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

use super::{Register, Stopwatch, read_words, wait, wake_by};
use crate::{
    board::{ByteLink, Clock},
    elapsed::Elapsed,
};

/// Where things lie (Arm AN386, 3.1), and the peripherals' clock, Hz.
#[cfg(an386)]
mod map {
    pub(in crate::machine) const TIMER: usize = 0x4000_0000;
    pub(super) const UART: usize = 0x4000_4000;
    #[cfg(not(nordic))]
    pub(super) const WATCHDOG: usize = 0x4000_8000;
    /// The PSRAM, which QEMU lets a file back.
    pub(super) const WINDOW: u32 = 0x2100_0000;
    /// Interrupt of a byte that has come.
    pub(super) const RECEIVED: u32 = 0;
    pub(super) const CLOCK: u32 = 25_000_000;
}

/// The same, from the secure side (Arm AN505, 3.2 and 3.4).
#[cfg(an505)]
mod map {
    pub(in crate::machine) const TIMER: usize = 0x5000_0000;
    pub(super) const UART: usize = 0x5020_0000;
    pub(super) const WATCHDOG: usize = 0x5008_1000;
    pub(super) const WINDOW: u32 = 0x8000_0000;
    pub(super) const RECEIVED: u32 = 32;
    pub(super) const CLOCK: u32 = 20_000_000;
}

pub(super) use map::TIMER;
use map::{CLOCK, RECEIVED, UART, WINDOW};

const DATA: Register = Register(UART);
const STATE: Register = Register(UART + 0x4);
const CONTROL: Register = Register(UART + 0x8);
const CLEAR: Register = Register(UART + 0xC);
const DIVISOR: Register = Register(UART + 0x10);

/// The UART.
#[derive(Debug)]
pub struct Uart(());

impl Uart {
    /// Switches it on, at 115 200 baud.
    pub fn start() -> Self {
        // QEMU sends nothing while the divisor is below 16.
        DIVISOR.write(CLOCK / 115_200);
        // Both directions, and an interrupt where a byte comes.
        CONTROL.write(0b1011);
        wake_by(RECEIVED);
        Self(())
    }
}

impl ByteLink for Uart {
    fn receive(&mut self) -> Option<u8> {
        (STATE.read() & 0b10 != 0).then(|| DATA.read() as u8)
    }

    fn send(&mut self, byte: u8) -> bool {
        let free = STATE.read() & 0b01 == 0;
        if free {
            DATA.write(byte.into());
        }
        free
    }
}

/// TIMER0, which is looked at whenever the core's own timer has come round and ended a wait, three times in two seconds.
#[derive(Debug)]
pub struct Uptime {
    timer: Stopwatch,
    elapsed: Elapsed,
}

impl Uptime {
    /// Starts both timers.
    pub fn start() -> Self {
        const PER_MILLISECOND: NonZeroU32 = NonZeroU32::new(CLOCK / 1_000).unwrap();
        ALARM_ROUND.write(0x00FF_FFFF);
        // By the core's clock, with an interrupt: all are masked, and there is no handler.
        ALARM.write(0b111);
        Self { timer: Stopwatch::start(), elapsed: Elapsed::new(32, PER_MILLISECOND) }
    }
}

impl Clock for Uptime {
    fn uptime(&mut self) -> u32 {
        self.elapsed.at(self.timer.ticks())
    }
}

const ALARM: Register = Register(0xE000_E010);
const ALARM_ROUND: Register = Register(0xE000_E014);
const INTERRUPT_CONTROL: Register = Register(0xE000_ED04);
const CLEAR_TICK: u32 = 1 << 25;

/// Waits for a byte, or for the core's timer to come round.
pub fn idle() {
    wait(RECEIVED);
    CLEAR.write(0b10);
    INTERRUPT_CONTROL.write(CLEAR_TICK);
}

#[cfg(all(an386, not(nordic)))]
const MPU_CONTROL: Register = Register(0xE000_ED94);
#[cfg(all(an386, not(nordic)))]
const MPU_BASE: Register = Register(0xE000_ED9C);
#[cfg(all(an386, not(nordic)))]
const MPU_SIZE: Register = Register(0xE000_EDA0);

/// Closes the 64 KiB below RAM, so that a stack that is full leaves memory here too: on this machine something unnamed
/// takes what is written there. The nRF52840 and mps2-an505 have nothing there.
#[cfg(all(an386, not(nordic)))]
pub(super) fn close_below_stack() {
    MPU_BASE.write(0x1FFF_0000 | 1 << 4);
    // No access, 2^16 bytes, enabled.
    MPU_SIZE.write(15 << 1 | 1);
    // All else as without it.
    MPU_CONTROL.write(0b101);
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}

/// The CMSDK's watchdog (Arm DDI 0479, 4.4). It interrupts by the NMI, whose handler ends the run; were that
/// to hang too, it would reset after as long again.
#[cfg(not(nordic))]
#[derive(Debug)]
pub struct Watchdog(());

#[cfg(not(nordic))]
impl Watchdog {
    /// Starts it; `milliseconds`: up to 171 000.
    pub fn start(milliseconds: u32) -> Self {
        Register(map::WATCHDOG).write(milliseconds.saturating_mul(CLOCK / 1_000));
        Register(map::WATCHDOG + 0x8).write(0b11);
        Self(())
    }

    /// Puts the reset off.
    pub fn feed(&self) {
        Register(map::WATCHDOG + 0xC).write(1);
    }
}

/// Bytes of the window that are the record's.
const CAPACITY: usize = 4 * PAGE;
const PAGE: usize = 4096;
const WORD: usize = 4;

/// Flash: memory of which bits are only cleared, and pages are set.
#[derive(Debug)]
pub struct Flash(());

impl Flash {
    pub(super) fn new() -> Self {
        Self(())
    }

    fn word(offset: u32) -> Register {
        Register((WINDOW + offset) as usize)
    }
}

impl ErrorType for Flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = WORD;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, bytes.len())?;
        read_words(WINDOW + offset, bytes);
        Ok(())
    }

    fn capacity(&self) -> usize {
        CAPACITY
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        (from..to).step_by(WORD).for_each(|at| Self::word(at).write(u32::MAX));
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        for (word, at) in bytes.as_chunks::<WORD>().0.iter().zip((offset..).step_by(WORD)) {
            let place = Self::word(at);
            place.write(place.read() & u32::from_le_bytes(*word));
        }
        Ok(())
    }
}

/// Starts so far, behind the record's pages.
const STARTS: Register = Register(WINDOW as usize + CAPACITY);

/// Where a tape lies in the PSRAM, behind the record's pages.
const TAPE: u32 = WINDOW + 0x10_0000;

/// The tape of [`crate::standalone`], which a file fills.
#[derive(Clone, Copy, Debug)]
pub struct MemoryTape;

impl crate::standalone::Tape for MemoryTape {
    fn read(&mut self, offset: usize, into: &mut [u8]) {
        read_words(TAPE + offset as u32, into);
    }
}

/// The record's flash, where no co-processor has it.
pub fn flash() -> Flash {
    Flash::new()
}

/// A number of this start alone, since the machine has no random numbers: a count of starts. It is kept as the record
/// is; where no file backs the memory, it is lost with the record.
pub(super) fn boot_number() -> u64 {
    let starts = STARTS.read().wrapping_add(1);
    STARTS.write(starts);
    starts.into()
}

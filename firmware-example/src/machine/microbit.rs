//! micro:bit: the nRF51's UART and flash (nRF51 Series Reference Manual 3.0, chapters 6 and 29).

use core::num::NonZeroU32;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

use super::{Register, clear, read_words, wait, wake_by};
use crate::{
    board::{ByteLink, Clock},
    elapsed::Elapsed,
};

const START_RECEIVER: Register = Register(0x4000_2000);
const START_TRANSMITTER: Register = Register(0x4000_2008);
const RECEIVED: Register = Register(0x4000_2108);
const TRANSMITTED: Register = Register(0x4000_211C);
const INTERRUPT_BY: Register = Register(0x4000_2304);
const ENABLE: Register = Register(0x4000_2500);
const RECEIVE_PIN: Register = Register(0x4000_2514);
const TRANSMIT_PIN: Register = Register(0x4000_250C);
const DATA_IN: Register = Register(0x4000_2518);
const DATA_OUT: Register = Register(0x4000_251C);
const BAUD: Register = Register(0x4000_2524);
const LINE: u32 = 2;

/// The UART.
#[derive(Debug)]
pub struct Uart {
    /// A byte is on its way out.
    sending: bool,
}

impl Uart {
    /// Switches it on, at 115 200 baud, on the pins of the USB interface.
    pub fn start() -> Self {
        TRANSMIT_PIN.write(24);
        RECEIVE_PIN.write(25);
        BAUD.write(0x01D7_E000);
        ENABLE.write(4);
        INTERRUPT_BY.write(1 << 2);
        START_RECEIVER.write(1);
        START_TRANSMITTER.write(1);
        wake_by(LINE);
        Self { sending: false }
    }
}

impl ByteLink for Uart {
    fn receive(&mut self) -> Option<u8> {
        if RECEIVED.read() == 0 {
            return None;
        }
        // Before the byte is read: the next one may come at once.
        RECEIVED.write(0);
        Some(DATA_IN.read() as u8)
    }

    fn send(&mut self, byte: u8) -> bool {
        if self.sending && TRANSMITTED.read() == 0 {
            return false;
        }
        TRANSMITTED.write(0);
        self.sending = true;
        DATA_OUT.write(byte.into());
        true
    }
}

const START_TIMER: Register = Register(0x4000_8000);
const CAPTURE: Register = Register(0x4000_8040);
const ALARMED: Register = Register(0x4000_8144);
const ALARM_BY: Register = Register(0x4000_8304);
const TIMER_BITS: Register = Register(0x4000_8508);
const TIMER_PRESCALER: Register = Register(0x4000_8510);
const CAPTURED: Register = Register(0x4000_8540);
const ALARM: Register = Register(0x4000_8544);
const TIMER_LINE: u32 = 8;
/// Longest wait, µs.
const LONGEST: u32 = 2_000_000;

/// TIMER0 at 1 MHz, which goes on while the core sleeps; the core's own timer stops there.
#[derive(Debug)]
pub struct Uptime(Elapsed);

impl Uptime {
    /// Starts it.
    pub fn start() -> Self {
        TIMER_BITS.write(3);
        TIMER_PRESCALER.write(4);
        ALARM_BY.write(1 << 17);
        START_TIMER.write(1);
        wake_by(TIMER_LINE);
        const PER_MILLISECOND: NonZeroU32 = NonZeroU32::new(1_000).unwrap();
        Self(Elapsed::new(32, PER_MILLISECOND))
    }
}

/// TIMER0's count, µs.
fn now() -> u32 {
    CAPTURE.write(1);
    CAPTURED.read()
}

impl Clock for Uptime {
    fn uptime(&mut self) -> u32 {
        self.0.at(now())
    }
}

/// Waits for a byte, two seconds at the most.
pub fn idle() {
    ALARM.write(now().wrapping_add(LONGEST));
    if RECEIVED.read() == 0 {
        wait(LINE);
    }
    ALARMED.write(0);
    clear(TIMER_LINE);
}

const READY: Register = Register(0x4001_E400);
const CONFIGURATION: Register = Register(0x4001_E504);
const ERASE_PAGE: Register = Register(0x4001_E508);
const PAGE: usize = 1024;
const WORD: usize = 4;
/// Pages of the record, the last ones.
const CAPACITY: usize = 4 * PAGE;
const START: u32 = 0x0004_0000 - CAPACITY as u32;

/// The last pages of the flash.
#[derive(Debug)]
pub struct Flash(());

impl Flash {
    pub(super) fn new() -> Self {
        Self(())
    }

    /// Does what needs the controller to be set so.
    fn set(configuration: u32, work: impl FnOnce()) {
        CONFIGURATION.write(configuration);
        work();
        while READY.read() & 1 == 0 {}
        CONFIGURATION.write(0);
    }
}

impl ErrorType for Flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = WORD;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, bytes.len())?;
        read_words(START + offset, bytes);
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
        for page in (from..to).step_by(PAGE) {
            Self::set(2, || ERASE_PAGE.write(START + page));
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        for (word, at) in bytes.as_chunks::<WORD>().0.iter().zip((offset..).step_by(WORD)) {
            Self::set(1, || Register((START + at) as usize).write(u32::from_le_bytes(*word)));
        }
        Ok(())
    }
}

const START_RANDOM: Register = Register(0x4000_D000);
const STOP_RANDOM: Register = Register(0x4000_D004);
const RANDOM_READY: Register = Register(0x4000_D100);
/// With the correction of its bias.
const RANDOM_CONFIGURATION: Register = Register(0x4000_D504);
const RANDOM: Register = Register(0x4000_D508);

/// A number of this start alone: 64 bits of the random number generator (the manual's chapter 21).
pub(super) fn boot_number() -> u64 {
    RANDOM_CONFIGURATION.write(1);
    START_RANDOM.write(1);
    let number = (0..8).fold(0, |number, _| {
        while RANDOM_READY.read() == 0 {}
        RANDOM_READY.write(0);
        number << 8 | u64::from(RANDOM.read() & 0xFF)
    });
    STOP_RANDOM.write(1);
    number
}

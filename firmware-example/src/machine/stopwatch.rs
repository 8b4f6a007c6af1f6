//! A timer that counts with QEMU's virtual clock: under `-icount shift=N` an instruction takes 2^N ns of it.

use super::Register;
#[cfg(mps2)]
use super::mps2::TIMER;

/// The timer: the CMSDK's timer 0 at 25 MHz (20 MHz on mps2-an505), or the nRF51's TIMER0 at 16 MHz.
#[derive(Debug)]
pub struct Stopwatch(());

#[cfg(mps2)]
impl Stopwatch {
    /// Starts it.
    pub fn start() -> Self {
        Register(TIMER + 0x8).write(u32::MAX);
        Register(TIMER + 0x4).write(u32::MAX);
        Register(TIMER).write(1);
        Self(())
    }

    /// Ticks since the start, and round.
    pub fn ticks(&self) -> u32 {
        u32::MAX - Register(TIMER + 0x4).read()
    }
}

#[cfg(microbit)]
impl Stopwatch {
    /// Starts it.
    pub fn start() -> Self {
        Register(0x4000_8508).write(3); // 32 bits
        Register(0x4000_8510).write(0); // no prescaler
        Register(0x4000_8000).write(1);
        Self(())
    }

    /// Ticks since the start, and round.
    pub fn ticks(&self) -> u32 {
        Register(0x4000_8040).write(1);
        Register(0x4000_8540).read()
    }
}

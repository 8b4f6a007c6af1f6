//! Milliseconds by the core's own timer.

use core::num::NonZeroU32;

use cortex_m::peripheral::{SYST, syst::SystClkSource};

use super::Register;
use crate::{board::Clock, elapsed::Elapsed};

/// Bits of the timer, which counts down.
const BITS: u32 = 24;
/// It counts down from here and round.
const TOP: u32 = 0x00FF_FFFF;
/// The timer's value.
const VALUE: Register = Register(0xE000_E018);

/// The core's timer, for a board that never sleeps: it is looked at more than once a round, which at 64 MHz is a quarter
/// of a second.
#[derive(Debug)]
pub struct Ticks(Elapsed);

impl Ticks {
    /// Starts the timer; `per_millisecond` is the core's frequency, kHz.
    pub fn start(per_millisecond: NonZeroU32) -> Self {
        // SAFETY: called once, before anything else looks at the timer.
        let mut timer: SYST = unsafe { cortex_m::Peripherals::steal() }.SYST;
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(TOP);
        timer.clear_current();
        timer.enable_counter();
        Self(Elapsed::new(BITS, per_millisecond))
    }
}

impl Clock for Ticks {
    fn uptime(&mut self) -> u32 {
        self.0.at(TOP - VALUE.read())
    }
}

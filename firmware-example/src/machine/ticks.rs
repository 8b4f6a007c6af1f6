//! Milliseconds by the core's own timer.

use core::num::NonZeroU32;

use cortex_m::peripheral::{SYST, syst::SystClkSource};

use super::Register;
use crate::board::Clock;

/// The timer counts down from here and round.
const TOP: u32 = 0x00FF_FFFF;
/// The timer's value.
const VALUE: Register = Register(0xE000_E018);

/// The core's timer, followed by looking at it: at least three times a second, else time is lost.
#[derive(Debug)]
pub struct Ticks {
    /// Ticks of a millisecond.
    per_millisecond: NonZeroU32,
    last: u32,
    rest: u32,
    milliseconds: u32,
}

impl Ticks {
    /// Starts the timer; `per_millisecond` is the core's frequency, kHz.
    pub fn start(per_millisecond: NonZeroU32) -> Self {
        // SAFETY: called once, before anything else looks at the timer.
        let mut timer: SYST = unsafe { cortex_m::Peripherals::steal() }.SYST;
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(TOP);
        timer.clear_current();
        timer.enable_counter();
        Self { per_millisecond, last: TOP, rest: 0, milliseconds: 0 }
    }
}

impl Clock for Ticks {
    fn uptime(&mut self) -> u32 {
        let now = VALUE.read();
        self.rest += self.last.wrapping_sub(now) & TOP;
        self.last = now;
        self.milliseconds = self.milliseconds.wrapping_add(self.rest / self.per_millisecond);
        self.rest %= self.per_millisecond;
        self.milliseconds
    }
}

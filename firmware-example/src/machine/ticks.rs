//! Milliseconds by the core's own timer.

use cortex_m::peripheral::{SYST, syst::SystClkSource};

use super::Register;
use crate::board::Clock;

/// Ticks of a millisecond: the core's clock.
#[cfg(mps2)]
const PER_MILLISECOND: u32 = 25_000;
/// See above.
#[cfg(microbit)]
const PER_MILLISECOND: u32 = 64_000;
/// The timer counts down from here and round.
const TOP: u32 = 0x00FF_FFFF;
/// The timer's value.
const VALUE: Register = Register(0xE000_E018);

/// The core's timer, followed by looking at it: at least three times a second, else time is lost.
#[derive(Debug)]
pub struct Ticks {
    last: u32,
    rest: u32,
    milliseconds: u32,
}

impl Ticks {
    /// Starts the timer.
    pub fn start() -> Self {
        // SAFETY: called once, before anything else looks at the timer.
        let mut timer: SYST = unsafe { cortex_m::Peripherals::steal() }.SYST;
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(TOP);
        timer.clear_current();
        timer.enable_counter();
        Self { last: TOP, rest: 0, milliseconds: 0 }
    }
}

impl Clock for Ticks {
    fn uptime(&mut self) -> u32 {
        let now = VALUE.read();
        self.rest += self.last.wrapping_sub(now) & TOP;
        self.last = now;
        self.milliseconds = self.milliseconds.wrapping_add(self.rest / PER_MILLISECOND);
        self.rest %= PER_MILLISECOND;
        self.milliseconds
    }
}

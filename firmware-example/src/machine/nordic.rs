//! The watchdog of the nRF51 (nRF51 Series Reference Manual 3.0, chapters 11 and 24) and of the nRF52840, which has it in
//! the same place. **Not run**: QEMU's machine has no model of it, and takes what is written for nothing.

use imucal_core::link::{LastReset, ResetCause};

use super::Register;

const START: Register = Register(0x4001_0000);
/// Ticks of 32 768 Hz, less one.
const PERIOD: Register = Register(0x4001_0504);
const CONFIGURATION: Register = Register(0x4001_050C);
const RELOAD: Register = Register(0x4001_0600);
const RESET_REASON: Register = Register(0x4000_0400);
const BY_WATCHDOG: u32 = 1 << 1;

/// Resets the chip, unless it is fed. Its first reload register is enabled from the start.
#[derive(Debug)]
pub struct Watchdog(());

impl Watchdog {
    /// Starts it; nothing but a reset ends it. `milliseconds`: up to 131 000.
    pub fn start(milliseconds: u32) -> Self {
        // It counts on while the core sleeps, and not while a debugger has halted it.
        CONFIGURATION.write(1);
        PERIOD.write(milliseconds.saturating_mul(32_768 / 8) / (1_000 / 8));
        START.write(1);
        Self(())
    }

    /// Puts the reset off.
    pub fn feed(&self) {
        RELOAD.write(0x6E52_4635);
    }
}

/// Here the watchdog leaves no time for a note: the chip says that it was that.
pub(super) fn by_watchdog(last: LastReset) -> LastReset {
    let reason = RESET_REASON.read();
    // Ones clear what they stand for; otherwise reasons add up.
    RESET_REASON.write(reason);
    if reason & BY_WATCHDOG == 0 {
        return last;
    }
    LastReset { cause: ResetCause::Watchdog, address: 0, ..last }
}

//! What the images of the nRF52840 say by defmt, over RTT.
//!
//! Nobody waits for a debugger: without one the oldest lines are overwritten. With one that listens in blocking mode, a
//! line waits until it is read, and a halt of ten seconds lets the watchdog reset the chip.

use defmt_rtt as _;
use imucal_core::link::LastReset;

/// How the run before ended.
pub fn started(last: &LastReset) {
    defmt::info!("started after {}, at {:#010x}; {} resets", last.cause, last.address, last.resets);
}

/// A panic of the HAL, before it resets the chip.
pub fn panicked(panic: &core::panic::PanicInfo<'_>) {
    defmt::error!("{}", defmt::Display2Format(panic));
}

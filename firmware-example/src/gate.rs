//! The panic gate.
#![allow(unsafe_code)] // One foreign function that does not exist.

use core::panic::PanicInfo;

#[cfg(not(any(feature = "rtt", feature = "log")))]
unsafe extern "C" {
    /// Defined nowhere: the linker asks for it where some code can still panic.
    fn imucal_a_panic_path_is_left() -> !;
}

/// On the real board, whose HAL can panic, and where defmt is, which can: a new start, with the record in flash.
#[cfg(any(feature = "rtt", feature = "log"))]
#[panic_handler]
fn panic(_panic: &PanicInfo) -> ! {
    #[cfg(feature = "rtt")]
    crate::log::panicked(_panic);
    cortex_m::peripheral::SCB::sys_reset()
}

#[cfg(not(any(feature = "rtt", feature = "log")))]
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    // SAFETY: no image in which this call is reachable links.
    unsafe { imucal_a_panic_path_is_left() }
}

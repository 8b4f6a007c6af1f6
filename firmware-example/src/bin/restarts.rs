//! Ends its run by each way there is, one after the other, and says after each reset how the run before ended.
#![cfg_attr(target_os = "none", no_std, no_main)]
#![cfg_attr(target_os = "none", allow(unsafe_code))] // A read of what is not there.

#[cfg(target_os = "none")]
#[firmware_example::entry]
fn main() -> ! {
    use core::fmt::Write;
    use firmware_example::{FAILED, console::Console, machine::reset};
    use imucal_core::link::ResetCause;

    let last = reset::last();
    let cause = match last.cause {
        ResetCause::PowerOn => "power",
        ResetCause::Unannounced => "unannounced",
        ResetCause::Fault => "fault",
        ResetCause::StackOverflow => "stack overflow",
        ResetCause::Watchdog => "watchdog",
        _ => "unknown",
    };
    let ways: [(&str, extern "C" fn()); 3] = [("read", read), ("descend", descend), ("hang", hang)];
    // The address lies in the first instructions of the function that ended the run.
    let at = ways.iter().find(|(_, way)| (last.address as usize).wrapping_sub(*way as usize & !1) < 64);
    let at = at.map_or("nowhere", |(name, _)| name);
    if writeln!(Console, "{} {cause} in {at}", last.resets).is_err() {
        semihosting::process::exit(FAILED)
    }
    match ways.get(last.resets as usize) {
        Some((_, way)) => way(),
        None => semihosting::process::exit(0),
    }
    semihosting::process::exit(FAILED)
}

/// Reads where there is no memory.
#[cfg(target_os = "none")]
#[inline(never)]
extern "C" fn read() {
    // SAFETY: none: the fault is what it is for.
    unsafe { (0xDFFF_FFF0 as *const u32).read_volatile() };
}

/// Descends until the stack is full.
#[cfg(target_os = "none")]
#[inline(never)]
extern "C" fn descend() {
    #[inline(never)]
    fn deeper(depth: u32) -> u32 {
        let room = core::hint::black_box([depth; 16]);
        if room.contains(&0) {
            return 0;
        }
        deeper(room.iter().fold(depth, |sum, word| sum.wrapping_add(*word))).wrapping_add(depth)
    }
    core::hint::black_box(deeper(core::hint::black_box(1)));
}

/// Does not feed the watchdog any more. The micro:bit of QEMU has none, and says so.
#[cfg(target_os = "none")]
#[inline(never)]
extern "C" fn hang() {
    if cfg!(microbit) {
        semihosting::process::exit(0);
    }
    let _watchdog = firmware_example::machine::Watchdog::start(200);
    loop {
        cortex_m::asm::nop();
    }
}

#[cfg(not(target_os = "none"))]
fn main() {}

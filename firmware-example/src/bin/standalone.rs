//! A session without a host: samples from a tape in the board's memory, a record in its flash, and lines by semihosting.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(all(target_os = "none", mps2))]
#[firmware_example::entry]
fn main() -> ! {
    use firmware_example::{FAILED, console::Console, machine, standalone};
    use imucal_core::record::SensorIdentity;

    let serial = option_env!("IMUCAL_SERIAL").unwrap_or_default();
    let unit = SensorIdentity {
        name: "emulated".parse().unwrap_or_default(),
        serial: serial.parse().unwrap_or_default(),
    };
    let written = standalone::run(place, &mut machine::MemoryTape, machine::flash(), &unit, &mut Console);
    semihosting::process::exit(if written.is_ok() { 0 } else { FAILED })
}

/// Puts the session where it stays.
#[cfg(all(target_os = "none", mps2))]
#[inline(never)]
#[expect(unsafe_code, reason = "memory of the session, which stays off the stack")]
fn place(
    settings: imucal_core::session::SessionSettings,
) -> &'static mut firmware_example::standalone::Standalone {
    use core::mem::MaybeUninit;
    use firmware_example::standalone::Standalone;
    static mut SESSION: MaybeUninit<Standalone> = MaybeUninit::uninit();
    // SAFETY: `run` calls this once, and nothing else knows the variable.
    let session = unsafe { &mut *(&raw mut SESSION) };
    session.write(Standalone::new(settings))
}

/// The other board has no memory for a session.
#[cfg(all(target_os = "none", not(mps2)))]
#[firmware_example::entry]
fn main() -> ! {
    semihosting::process::exit(firmware_example::FAILED)
}

#[cfg(not(target_os = "none"))]
fn main() {}

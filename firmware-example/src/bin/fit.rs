//! Fits simulated sets here, on a device as on a host, which must print the same; a device adds its stack.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[firmware_example::entry]
fn main() -> ! {
    use firmware_example::{
        FAILED,
        console::Console,
        fit::{self, FitMemory},
    };

    #[expect(unsafe_code, reason = "memory of the fits, as on the co-processor")]
    let memory = {
        static mut MEMORY: FitMemory = FitMemory::new();
        // SAFETY: the entry point runs once, and nothing else knows the variable.
        unsafe { &mut *(&raw mut MEMORY) }
    };
    let written = fit::write(&mut Console, memory).and_then(|()| gauge());
    semihosting::process::exit(if written.is_ok() { 0 } else { FAILED })
}

#[cfg(cortex_m)]
fn gauge() -> core::fmt::Result {
    use core::fmt::Write;
    let (used, there) = firmware_example::stack::deepest();
    writeln!(firmware_example::console::Console, "stack {used} of {there} B")
}

/// The start-up code of RISC-V paints no stack.
#[cfg(virt)]
fn gauge() -> core::fmt::Result {
    Ok(())
}

#[cfg(not(target_os = "none"))]
fn main() {
    let mut lines = String::new();
    let mut memory = firmware_example::fit::FitMemory::new();
    firmware_example::fit::write(&mut lines, &mut memory).expect("a String takes every line");
    print!("{lines}");
}

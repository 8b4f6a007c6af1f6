//! Fits simulated sets here, on a device as on a host, which must print the same; a device adds its stack.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    use core::fmt::Write;
    use firmware_example::{
        FAILED,
        console::Console,
        fit::{self, FitMemory},
        stack,
    };

    #[expect(unsafe_code, reason = "memory of the fits, as on the co-processor")]
    let memory = {
        static mut MEMORY: FitMemory = FitMemory::new();
        // SAFETY: the entry point runs once, and nothing else knows the variable.
        unsafe { &mut *(&raw mut MEMORY) }
    };
    let written = fit::write(&mut Console, memory).and_then(|()| {
        let (used, there) = stack::deepest();
        writeln!(Console, "stack {used} of {there} B")
    });
    semihosting::process::exit(if written.is_ok() { 0 } else { FAILED })
}

#[cfg(not(target_os = "none"))]
fn main() {
    let mut lines = String::new();
    let mut memory = firmware_example::fit::FitMemory::new();
    firmware_example::fit::write(&mut lines, &mut memory).expect("a String takes every line");
    print!("{lines}");
}

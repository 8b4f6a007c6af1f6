//! Prints what parts of the core take here, in ticks of a timer and bytes of stack.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[firmware_example::entry]
fn main() -> ! {
    use firmware_example::{FAILED, console::Console, cost};

    let written = cost::write(&mut Console);
    semihosting::process::exit(if written.is_ok() { 0 } else { FAILED })
}

#[cfg(not(target_os = "none"))]
fn main() {}

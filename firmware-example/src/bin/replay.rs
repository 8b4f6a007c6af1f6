//! Prints what the core computes here, on a device by semihosting; host and device must print the same.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[firmware_example::entry]
fn main() -> ! {
    use firmware_example::{FAILED, console::Console, replay};

    let written = replay::write(&mut Console);
    semihosting::process::exit(if written.is_ok() { 0 } else { FAILED })
}

#[cfg(not(target_os = "none"))]
fn main() {
    let mut lines = String::new();
    firmware_example::replay::write(&mut lines).expect("a String takes every line");
    print!("{lines}");
}

//! Fits all sensors here, on a device as on a host, which must print the same; a device adds its stack.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    use core::fmt::Write;
    use firmware_example::{FAILED, console::Console, fit, stack};

    let written = fit::write(&mut Console).and_then(|()| {
        let (used, there) = stack::deepest();
        writeln!(Console, "stack {used} of {there} B")
    });
    semihosting::process::exit(if written.is_ok() { 0 } else { FAILED })
}

#[cfg(not(target_os = "none"))]
fn main() {
    let mut lines = String::new();
    firmware_example::fit::write(&mut lines).expect("a String takes every line");
    print!("{lines}");
}

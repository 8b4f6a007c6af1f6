//! Start-up code, the record's bytes and exit: what the other images' sizes are compared with.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[firmware_example::entry]
fn main() -> ! {
    core::hint::black_box(firmware_example::RECORD);
    semihosting::process::exit(0)
}

#[cfg(not(target_os = "none"))]
fn main() {}

//! Prints what the core computes here, on a device by semihosting; host and device must print the same.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    use core::fmt::Write;

    /// Byte by byte: the stream types of `semihosting` can panic.
    struct Console;
    impl Write for Console {
        fn write_str(&mut self, text: &str) -> core::fmt::Result {
            text.bytes().for_each(semihosting::sys::arm_compat::sys_writec);
            Ok(())
        }
    }

    let written = firmware_example::replay::write(&mut Console);
    semihosting::process::exit(if written.is_ok() { 0 } else { firmware_example::FAILED })
}

#[cfg(not(target_os = "none"))]
fn main() {
    let mut lines = String::new();
    firmware_example::replay::write(&mut lines).expect("a String takes every line");
    print!("{lines}");
}

//! Text to the host by semihosting.

use core::fmt;

/// Byte by byte: the stream types of `semihosting` can panic.
#[derive(Clone, Copy, Debug)]
pub struct Console;

impl fmt::Write for Console {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        text.bytes().for_each(semihosting::sys::arm_compat::sys_writec);
        Ok(())
    }
}

//! The co-processor: keeps a record, corrects, fits and stores, at the end of a UART.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    // A real unit reads its serial where it was written when it was made.
    firmware_example::machine::run("emulated", option_env!("IMUCAL_SERIAL").unwrap_or_default())
}

#[cfg(not(target_os = "none"))]
fn main() {}

//! The co-processor: keeps a record, corrects, fits and stores, at the end of a UART.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[firmware_example::entry]
fn main() -> ! {
    // A real unit reads serial and key where they were written when it was made.
    let serial = option_env!("IMUCAL_SERIAL").unwrap_or_default();
    firmware_example::machine::run("emulated", serial, key())
}

#[cfg(all(target_os = "none", not(feature = "key")))]
fn key() -> Option<&'static imucal_core::link::Key> {
    None
}

/// 64 hexadecimal digits, given at build time.
#[cfg(all(target_os = "none", feature = "key"))]
fn key() -> Option<&'static imucal_core::link::Key> {
    use imucal_core::link::Key;
    const DIGITS: &str = match option_env!("IMUCAL_KEY") {
        Some(digits) => digits,
        None => panic!("set IMUCAL_KEY to the unit's key: 64 hexadecimal digits"),
    };
    static KEY: Key = Key::from_hex(DIGITS).expect("IMUCAL_KEY is not 64 hexadecimal digits");
    Some(&KEY)
}

#[cfg(not(target_os = "none"))]
fn main() {}

//! Reads the record and corrects a sample in integers: the least that a device without a floating-point unit does.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[firmware_example::entry]
fn main() -> ! {
    use core::hint::black_box;
    use firmware_example::{FAILED, RECORD, correct};

    // `black_box` keeps the compiler from computing the answer itself.
    let status = match correct::accelerometer_in_integers(black_box(RECORD), black_box("00300017")) {
        None => FAILED,
        Some(mut compensator) => {
            compensator.set_temperature(black_box(31.0));
            black_box(correct::apply_in_integers(compensator.corrector(), black_box([32_768; 3])));
            0
        }
    };
    semihosting::process::exit(status)
}

#[cfg(not(target_os = "none"))]
fn main() {}

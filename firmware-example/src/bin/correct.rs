//! Reads the record and corrects a sample: the least a device does, and what that takes of its memory.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[firmware_example::entry]
fn main() -> ! {
    use core::hint::black_box;
    use firmware_example::{FAILED, RECORD, correct};
    use imucal_core::corrector::Compensator;
    use nalgebra::Vector3;

    // `black_box` keeps the compiler from computing the answer itself.
    let status = match correct::accelerometer(black_box(RECORD), black_box("00300017")) {
        None => FAILED,
        Some(corrector) => {
            let raw = black_box(Vector3::repeat(32_768.0));
            black_box(correct::apply(&corrector, &raw));
            let mut compensator = Compensator::new(corrector);
            black_box(correct::apply_at(&mut compensator, &raw, black_box(31.0)));
            0
        }
    };
    semihosting::process::exit(status)
}

#[cfg(not(target_os = "none"))]
fn main() {}

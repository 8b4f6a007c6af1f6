//! Calls every public function of the core, so that the link proves it free of panics and of an allocator.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[firmware_example::entry]
fn main() -> ! {
    let status = if runs() { 0 } else { firmware_example::FAILED };
    semihosting::process::exit(status)
}

/// `black_box` keeps the compiler from computing the answer itself.
#[cfg(target_os = "none")]
fn runs() -> bool {
    use core::hint::black_box;
    use firmware_example::{RECORD, correct, search, surface};
    use imucal_core::{corrector::Compensator, record};
    use nalgebra::Vector3;

    #[cfg(feature = "control-panic")]
    let _ = black_box(RECORD[black_box(7)]);

    let Some(corrector) = correct::accelerometer(black_box(RECORD), black_box("00300017")) else {
        return false;
    };
    let raw = black_box(Vector3::repeat(32_768.0));
    black_box(correct::apply(&corrector, &raw));
    let mut compensator = Compensator::new(corrector);
    black_box(correct::apply_at(&mut compensator, &raw, black_box(31.0)));

    if !search::gyroscope(black_box(3)) {
        return false;
    }

    surface::reach_all();

    let mut page = [0xFF; record::MAX_LEN];
    record::decode(black_box(RECORD))
        .is_ok_and(|record| record::encode(black_box(&record), &mut page) == Ok(RECORD))
}

#[cfg(not(target_os = "none"))]
fn main() {}

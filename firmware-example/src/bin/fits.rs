//! Reads a record, corrects, and fits, judges and packs every model: what a device that does all this takes of its
//! flash, without a link and without text.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[firmware_example::entry]
fn main() -> ! {
    use core::hint::black_box;
    use firmware_example::{
        FAILED, RECORD, correct,
        fitting::{Fitting, Memory},
    };
    use imucal_core::{
        corrector::Compensator,
        link::{FitTask, Observation},
        record::{self, Date},
    };
    use nalgebra::Vector3;

    type FitsMemory = Memory<200, 40, 48, 1000, 40>;
    #[expect(unsafe_code, reason = "memory of the fits, as on the co-processor")]
    let memory = {
        static mut MEMORY: FitsMemory = FitsMemory::new();
        // SAFETY: the entry point runs once, and nothing else knows the variable.
        unsafe { &mut *(&raw mut MEMORY) }
    };
    // Whatever comes from outside is hidden from the compiler.
    let mut fitting = Fitting::new(memory);
    let task: Option<FitTask> = black_box(None);
    let observations: &[Observation] = black_box(&[]);
    if let Some(corrector) = correct::accelerometer(black_box(RECORD), black_box("00300017")) {
        let raw = black_box(Vector3::repeat(32_768.0));
        black_box(correct::apply(&corrector, &raw));
        let mut compensator = Compensator::new(corrector);
        black_box(correct::apply_at(&mut compensator, &raw, black_box(31.0)));
    }
    if let Some(task) = task {
        let _begun = black_box(fitting.begin(task));
        for observation in observations {
            let _taken = black_box(fitting.take(observation));
        }
        while !fitting.step() {}
        if let (Ok(finished), Ok(mut record)) = (fitting.finish(), record::decode(black_box(RECORD))) {
            black_box(&finished.report);
            record.acc = finished.accepted.map(|(_, triad)| triad);
            record.date = Date::from_days(1);
            let mut page = [0xFF; record::MAX_LEN];
            let _bytes = black_box(record::encode(&record, &mut page));
        }
    }
    semihosting::process::exit(if black_box(true) { 0 } else { FAILED })
}

#[cfg(not(target_os = "none"))]
fn main() {}

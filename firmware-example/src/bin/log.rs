//! Logs what the core says of itself by defmt, over semihosting: a record, a fit and a refusal.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[firmware_example::entry]
fn main() -> ! {
    use defmt_semihosting as _;
    use firmware_example::{
        RECORD, drill,
        fitting::{Fitting, Memory},
        scene::Noise,
    };
    use imucal_core::{link::FitModel, record};

    match record::decode(RECORD) {
        Ok(record) => defmt::info!("record of {}, {}", record.sensor.serial, record.date),
        Err(error) => defmt::error!("no record: {}", error),
    }
    if let Err(error) = record::decode(&[0xFF; 64]) {
        defmt::warn!("an erased page: {}", error);
    }
    let mut memory = Memory::<48, 0, 0, 0, 0>::new();
    let mut fitting = Fitting::new(&mut memory);
    for count in [40, 8] {
        if fitting.begin(drill::task(FitModel::T9)).is_err() {
            continue;
        }
        drill::observe(FitModel::T9, count, &mut Noise(1), |observation| {
            if let Err(fault) = fitting.take(&observation) {
                defmt::error!("not taken: {}", fault);
            }
        });
        while !fitting.step() {
            defmt::debug!("{}", fitting.progress());
        }
        if let Ok(finished) = fitting.finish() {
            let report = finished.report;
            defmt::info!("{} of {} rests: {}, {}", report.model, count, report.termination, report.refusal);
        }
    }
    semihosting::process::exit(0)
}

#[cfg(not(target_os = "none"))]
fn main() {}

//! The least a device does: reads its record once, then corrects samples.
//!
//! `cargo run -p imucal-core --example correct`

use std::error::Error;

use imucal_core::{
    corrector::Corrector,
    record::{self, Match},
};
use nalgebra::Vector3;

/// A record as it would lie in flash.
const FLASH: &[u8] = include_bytes!("../tests/golden/record-1.0.bin");

fn main() -> Result<(), Box<dyn Error>> {
    let record = record::decode(FLASH)?;
    if record.made_for("00300017").map_err(|wrong| wrong.to_string())? == Match::Unknown {
        println!("the record or the unit has no serial number");
    }
    let acc = record.acc.as_ref().ok_or("the record has no accelerometer")?;
    let corrector: Corrector<f32> = acc.into();
    let raw = Vector3::new(33_000.0, 32_500.0, 28_400.0);
    println!("{:?} {} is", raw.as_slice(), acc.unit_in.symbol());
    println!("{:?} {}", corrector.apply(&raw).as_slice(), acc.unit_out.symbol());
    Ok(())
}

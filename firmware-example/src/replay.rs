//! The lines that host and device must print alike: the record, and samples corrected by it, in bits.

use core::fmt::{self, Write};

use imucal_core::corrector::Corrector;
use imucal_core::record::{self, TriadRecord};
use nalgebra::Vector3;

/// Temperatures of the samples, °C; NaN is a dead thermometer.
const TEMPERATURES: [f32; 4] = [25.0, -40.0, 61.7, f32::NAN];

/// Raw samples for each temperature, over the range of a 16-bit converter.
const SAMPLES: u16 = 16;

/// Decodes the record, corrects samples with and without temperature, and writes the bits of each result.
///
/// # Errors
///
/// Those of `out`. A record that cannot be read is a line, and not an error.
pub fn write(out: &mut impl Write) -> fmt::Result {
    let record = match record::decode(crate::RECORD) {
        Ok(record) => record,
        Err(error) => return writeln!(out, "record refused: {error}"),
    };
    writeln!(out, "record {} {} {}", record.sensor.name, record.sensor.serial, record.date)?;
    let mut page = [0xFF; record::MAX_LEN];
    let same = record::encode(&record, &mut page) == Ok(crate::RECORD);
    writeln!(out, "encoded {}", if same { "alike" } else { "otherwise" })?;
    for (sensor, triad) in record.triads() {
        write_triad(out, sensor.symbol(), triad)?;
    }
    Ok(())
}

fn write_triad(out: &mut impl Write, sensor: &str, triad: &TriadRecord) -> fmt::Result {
    let corrector = Corrector::<f32>::from(triad);
    for temperature in TEMPERATURES {
        for sample in 0..SAMPLES {
            let raw = sample_at(sample);
            write_bits(out, sensor, "apply", &corrector.apply(&raw))?;
            write_bits(out, sensor, "apply_at", &corrector.apply_at(&raw, temperature))?;
        }
    }
    Ok(())
}

/// Counts that visit the range without a pattern: an odd multiplier permutes the 16-bit numbers.
fn sample_at(sample: u16) -> Vector3<f32> {
    let count = |axis: u16| f32::from(sample.wrapping_mul(3).wrapping_add(axis).wrapping_mul(40_503));
    Vector3::new(count(0), count(1), count(2))
}

fn write_bits(out: &mut impl Write, sensor: &str, call: &str, value: &Vector3<f32>) -> fmt::Result {
    let [x, y, z] = <[f32; 3]>::from(*value).map(f32::to_bits);
    writeln!(out, "{sensor} {call} {x:08x} {y:08x} {z:08x}")
}

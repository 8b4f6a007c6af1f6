//! The lines that host and device must print alike: the record, and samples corrected by it, in bits.

use core::fmt::{self, Write};

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use imucal_core::corrector::{Corrector, FullCorrector};
use imucal_core::integer::{self, IntegerCompensator};
use imucal_core::record::{self, HigherOrder, RawUnit, TriadRecord};
use nalgebra::Vector3;

use crate::scene::Noise;

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
    write_first_order(out)?;
    write_higher_order(out)?;
    write_arithmetic(out)
}

/// Out of line, as the next: a record takes kilobytes of stack only while it is looked at.
#[inline(never)]
fn write_first_order(out: &mut impl Write) -> fmt::Result {
    let record = match record::decode(crate::RECORD) {
        Ok(record) => record,
        // Without its reason, whose figures core formats by code that can panic.
        Err(_) => return writeln!(out, "record refused"),
    };
    writeln!(out, "record {} {} {}", record.sensor.name, record.sensor.serial, record.date)?;
    let mut page = [0xFF; record::MAX_LEN];
    let same = record::encode(&record, &mut page) == Ok(crate::RECORD);
    writeln!(out, "encoded {}", if same { "alike" } else { "otherwise" })?;
    for (sensor, triad) in record.triads() {
        write_triad(out, sensor.symbol(), triad)?;
        write_many(out, sensor.symbol(), triad)?;
        write_integers(out, sensor.symbol(), triad)?;
    }
    Ok(())
}

/// Samples corrected by a record with all terms there are, and what is predicted of them.
#[inline(never)]
fn write_higher_order(out: &mut impl Write) -> fmt::Result {
    let Ok(record) = record::decode_as::<HigherOrder>(crate::RECORD_2) else {
        return writeln!(out, "record refused");
    };
    for (sensor, triad) in record.triads() {
        let Ok(corrector) = FullCorrector::<f32>::try_from(triad) else {
            return writeln!(out, "{} is too steep", sensor.symbol());
        };
        for temperature in TEMPERATURES {
            for sample in 0..SAMPLES {
                let corrected = corrector.apply_at(&sample_at(sample), temperature);
                write_bits(out, sensor.symbol(), "full", &corrected)?;
                if let Some(raw) = corrector.predict_at(&corrected, temperature) {
                    write_bits(out, sensor.symbol(), "predicted", &raw)?;
                }
            }
        }
    }
    Ok(())
}

/// Lines of [`write_arithmetic`], and pairs of operands of each.
const ARITHMETIC_LINES: u32 = 20;
/// See above.
const PAIRS_A_LINE: u32 = 100_000;

/// Sums, differences and products of single numbers, folded: every kind of number, and many ties and near zeros.
#[inline(never)]
fn write_arithmetic(out: &mut impl Write) -> fmt::Result {
    let mut bits = 2_463_534_242;
    for _ in 0..ARITHMETIC_LINES {
        let mut folded = 0u32;
        for _ in 0..PAIRS_A_LINE {
            let (a, b) = operands(&mut bits);
            for result in [a + b, a - b, a * b] {
                // What sign and payload a NaN has is left to the machine.
                let seen = if result.is_nan() { 1 } else { result.to_bits() };
                folded = (folded ^ seen).wrapping_mul(16_777_619).rotate_left(5);
            }
        }
        writeln!(out, "{PAIRS_A_LINE} pairs {folded:08x}")?;
    }
    Ok(())
}

/// Two numbers of any bits; or alike in their exponent, and of few digits.
fn operands(state: &mut u32) -> (f32, f32) {
    let mut next = || {
        *state ^= *state << 13;
        *state ^= *state >> 17;
        *state ^= *state << 5;
        *state
    };
    let (kind, a, mut b) = (next(), next(), next());
    if kind & 3 == 0 {
        return (f32::from_bits(a), f32::from_bits(b));
    }
    let apart = (kind >> 2 & 31).wrapping_sub(4) << 23;
    b = b & 0x807F_FFFF | (a & 0x7F80_0000).wrapping_add(apart) & 0x7F80_0000;
    let digits = u32::MAX << (kind >> 8 & 31).min(22);
    (f32::from_bits(a & digits), f32::from_bits(if kind & 128 == 0 { b } else { b & digits }))
}

/// Lines of [`write_many`], and samples of each.
const LINES: u32 = 10;
/// See above.
const SAMPLES_A_LINE: u32 = 10_000;

/// A checksum over the bits of each ten thousand samples and what is made of them, with and without temperature.
fn write_many(out: &mut impl Write, sensor: &str, triad: &TriadRecord) -> fmt::Result {
    const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);
    let corrector = Corrector::<f32>::from(triad);
    let mut noise = Noise(1);
    for line in 0..LINES {
        let mut digest = CRC.digest();
        for sample in 0..SAMPLES_A_LINE {
            let raw = noise.vector(32_768.0);
            let temperature = 25.0 + noise.vector(60.0).x;
            let at = faulty(line, sample, corrector.apply_at(&raw, temperature));
            let both = corrector.apply(&raw).iter().chain(at.iter()).fold([0u8; 24], |mut all, value| {
                all.rotate_left(4);
                if let Some(end) = all.last_chunk_mut() {
                    *end = value.to_bits().to_le_bytes();
                }
                all
            });
            digest.update(&both);
        }
        writeln!(out, "{sensor} {SAMPLES_A_LINE} samples {:08x}", digest.finalize())?;
    }
    Ok(())
}

/// The result; with the feature `control-ulp`, one of them off by one unit in the last place.
fn faulty(line: u32, sample: u32, value: Vector3<f32>) -> Vector3<f32> {
    if cfg!(feature = "control-ulp") && (line, sample) == (7, 4_321) {
        Vector3::new(value.x, value.y.next_up(), value.z)
    } else {
        value
    }
}

/// All counts of each axis in integers, folded, at each temperature.
fn write_integers(out: &mut impl Write, sensor: &str, record: &TriadRecord) -> fmt::Result {
    // Words of an unsigned converter; the other's milligauss are taken for counts.
    let middle = if record.unit_in == RawUnit::Counts { -32_768.0 } else { 0.0 };
    let (triad, terms) = (record.triad::<f32>().in_unit(middle, 1.0), record.temperature);
    let corrector = integer::finest(&triad, terms.as_ref())
        .and_then(|finest| IntegerCompensator::new(&triad, terms.as_ref(), finest));
    let Ok(mut compensator) = corrector else { return writeln!(out, "{sensor} integers refused") };
    for temperature in TEMPERATURES {
        compensator.set_temperature(temperature);
        let mut folded = 0u32;
        for count in i16::MIN..=i16::MAX {
            // Odd multipliers permute the counts.
            let raw = [count, count.wrapping_mul(25_173), count.wrapping_mul(-25_033)];
            folded = compensator.apply(raw).iter().fold(folded, |folded, axis| {
                (folded ^ axis.cast_unsigned()).wrapping_mul(16_777_619).rotate_left(5)
            });
        }
        let fraction = compensator.corrector().fraction();
        writeln!(out, "{sensor} integers of 2^-{fraction} {folded:08x}")?;
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

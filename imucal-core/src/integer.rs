//! The per-sample correction in integers, for a part without a floating-point unit: counts of 16 bits in, a fixed point
//! of 32 bits out.
//!
//! ```text
//! f ∘ gain · (raw − b) = (Σ c · raw + k) · 2^−(q+15)      k = −Σ c · b
//! c                    = h · 2¹⁵ + l                      |l| ≤ 2¹⁴
//! out                  = ((k_l + Σ l · raw) ≫ 15) + k_h + Σ h · raw
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | raw | counts of the converter, −32768 to 32767, sensor axes |
//! | f, b | scale and bias at a temperature, as [`crate::temperature`] has them; 1 and the bias at the reference |
//! | c, h, l | an entry of the gain as an integer, its high part of up to 17 bits and its low part of 15 |
//! | k, k_h, k_l | what the bias comes to, with half a unit of `out` for the rounding, and its two parts |
//! | out | one calibrated axis, in units of 2^−q of the calibrated unit |
//! | q | [`fraction`](IntegerCorrector::fraction): bits behind the point |
//!
//! No product of a sample leaves 32 bits, since all that a Cortex-M0 multiplies is 32 by 32 to 32. `tests/device_cost.rs`
//! asserts what a sample costs, and that it calls no function. What is computed once, or for a new temperature, is
//! computed in integers too, of 64 bits: a triad comes in as floating-point numbers, but none is added or multiplied.
//!
//! # Scale
//!
//! The caller gives q, so that all units of a product share one scale, whatever their calibration. One that could overflow
//! is refused, for any counts and, with temperature terms, any reading that is heeded: [`finest`] is the largest q that
//! cannot.
//!
//! | sensor, 16 bits | q | unit of `out` | [`bound`](IntegerCorrector::bound) |
//! | --- | --- | --- | --- |
//! | accelerometer, ±16 g | 22 | 2.4e-7 m/s² | 4.8e-7 m/s² |
//! | gyroscope, ±2000 °/s | 24 | 6.0e-8 rad/s | 1.2e-7 rad/s |
//! | magnetometer, ±4900 µT | 17 | 7.6e-6 µT | 1.5e-5 µT |
//!
//! # Error
//!
//! Against the same correction without rounding, in units of `out`: half a unit for each of three entries of the gain, which are
//! rounded to 2⁻¹⁵ and multiplied by up to 2¹⁵ counts; half for the result; 2⁻¹² for all else. They add up to the bound. The
//! test `no_counts_whatever_leave_the_bound` goes through all counts of each axis.
//!
//! # What it does not carry
//!
//! Raw samples that are not counts of 16 bits ([`Triad::in_unit`] takes a triad to counts), and whatever a record holds
//! beyond gain, bias and first-order temperature terms.

mod fixed;
mod refusal;

pub use fixed::finest;
pub use refusal::IntegerRefusal;

use nalgebra::Vector3;

use crate::record::{FirstOrder, RawUnit, TriadRecord};
use crate::scalar::Scalar;
use crate::temperature::TemperatureTerms;
use crate::triad::Triad;

use fixed::{FixedTriad, LOW, power};

/// The largest error of a result, units of it.
const BOUND: f64 = 2.0 + 1.0 / 4096.0;

/// Turns counts of one triad into calibrated values, in integers alone.
///
/// ```
/// use imucal_core::integer::IntegerCorrector;
/// use imucal_core::triad::Triad;
/// use nalgebra::{Matrix3, Vector3};
///
/// // 2048 counts for 1 g, in m/s².
/// let triad = Triad { gain: Matrix3::from_diagonal_element(9.80665 / 2048.0), bias: Vector3::new(10.0, -20.0, 30.0) };
/// let corrector = IntegerCorrector::new(&triad, 22)?;
/// let up = corrector.apply([10, -20, 30 + 2048]);
/// assert_eq!(up, [0, 0, 41_132_071]); // 9.80665 · 2²², rounded
/// assert!((corrector.value(up).z - 9.80665).abs() <= corrector.bound());
/// # Ok::<(), imucal_core::integer::IntegerRefusal>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IntegerCorrector {
    rows: [Row; 3],
    fraction: i8,
}

impl IntegerCorrector {
    /// From a triad of counts, with `fraction` bits behind the point.
    ///
    /// # Errors
    ///
    /// As [`finest`] has them, and [`IntegerRefusal::TooFine`] where `fraction` is above it.
    pub fn new<T: Scalar>(triad: &Triad<T>, fraction: i8) -> Result<Self, IntegerRefusal> {
        Ok(Self { rows: FixedTriad::new(triad, None, fraction)?.rows(), fraction })
    }

    /// From a record of signed counts, as at its reference temperature.
    ///
    /// # Errors
    ///
    /// As of [`new`](Self::new), and [`IntegerRefusal::NotCounts`].
    pub fn from_record(record: &TriadRecord, fraction: i8) -> Result<Self, IntegerRefusal> {
        let (triad, _) = of_counts(record)?;
        Self::new(&triad, fraction)
    }

    /// Raw counts, sensor axes, to calibrated axes in units of 2^−[`fraction`](Self::fraction) of the calibrated unit.
    #[inline]
    pub fn apply(&self, raw: [i16; 3]) -> [i32; 3] {
        let ([x, y, z], [p, q, r]) = (raw, &self.rows);
        let (x, y, z) = (x.into(), y.into(), z.into());
        [p.correct(x, y, z), q.correct(x, y, z), r.correct(x, y, z)]
    }

    /// Bits behind the point of a result; below zero where a result is a multiple of the calibrated unit.
    pub fn fraction(&self) -> i8 {
        self.fraction
    }

    /// A result in the calibrated unit, exactly.
    pub fn value(&self, corrected: [i32; 3]) -> Vector3<f64> {
        let unit = power(-i32::from(self.fraction));
        Vector3::from(corrected.map(|axis| f64::from(axis) * unit))
    }

    /// The largest error of an axis, calibrated unit, against the same correction without any rounding.
    pub fn bound(&self) -> f64 {
        BOUND * power(-i32::from(self.fraction))
    }
}

/// A corrector in integers that follows the temperature: what depends on that is computed again for a new reading.
///
/// A reading costs as much as dozens of samples (`tests/device_cost.rs`): one a second is plenty for what warms up in
/// minutes. A sample costs what it does without.
///
/// ```
/// use imucal_core::integer::IntegerCompensator;
/// use imucal_core::temperature::TemperatureTerms;
/// use imucal_core::triad::Triad;
///
/// let terms = TemperatureTerms { reference: 25.0, bias_slope: [0.5; 3], scale_slope: [0.0; 3] };
/// let mut compensator = IntegerCompensator::new(&Triad::identity(), Some(&terms), 8)?;
/// compensator.set_temperature(27.0);
/// assert_eq!(compensator.apply([3; 3]), [2 * 256; 3]);
/// # Ok::<(), imucal_core::integer::IntegerRefusal>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntegerCompensator {
    corrector: IntegerCorrector,
    triad: FixedTriad,
    /// The last reading, °C; not a number before the first.
    temperature: f32,
}

impl IntegerCompensator {
    /// From a triad of counts and its dependence on temperature, as at the reference, with `fraction` bits behind the
    /// point.
    ///
    /// # Errors
    ///
    /// As of [`IntegerCorrector::new`].
    pub fn new<T: Scalar>(
        triad: &Triad<T>,
        terms: Option<&TemperatureTerms<T>>,
        fraction: i8,
    ) -> Result<Self, IntegerRefusal> {
        let triad = FixedTriad::new(triad, terms, fraction)?;
        let corrector = IntegerCorrector { rows: triad.rows(), fraction };
        Ok(Self { corrector, triad, temperature: f32::NAN })
    }

    /// From a record of signed counts.
    ///
    /// # Errors
    ///
    /// As of [`IntegerCorrector::from_record`].
    pub fn from_record(record: &TriadRecord, fraction: i8) -> Result<Self, IntegerRefusal> {
        let (triad, terms) = of_counts(record)?;
        Self::new(&triad, terms.as_ref(), fraction)
    }

    /// Follows the thermometer, °C. Nothing is computed where the reading is the one before, or without terms.
    ///
    /// A reading that is not finite, or further than 256 K from the reference, counts as the reference.
    pub fn set_temperature(&mut self, temperature: f32) {
        if !temperature.same(self.temperature) {
            self.temperature = temperature;
            if let Some(rows) = self.triad.rows_at(temperature) {
                self.corrector.rows = rows;
            }
        }
    }

    /// As [`IntegerCorrector::apply`], at the last reading.
    #[inline]
    pub fn apply(&self, raw: [i16; 3]) -> [i32; 3] {
        self.corrector.apply(raw)
    }

    /// The corrector at the last reading: its scale and bound are those of every reading.
    pub fn corrector(&self) -> &IntegerCorrector {
        &self.corrector
    }
}

/// One calibrated axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Row {
    /// k_h, then h of each raw axis.
    high: [i32; 4],
    /// k_l, then l of each raw axis.
    low: [i32; 4],
}

impl Row {
    /// No sum or product leaves 32 bits: see [`finest`].
    #[inline]
    fn correct(&self, x: i32, y: i32, z: i32) -> i32 {
        // By reference: a Cortex-M0 has no registers to copy eight numbers to.
        let Self { high: [k, a, b, c], low: [rest, d, e, f] } = self;
        let low = *rest + *d * x + *e * y + *f * z;
        (low >> LOW) + *k + *a * x + *b * y + *c * z
    }
}

/// What integers correct by, where the record's samples are counts.
fn of_counts(record: &TriadRecord) -> Result<(Triad<f32>, Option<TemperatureTerms<f32>>), IntegerRefusal> {
    // Named one by one: whatever else a record comes to hold is to be carried or refused here.
    let TriadRecord {
        gain: _,
        bias: _,
        unit_in,
        unit_out: _,
        model: _,
        temperature,
        quality: _,
        order: FirstOrder,
    } = record;
    match *unit_in {
        RawUnit::Counts => Ok((record.triad(), *temperature)),
        unit => Err(IntegerRefusal::NotCounts { unit }),
    }
}

#[cfg(test)]
mod tests;

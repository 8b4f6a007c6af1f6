//! What integers correct by, computed in a fixed point of 64 bits: rows at a temperature, and the scale they allow.
//!
//! A floating-point number is taken apart into its bits. Products of two of these numbers keep 128 bits on the way.
//! Each is precise to far less than what it contributes to the bound:
//!
//! | number | bits behind the point | largest |
//! | --- | --- | --- |
//! | entry of the gain, units of 2^−(q+15) a count | 20 | 2³¹ |
//! | bias, counts | 32 | 2¹⁷ |
//! | its slope, counts/K | 40 | 256 |
//! | slope of the scale, 1/K | 56 | 1/64 |
//! | scale | 48 | 5 |
//! | temperature, °C, and its change, K | 40 | 512, 256 |
//!
//! A product loses 48 bits, so that those of the scale leave the other's point where it was.

use super::{IntegerRefusal, Row};
use crate::scalar::Scalar;
use crate::temperature::TemperatureTerms;
use crate::triad::Triad;

/// Bits of a low part: with one more, three products of a low part and a count would leave 32 bits.
pub(super) const LOW: i32 = 15;
/// Bits behind the point of an entry of the gain.
const GAIN: i32 = 20;
/// See above.
const BIAS: i32 = 32;
/// See above.
const BIAS_SLOPE: i32 = 40;
/// See above.
const SCALE_SLOPE: i32 = 56;
/// See above; and what a product loses.
const SCALE: i32 = 48;
/// See above.
const TEMPERATURE: i32 = 40;

/// The largest count, by magnitude, with the point of a bias.
const LARGEST_COUNT: i64 = 1 << (15 + BIAS);
/// The largest bias, three quarters of that: beyond it the zero input of an unsigned converter is likelier than one of a
/// signed.
const LARGEST_BIAS: i64 = LARGEST_COUNT / 4 * 3;
/// The largest slope of a bias, 256 counts/K, and of a scale, 1/64 per kelvin: more than `record::plausibility` takes for one
/// of a sensor.
const LARGEST_BIAS_SLOPE: i64 = 1 << (8 + BIAS_SLOPE);
/// See above.
const LARGEST_SCALE_SLOPE: i64 = 1 << (SCALE_SLOPE - 6);
/// The largest reference temperature, 512 °C.
const LARGEST_TEMPERATURE: i64 = 1 << (9 + TEMPERATURE);
/// A reading of the thermometer is heeded up to here from the reference, 256 K: wide of all that silicon works at.
const SPAN: i64 = 1 << (8 + TEMPERATURE);

/// A triad of counts, and what warmth makes of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FixedTriad {
    gain: [[i64; 3]; 3],
    bias: [i64; 3],
    terms: Option<FixedTerms>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct FixedTerms {
    reference: i64,
    bias_slope: [i64; 3],
    scale_slope: [i64; 3],
}

impl FixedTriad {
    pub(super) fn new<T: Scalar>(
        triad: &Triad<T>,
        terms: Option<&TemperatureTerms<T>>,
        fraction: i8,
    ) -> Result<Self, IntegerRefusal> {
        let finest = finest(triad, terms)?;
        if fraction > finest {
            return Err(IntegerRefusal::TooFine { fraction, finest });
        }
        let (bias, terms) = offsets(triad, terms)?;
        // None of them is refused: at the finest scale they stay below 2³¹.
        let gain = rows_of(triad, i32::from(fraction) + LOW + GAIN)?;
        Ok(Self { gain, bias, terms })
    }

    /// At the reference temperature.
    pub(super) fn rows(&self) -> [Row; 3] {
        self.rows_by(&self.bias, &[1 << SCALE; 3])
    }

    /// At a temperature, °C; `None` without terms.
    pub(super) fn rows_at(&self, temperature: f32) -> Option<[Row; 3]> {
        let FixedTerms { reference, bias_slope, scale_slope } = self.terms.as_ref()?;
        let change = fixed_point(temperature.wide(), TEMPERATURE).map_or(0, |reading| reading - reference);
        let change = if change.abs() <= SPAN { change } else { 0 };
        let ([x, y, z], [u, v, w]) = (self.bias, bias_slope.map(|slope| product(slope, change)));
        let scale = scale_slope.map(|slope| (1 << SCALE) + product(slope, change));
        Some(self.rows_by(&[x + u, y + v, z + w], &scale))
    }

    fn rows_by(&self, [x, y, z]: &[i64; 3], scale: &[i64; 3]) -> [Row; 3] {
        let row = |gain: &[i64; 3], scale: i64| {
            let [a, b, c] = gain.map(|entry| product(entry, scale));
            Row::of([a, b, c], -(product(a, *x) + product(b, *y) + product(c, *z)))
        };
        let ([p, q, r], [u, v, w]) = (&self.gain, *scale);
        [row(p, u), row(q, v), row(r, w)]
    }
}

impl Row {
    /// From c and k, with the bits behind the point of an entry, and of its product with a bias.
    fn of(gain: [i64; 3], constant: i64) -> Self {
        let half = 1 << (LOW - 1);
        let [(a, d), (b, e), (c, f)] = gain.map(|entry| {
            let whole = rounded(entry, GAIN);
            let high = (whole + half) >> LOW;
            (high as i32, (whole - (high << LOW)) as i32)
        });
        let constant = rounded(constant, GAIN + BIAS - SCALE) + half;
        let high = constant >> LOW;
        Self { high: [high as i32, a, b, c], low: [(constant - (high << LOW)) as i32, d, e, f] }
    }
}

/// Most bits behind the point with which no counts, and with temperature terms no reading that is heeded, overflow 32 bits.
///
/// # Errors
///
/// [`NotFinite`](IntegerRefusal::NotFinite), [`BiasOutOfRange`](IntegerRefusal::BiasOutOfRange),
/// [`TermOutOfRange`](IntegerRefusal::TermOutOfRange), and [`TooLarge`](IntegerRefusal::TooLarge) where no scale fits.
pub fn finest<T: Scalar>(
    triad: &Triad<T>,
    terms: Option<&TemperatureTerms<T>>,
) -> Result<i8, IntegerRefusal> {
    if !triad.is_finite() || !terms.is_none_or(TemperatureTerms::is_finite) {
        return Err(IntegerRefusal::NotFinite);
    }
    let (bias, terms) = offsets(triad, terms)?;
    let terms = terms.unwrap_or(FixedTerms { reference: 0, bias_slope: [0; 3], scale_slope: [0; 3] });
    // The interval of each bias and scale; a slope times the span has the point of what it is added to.
    let ([x, y, z], [u, v, w]) = (bias, terms.bias_slope);
    let reach = [(x, u), (y, v), (z, w)].map(|(bias, slope)| LARGEST_COUNT + bias.abs() + slope.abs());
    let scale = terms.scale_slope.map(|slope| (1 << SCALE) + slope.abs());
    // The largest entry has 37 bits.
    let largest = triad.gain.iter().map(|entry| exponent(entry.wide())).fold(i32::MIN, i32::max);
    let ([p, q, r], [u, v, w]) = (rows_of(triad, 36 - largest)?, scale);
    let parts = [(p, u), (q, v), (r, w)].map(|([a, b, c], scale)| {
        let ([a, b, c], [x, y, z]) = ([a, b, c].map(|entry| entry.abs() + 1), reach);
        product(product(a, x) + product(b, y) + product(c, z) + 3, scale) + 1
    });
    let largest_part = parts.into_iter().fold(0, i64::max);
    // Rounding c, h, k and k_h, and what is carried from below, come to 98 310 units of `out`, less than 2⁻¹⁴ of 2³¹.
    let widened = largest_part + (largest_part >> 14) + 1;
    // Where `widened` has its point: entries are multiples of 2^(largest − 36).
    let behind = 36 - largest + BIAS - SCALE;
    let power = 64 - widened.leading_zeros() as i32 - behind;
    let fraction = 31 - power;
    if fraction < i32::from(i8::MIN) {
        return Err(IntegerRefusal::TooLarge { power });
    }
    Ok(i8::try_from(fraction).unwrap_or(i8::MAX))
}

/// Bias and terms.
fn offsets<T: Scalar>(
    triad: &Triad<T>,
    terms: Option<&TemperatureTerms<T>>,
) -> Result<([i64; 3], Option<FixedTerms>), IntegerRefusal> {
    let mut bias = [0; 3];
    for (axis, (fixed, bias)) in bias.iter_mut().zip(&triad.bias).enumerate() {
        *fixed = fixed_point(bias.wide(), BIAS)
            .filter(|fixed| fixed.abs() <= LARGEST_BIAS)
            .ok_or(IntegerRefusal::BiasOutOfRange { axis, bias: bias.wide() })?;
    }
    // Named one by one: another term is to be carried here, and to go into the interval.
    let Some(TemperatureTerms { reference, bias_slope, scale_slope }) = terms else {
        return Ok((bias, None));
    };
    let of = |value: T, bits: i32, most: i64| {
        let value = value.wide();
        let refused = IntegerRefusal::TermOutOfRange { value, most: most as f64 * power(-bits) };
        fixed_point(value, bits).filter(|fixed| fixed.abs() <= most).ok_or(refused)
    };
    let three =
        |[x, y, z]: [T; 3], bits, most| Ok([of(x, bits, most)?, of(y, bits, most)?, of(z, bits, most)?]);
    let terms = FixedTerms {
        reference: of(*reference, TEMPERATURE, LARGEST_TEMPERATURE)?,
        bias_slope: three(*bias_slope, BIAS_SLOPE, LARGEST_BIAS_SLOPE)?,
        scale_slope: three(*scale_slope, SCALE_SLOPE, LARGEST_SCALE_SLOPE)?,
    };
    Ok((bias, Some(terms)))
}

/// The gain, row by row.
fn rows_of<T: Scalar>(triad: &Triad<T>, bits: i32) -> Result<[[i64; 3]; 3], IntegerRefusal> {
    let (mut rows, by_row) = ([[0; 3]; 3], triad.gain.transpose());
    for (fixed, entry) in rows.as_flattened_mut().iter_mut().zip(by_row.iter()) {
        *fixed = fixed_point(entry.wide(), bits).ok_or(IntegerRefusal::NotFinite)?;
    }
    Ok(rows)
}

/// `a · b`, without its last 48 bits; both below 2⁵⁸, and the result below 2⁶² by magnitude.
#[inline(never)]
fn product(a: i64, b: i64) -> i64 {
    ((i128::from(a) * i128::from(b)) >> SCALE) as i64
}

/// Without its bits behind the point, to the nearest.
fn rounded(value: i64, bits: i32) -> i64 {
    (value + (1 << (bits - 1))) >> bits
}

/// `value · 2^bits`, to the nearest; `None` from 2⁵⁷ on and where the value is not finite.
#[inline(never)]
fn fixed_point(value: f64, bits: i32) -> Option<i64> {
    const ONE: u64 = 1 << 52;
    let (word, exponent) = (value.to_bits(), exponent(value));
    let significand = (word & (ONE - 1)) | ONE;
    let shift = exponent - 52 + bits;
    let magnitude = match shift {
        // What is not normal is less than the bits behind any point show.
        _ if exponent == -1023 => 0,
        ..=-54 => 0,
        -53..=-1 => ((significand >> (-1 - shift)) + 1) >> 1,
        0..=4 => significand << shift,
        _ => return None,
    };
    let magnitude = magnitude as i64;
    Some(if word >> 63 == 0 { magnitude } else { -magnitude })
}

/// The power of two at or below a number's magnitude; −1023 for zero and what is not normal, 1024 for what is not finite.
fn exponent(value: f64) -> i32 {
    (value.to_bits() << 1 >> 53) as i32 - 1023
}

/// 2 to a power from −1022 to 1023.
pub(super) fn power(exponent: i32) -> f64 {
    f64::from_bits(((1023 + exponent) as u64) << 52)
}

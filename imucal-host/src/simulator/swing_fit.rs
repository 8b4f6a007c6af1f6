//! How gimbals swing about a row of encoders' readings: a cubic of each by least squares.
//!
//! ```text
//! (Σ pᵀp) c = Σ p (θ_k − θ_row),   p = (1, s, s², s³),   s = (t_k − t_row) / (window's length)
//! ```
//!
//! Its value, slope and second derivative at the row are angle, rate and acceleration. The sums take further readings, so
//! that a wider window costs those alone. A window of many readings is summed by blocks, whose own sums about their middle are moved to
//! the row by the binomial theorem:
//!
//! ```text
//! Σ s^p = Σ_j (p over j) d^(p−j) Σ u^j,   s = u + d       d: from the row to the block's middle
//! ```
//!
//! Not modelled: noise that differs from reading to reading.

use std::ops::Range;

use nalgebra::{Matrix4, Vector4};

use crate::effect::Swing;

/// Readings of a block.
const BLOCK: usize = 16;
/// Readings of a window that is summed by blocks, at least: of fewer they are few.
const LONG: usize = 3 * BLOCK;
/// Powers of times whose sums a cubic needs, and those that are multiplied with angles.
const POWERS: usize = 7;
const TERMS: usize = 4;

/// Readings of three encoders, rad, in the order of time, s, and sums over blocks of them.
pub(super) struct Readings<'a> {
    time: &'a [f64],
    angles: &'a [[f64; 3]],
    blocks: Vec<Sums>,
    /// Unit of the blocks' times, s.
    unit: f64,
}

/// Sums over readings: powers of times, and those times each gimbal's angle.
#[derive(Clone, Copy)]
struct Sums {
    /// Where times and angles are counted from.
    time: f64,
    angles: [f64; 3],
    powers: [f64; POWERS],
    weighted: [Vector4<f64>; 3],
}

impl Sums {
    fn about(time: f64, angles: [f64; 3]) -> Self {
        Self { time, angles, powers: [0.0; POWERS], weighted: [Vector4::zeros(); 3] }
    }

    /// Takes a reading at a time times `scale`.
    fn add(&mut self, time: f64, angles: &[f64; 3], scale: f64) {
        let s = (time - self.time) * scale;
        let (s2, s3) = (s * s, s * s * s);
        let powers = [1.0, s, s2, s3, s2 * s2, s2 * s3, s3 * s3];
        self.powers.iter_mut().zip(powers).for_each(|(sum, power)| *sum += power);
        let powers = Vector4::new(1.0, s, s2, s3);
        for (axis, weighted) in self.weighted.iter_mut().enumerate() {
            // From a reading near it, so that many turns cost no digits.
            *weighted += powers * (angles[axis] - self.angles[axis]);
        }
    }

    /// Takes the sums of a block, whose times are in a unit so many times this one's.
    fn join(&mut self, block: &Self, unit: f64, scale: f64) {
        let d = (block.time - self.time) * scale;
        let powers = moved(block.powers, unit, d);
        self.powers.iter_mut().zip(powers).for_each(|(sum, power)| *sum += power);
        for (axis, weighted) in self.weighted.iter_mut().enumerate() {
            let apart = block.angles[axis] - self.angles[axis];
            let of_block = moved(<[f64; TERMS]>::from(block.weighted[axis]), unit, d);
            for (sum, (own, power)) in weighted.iter_mut().zip(of_block.into_iter().zip(powers)) {
                *sum += own + apart * power;
            }
        }
    }
}

/// Sums of the powers of u `unit` + d, of those of u.
fn moved<const N: usize>(mut sums: [f64; N], unit: f64, d: f64) -> [f64; N] {
    let mut power = 1.0;
    for sum in &mut sums {
        *sum *= power;
        power *= unit;
    }
    // Pascal's triangle, a row at a time.
    for k in 1..N {
        for p in (k..N).rev() {
            sums[p] += d * sums[p - 1];
        }
    }
    sums
}

impl<'a> Readings<'a> {
    pub(super) fn new(time: &'a [f64], angles: &'a [[f64; 3]]) -> Self {
        let span = time.first().zip(time.last()).map_or(0.0, |(first, last)| last - first);
        let unit = (BLOCK as f64 * span / time.len().max(1) as f64).max(f64::MIN_POSITIVE);
        let sums = |(time, angles): (&[f64], &[[f64; 3]])| {
            let mut sums = Sums::about(0.5 * (time[0] + time[BLOCK - 1]), angles[0]);
            time.iter().zip(angles).for_each(|(time, angles)| sums.add(*time, angles, 1.0 / unit));
            sums
        };
        let blocks = time.chunks_exact(BLOCK).zip(angles.chunks_exact(BLOCK)).map(sums).collect();
        Self { time, angles, blocks, unit }
    }

    pub(super) fn len(&self) -> usize {
        self.time.len()
    }

    /// The cubic through the readings about a row, by least squares.
    pub(super) fn swing(&self, row: usize, reach: usize) -> [Swing; 3] {
        SwingFit::of(self, row, window(self.len(), row, reach)).swing()
    }
}

/// Rows to each side of one; at an end, as many of those that there are.
pub(super) fn window(rows: usize, row: usize, reach: usize) -> Range<usize> {
    let from = row.saturating_sub(reach).min(rows.saturating_sub(2 * reach + 1));
    from..(from + 2 * reach + 1).min(rows)
}

/// Sums for the cubics of three gimbals through readings about a row.
pub(super) struct SwingFit<'a> {
    readings: &'a Readings<'a>,
    /// Over the times, 1/s.
    scale: f64,
    sums: Sums,
}

impl<'a> SwingFit<'a> {
    /// Of the readings in a window, which is not empty.
    pub(super) fn of(readings: &'a Readings<'a>, row: usize, window: Range<usize>) -> Self {
        let Readings { time, angles, .. } = readings;
        let scale = 1.0 / (time[window.end - 1] - time[window.start]).max(f64::MIN_POSITIVE);
        let mut fit = Self { readings, scale, sums: Sums::about(time[row], angles[row]) };
        // Before, within and behind the blocks that are whole.
        let (from, to) = match window.len() {
            0..LONG => (window.end, window.end),
            _ => (window.start.next_multiple_of(BLOCK), window.end - window.end % BLOCK),
        };
        (window.start..from).for_each(|k| fit.add(k));
        for block in &readings.blocks[from / BLOCK..to.max(from) / BLOCK] {
            fit.sums.join(block, readings.unit * scale, scale);
        }
        (to..window.end).for_each(|k| fit.add(k));
        fit
    }

    /// Takes one more reading.
    pub(super) fn add(&mut self, k: usize) {
        self.sums.add(self.readings.time[k], &self.readings.angles[k], self.scale);
    }

    /// Angle, rate and acceleration of each gimbal at the row.
    pub(super) fn swing(&self) -> [Swing; 3] {
        let normal = Matrix4::from_fn(|i, j| self.sums.powers[i + j]);
        let inverse = normal.try_inverse().unwrap_or_else(Matrix4::zeros);
        std::array::from_fn(|axis| {
            let cubic = inverse * self.sums.weighted[axis];
            Swing {
                angle: self.sums.angles[axis] + cubic[0],
                rate: cubic[1] * self.scale,
                acceleration: 2.0 * cubic[2] * self.scale * self.scale,
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_angle_keeps_its_rate_and_acceleration_in_any_window() {
        let time: Vec<f64> = (0..40).map(|k| 0.01 * f64::from(k) + 0.002 * f64::from(k % 3)).collect();
        let at = |t: f64| [0.5 - 2.0 * t + 3.0 * t * t - 4.0 * t * t * t, 0.0, 30.0 + t];
        let angles: Vec<[f64; 3]> = time.iter().map(|t| at(*t)).collect();
        for row in [0, 1, 20, 39] {
            let t = time[row];
            let (narrow, wide) = (window(40, row, 3), window(40, row, 5));
            let readings = Readings::new(&time, &angles);
            let mut fit = SwingFit::of(&readings, row, narrow.clone());
            let near = fit.swing();
            (wide.start..narrow.start).chain(narrow.end..wide.end).for_each(|k| fit.add(k));
            for [first, _, last] in [near, fit.swing(), readings.swing(row, 5)] {
                assert!((first.angle - at(t)[0]).abs() < 1e-10, "{row}");
                assert!((first.rate - (-2.0 + 6.0 * t - 12.0 * t * t)).abs() < 1e-8, "{row}: {first:?}");
                assert!((first.acceleration - (6.0 - 24.0 * t)).abs() < 1e-5, "{row}: {first:?}");
                assert!((last.rate - 1.0).abs() < 1e-8, "{row}: {last:?}");
            }
        }
    }

    #[test]
    fn a_long_window_has_the_same_cubic_by_blocks_as_by_readings() {
        let time: Vec<f64> = (0..400).map(|k| 1e-3 * f64::from(k) + 3e-4 * f64::from(k % 3)).collect();
        let angles: Vec<[f64; 3]> =
            time.iter().map(|t| [(9.0 * t).sin(), 1e3 + 40.0 * t, (77.0 * t).cos() * 1e-3]).collect();
        let readings = Readings::new(&time, &angles);
        for (row, reach) in [(0, 24), (31, 24), (200, 30), (205, 100), (399, 60)] {
            let window = window(400, row, reach);
            let by_blocks = SwingFit::of(&readings, row, window.clone());
            let mut by_readings = SwingFit::of(&readings, row, window.start..window.start + 1);
            by_readings.scale = by_blocks.scale;
            by_readings.sums = Sums::about(time[row], angles[row]);
            window.for_each(|k| by_readings.add(k));
            for (found, expected) in by_blocks.swing().iter().zip(by_readings.swing()) {
                assert!((found.angle - expected.angle).abs() < 1e-10 * (1.0 + expected.angle.abs()), "{row}");
                assert!((found.rate - expected.rate).abs() < 1e-8 * (1.0 + expected.rate.abs()), "{row}");
                let apart = (found.acceleration - expected.acceleration).abs();
                assert!(apart < 1e-5 * (1.0 + expected.acceleration.abs()), "{row} {reach}: {apart}");
            }
        }
    }
}

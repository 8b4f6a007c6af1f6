//! How gimbals swing about a row of encoders' readings: a cubic of each by least squares.
//!
//! ```text
//! (Σ pᵀp) c = Σ p (θ_k − θ_row),   p = (1, s, s², s³),   s = (t_k − t_row) / (window's length)
//! ```
//!
//! Its value, slope and second derivative at the row are angle, rate and acceleration. The sums take further readings, so
//! that a wider window costs those alone. Not modelled: noise that differs from reading to reading.

use std::ops::Range;

use nalgebra::{Matrix4, Vector4};

use crate::effect::Swing;

/// The cubic through the readings about a row, by least squares.
pub(super) fn swing(time: &[f64], angles: &[[f64; 3]], row: usize, reach: usize) -> [Swing; 3] {
    let window = window(time.len(), row, reach);
    SwingFit::of(time, angles, row, window).swing()
}

/// Rows to each side of one; at an end, as many of those that there are.
pub(super) fn window(rows: usize, row: usize, reach: usize) -> Range<usize> {
    let from = row.saturating_sub(reach).min(rows.saturating_sub(2 * reach + 1));
    from..(from + 2 * reach + 1).min(rows)
}

/// Sums for the cubics of three gimbals through readings about a row.
pub(super) struct SwingFit<'a> {
    time: &'a [f64],
    angles: &'a [[f64; 3]],
    row: usize,
    /// Over the times, 1/s.
    scale: f64,
    /// Sums of the powers 0 to 6 of the scaled times.
    powers: [f64; 7],
    /// Sums of the powers 0 to 3 times each gimbal's angle.
    weighted: [Vector4<f64>; 3],
}

impl<'a> SwingFit<'a> {
    /// Of the readings in a window, which is not empty.
    pub(super) fn of(time: &'a [f64], angles: &'a [[f64; 3]], row: usize, window: Range<usize>) -> Self {
        let scale = 1.0 / (time[window.end - 1] - time[window.start]).max(f64::MIN_POSITIVE);
        let (powers, weighted) = ([0.0; 7], [Vector4::zeros(); 3]);
        let mut fit = Self { time, angles, row, scale, powers, weighted };
        window.for_each(|k| fit.add(k));
        fit
    }

    /// Takes one more reading.
    pub(super) fn add(&mut self, k: usize) {
        let s = (self.time[k] - self.time[self.row]) * self.scale;
        let (s2, s3) = (s * s, s * s * s);
        let powers = [1.0, s, s2, s3, s2 * s2, s2 * s3, s3 * s3];
        self.powers.iter_mut().zip(powers).for_each(|(sum, power)| *sum += power);
        let powers = Vector4::new(1.0, s, s2, s3);
        for (axis, weighted) in self.weighted.iter_mut().enumerate() {
            // From the row's own reading, so that many turns cost no digits.
            *weighted += powers * (self.angles[k][axis] - self.angles[self.row][axis]);
        }
    }

    /// Angle, rate and acceleration of each gimbal at the row.
    pub(super) fn swing(&self) -> [Swing; 3] {
        let normal = Matrix4::from_fn(|i, j| self.powers[i + j]);
        let inverse = normal.try_inverse().unwrap_or_else(Matrix4::zeros);
        std::array::from_fn(|axis| {
            let cubic = inverse * self.weighted[axis];
            Swing {
                angle: self.angles[self.row][axis] + cubic[0],
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
            let mut fit = SwingFit::of(&time, &angles, row, narrow.clone());
            let near = fit.swing();
            (wide.start..narrow.start).chain(narrow.end..wide.end).for_each(|k| fit.add(k));
            for [first, _, last] in [near, fit.swing(), swing(&time, &angles, row, 5)] {
                assert!((first.angle - at(t)[0]).abs() < 1e-10, "{row}");
                assert!((first.rate - (-2.0 + 6.0 * t - 12.0 * t * t)).abs() < 1e-8, "{row}: {first:?}");
                assert!((first.acceleration - (6.0 - 24.0 * t)).abs() < 1e-5, "{row}: {first:?}");
                assert!((last.rate - 1.0).abs() < 1e-8, "{row}: {last:?}");
            }
        }
    }
}

//! How gimbals swing about a row of encoders' readings: a cubic of each by least squares.
//!
//! ```text
//! (Σ pᵀp) c = Σ p (θ_k − θ_row),   p = (1, s, s², s³),   s = (t_k − t_row) / (window's length)
//! ```
//!
//! Its value, slope and second derivative at the row are angle, rate and acceleration. The sums take further readings, so
//! that a wider window costs those alone. Those of a long window are moved from a row to the next one by the binomial theorem, and
//! lose and take the few readings by which the windows differ:
//!
//! ```text
//! Σ s^p = Σ_j (p over j) d^(p−j) Σ (r u)^j,   s = r u + d       d: from row to row, r: ratio of the windows' lengths
//! ```
//!
//! Not modelled: noise that differs from reading to reading.

use std::ops::Range;

use nalgebra::{Matrix4, Vector4};
use rayon::prelude::*;

use crate::effect::Swing;

/// Readings of a window whose sums are moved to the next row, at least: of fewer they are few.
const LONG: usize = 48;
/// Sums are moved as long as their window is at most so many times as long, or as short, as the one they began with: behind a
/// gap in time it is far shorter, and what is left of a long one's readings is rounding.
const STRETCH: f64 = 2.0;
/// Consecutive rows; the first one's sums are those of its own readings, so that errors of rounding stay small.
const RUN: usize = 64;
/// Powers of times whose sums a cubic needs, and those that are multiplied with angles.
const POWERS: usize = 7;
const TERMS: usize = 4;

/// Readings of three encoders, rad, in the order of time, s.
pub(super) struct Readings<'a> {
    pub(super) time: &'a [f64],
    pub(super) angles: &'a [[f64; 3]],
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

    /// Takes a reading `count` times, at a time times `scale`.
    fn add(&mut self, time: f64, angles: &[f64; 3], scale: f64, count: f64) {
        let s = (time - self.time) * scale;
        let (s2, s3) = (s * s, s * s * s);
        let powers = [1.0, s, s2, s3, s2 * s2, s2 * s3, s3 * s3];
        self.powers.iter_mut().zip(powers).for_each(|(sum, power)| *sum += count * power);
        let powers = Vector4::new(1.0, s, s2, s3) * count;
        for (axis, weighted) in self.weighted.iter_mut().enumerate() {
            // From a reading near it, so that many turns cost no digits.
            *weighted += powers * (angles[axis] - self.angles[axis]);
        }
    }

    /// The same sums about another time and angles, that one times `scale`, in a unit `1/unit` times theirs.
    fn about_another(&self, time: f64, angles: [f64; 3], unit: f64, scale: f64) -> Self {
        let d = (self.time - time) * scale;
        let powers = moved(self.powers, unit, d);
        let weighted = std::array::from_fn(|axis| {
            let apart = self.angles[axis] - angles[axis];
            let own = moved(<[f64; TERMS]>::from(self.weighted[axis]), unit, d);
            Vector4::from_fn(|k, _| own[k] + apart * powers[k])
        });
        Self { time, angles, powers, weighted }
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

impl Readings<'_> {
    /// Mean time between two, s.
    pub(super) fn interval(&self) -> f64 {
        let ends = self.time.first().zip(self.time.last());
        ends.map_or(0.0, |(first, last)| (last - first) / (self.time.len().max(2) - 1) as f64)
    }

    /// What `of` makes of each row and the cubics through so many readings to each side of it.
    pub(super) fn each<T: Send, C: Default + ParallelExtend<T>>(
        &self,
        reach: impl Fn(usize) -> usize + Sync,
        of: impl Fn(usize, &SwingFit) -> T + Sync,
    ) -> C {
        let rows = self.time.len();
        let run = |first: usize| {
            let mut last: Option<SwingFit> = None;
            let (reach, of) = (&reach, &of);
            (first..rows.min(first + RUN)).map(move |row| {
                let window = window(rows, row, reach(row));
                let fit = match last.take() {
                    Some(last) => last.moved(row, window),
                    None => SwingFit::of(self, row, window),
                };
                of(row, last.insert(fit))
            })
        };
        let mut all = C::default();
        all.par_extend((0..rows).into_par_iter().step_by(RUN).flat_map_iter(run));
        all
    }
}

/// Rows to each side of one; at an end, as many of those that there are.
pub(super) fn window(rows: usize, row: usize, reach: usize) -> Range<usize> {
    let from = row.saturating_sub(reach).min(rows.saturating_sub(2 * reach + 1));
    from..(from + 2 * reach + 1).min(rows)
}

/// Over times from a row, so that those of a window are about one, 1/s.
fn scale(time: &[f64], window: &Range<usize>) -> f64 {
    1.0 / (time[window.end - 1] - time[window.start]).max(f64::MIN_POSITIVE)
}

/// Sums for the cubics of three gimbals through readings about a row.
#[derive(Clone)]
pub(super) struct SwingFit<'a> {
    readings: &'a Readings<'a>,
    window: Range<usize>,
    /// Over the times, 1/s.
    scale: f64,
    /// That of the sums that were moved to here.
    first_scale: f64,
    sums: Sums,
}

impl<'a> SwingFit<'a> {
    /// Of the readings in a window, which is not empty.
    fn of(readings: &'a Readings<'a>, row: usize, window: Range<usize>) -> Self {
        let Readings { time, angles } = readings;
        let scale = scale(time, &window);
        let sums = Sums::about(time[row], angles[row]);
        let mut fit = Self { readings, window: window.clone(), scale, first_scale: scale, sums };
        window.for_each(|k| fit.count(k, 1.0));
        fit
    }

    /// The same about a row near it.
    fn moved(self, row: usize, window: Range<usize>) -> Self {
        let (old, Readings { time, angles }) = (self.window, self.readings);
        let differing = old.start.abs_diff(window.start) + old.end.abs_diff(window.end);
        let scale = scale(time, &window);
        let stretched = !(1.0 / STRETCH..STRETCH).contains(&(scale / self.first_scale));
        if window.len() < LONG || 2 * differing > window.len() || stretched {
            return Self::of(self.readings, row, window);
        }
        let sums = self.sums.about_another(time[row], angles[row], scale / self.scale, scale);
        let mut fit = Self { window: window.clone(), scale, sums, ..self };
        (old.start..window.start).chain(window.end..old.end).for_each(|k| fit.count(k, -1.0));
        (window.start..old.start).chain(old.end..window.end).for_each(|k| fit.count(k, 1.0));
        fit
    }

    /// The same with the readings of a wider window.
    pub(super) fn wider(&self, window: Range<usize>) -> Self {
        let mut fit = self.clone();
        (window.start..self.window.start).chain(self.window.end..window.end).for_each(|k| fit.count(k, 1.0));
        fit
    }

    fn count(&mut self, k: usize, count: f64) {
        self.sums.add(self.readings.time[k], &self.readings.angles[k], self.scale, count);
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
        let readings = Readings { time: &time, angles: &angles };
        for row in [0, 1, 20, 39] {
            let t = time[row];
            let (narrow, wide) = (window(40, row, 3), window(40, row, 5));
            let fit = SwingFit::of(&readings, row, narrow);
            for fit in [&fit, &fit.wider(wide.clone()), &SwingFit::of(&readings, row, wide)] {
                let [first, _, last] = fit.swing();
                assert!((first.angle - at(t)[0]).abs() < 1e-10, "{row}");
                assert!((first.rate - (-2.0 + 6.0 * t - 12.0 * t * t)).abs() < 1e-8, "{row}: {first:?}");
                assert!((first.acceleration - (6.0 - 24.0 * t)).abs() < 1e-5, "{row}: {first:?}");
                assert!((last.rate - 1.0).abs() < 1e-8, "{row}: {last:?}");
            }
        }
    }

    /// Cubics of sums that were moved, next to those of sums of their own, where no gap is in a window: there either is
    /// ill-conditioned.
    fn assert_moved_sums_are_as_good(time: &[f64], reach: impl Fn(usize) -> usize + Sync) {
        let angles: Vec<[f64; 3]> =
            time.iter().map(|t| [(9.0 * t).sin(), 1e3 + 40.0 * t, (77.0 * t).cos() * 1e-3]).collect();
        let readings = Readings { time, angles: &angles };
        let moved: Vec<[Swing; 3]> = readings.each(&reach, |_, fit| fit.swing());
        assert_eq!(moved.len(), time.len());
        for (row, moved) in moved.iter().enumerate() {
            let window = window(time.len(), row, reach(row));
            if time[window.clone()].windows(2).any(|pair| pair[1] - pair[0] > 0.005) {
                continue;
            }
            let expected = SwingFit::of(&readings, row, window).swing();
            for (found, expected) in moved.iter().zip(expected) {
                let near = |found: f64, expected: f64, limit: f64| {
                    assert!(
                        (found - expected).abs() < limit * (1.0 + expected.abs()),
                        "{row}: {found} {expected}"
                    );
                };
                near(found.angle, expected.angle, 1e-10);
                near(found.rate, expected.rate, 1e-8);
                near(found.acceleration, expected.acceleration, 1e-5);
            }
        }
    }

    #[test]
    fn sums_that_were_moved_give_the_cubics_of_the_readings_themselves() {
        let time: Vec<f64> = (0..1000).map(|k| 1e-3 * f64::from(k) + 3e-4 * f64::from(k % 3)).collect();
        // Of any width, some of which begin in the middle of a run.
        for reach in [2, 24, 30, 100] {
            assert_moved_sums_are_as_good(&time, |row| if row % 300 < 200 { reach } else { 60 });
        }
    }

    #[test]
    fn behind_a_gap_in_time_the_cubics_are_those_of_the_readings_themselves() {
        for gap in [0.01, 0.3, 10.0] {
            let time: Vec<f64> =
                (0..600).map(|k| 1e-3 * f64::from(k) + if k < 290 { 0.0 } else { gap }).collect();
            for reach in [24, 30, 100] {
                assert_moved_sums_are_as_good(&time, |_| reach);
            }
        }
    }
}

//! What a fit is given: rests, turns between rests, and points of a cloud.
//!
//! | observation | made of | used by |
//! | --- | --- | --- |
//! | [`Moments`] | the samples of one sensor during a rest | accelerometer, gyroscope bias |
//! | [`Rest`] | the moments of both inertial sensors, and the temperature | everything |
//! | [`Block`] | a few gyroscope samples, compressed | [`Turn`] |
//! | [`Turn`] | the blocks from inside one rest to inside the next | gyroscope |
//! | [`Motion`] | blocks, and the attitudes that a rig's encoders give | gyroscope |
//!
//! All in SI of the sensor's nominal output (m/s², rad/s, µT), sensor frame `s`, before calibration.

use nalgebra::{Quaternion, Vector3};

use crate::scalar::Scalar;

/// Mean and spread of a triad's samples, gathered one at a time (Welford 1962).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments<T: Scalar> {
    count: u32,
    mean: Vector3<T>,
    squares: Vector3<T>,
}

impl<T: Scalar> Default for Moments<T> {
    fn default() -> Self {
        Self { count: 0, mean: Vector3::zeros(), squares: Vector3::zeros() }
    }
}

impl<T: Scalar> Moments<T> {
    /// Takes one sample in; its unit is that of the mean.
    pub fn push(&mut self, sample: &Vector3<T>) {
        self.take(sample);
    }

    /// [`Self::push`] where every sample of a device passes, without the cost of a call.
    #[inline(always)]
    pub(crate) fn take(&mut self, sample: &Vector3<T>) {
        self.count = self.count.saturating_add(1);
        // By components, as in `rotation::image`: at a device's `opt-level = "s"` nalgebra's own are loops.
        let count = T::whole(self.count);
        let axis = |sample: T, mean: &mut T, squares: &mut T| {
            let before = sample - *mean;
            *mean += before / count;
            *squares += before * (sample - *mean);
        };
        axis(sample.x, &mut self.mean.x, &mut self.squares.x);
        axis(sample.y, &mut self.mean.y, &mut self.squares.y);
        axis(sample.z, &mut self.mean.z, &mut self.squares.z);
    }

    /// The moments of these samples and of others (Chan, Golub and LeVeque 1983).
    #[must_use]
    pub fn join(&self, other: &Self) -> Self {
        let count = self.count.saturating_add(other.count);
        if count == 0 {
            return *self;
        }
        let (own, others, all) = (T::whole(self.count), T::whole(other.count), T::whole(count));
        let (share, spread) = (others / all, own * others / all);
        // By components, as in `take`.
        let axis = |mean: T, its: T, squares: T, its_squares: T| {
            let apart = its - mean;
            (mean + apart * share, squares + its_squares + apart * apart * spread)
        };
        let (m, n, q, r) = (&self.mean, &other.mean, &self.squares, &other.squares);
        let (x, u) = axis(m.x, n.x, q.x, r.x);
        let (y, v) = axis(m.y, n.y, q.y, r.y);
        let (z, w) = axis(m.z, n.z, q.z, r.z);
        Self { count, mean: Vector3::new(x, y, z), squares: Vector3::new(u, v, w) }
    }

    /// Samples taken in.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Sum of the squared deviations from the mean on each axis.
    #[inline]
    pub fn squares(&self) -> Vector3<T> {
        self.squares
    }

    /// Mean of the samples; zero before the first.
    pub fn mean(&self) -> Vector3<T> {
        self.mean
    }

    /// Unbiased variance of a sample on each axis; zero below two samples.
    pub fn variance(&self) -> Vector3<T> {
        if self.count < 2 {
            return Vector3::zeros();
        }
        self.squares / T::whole(self.count - 1)
    }
}

/// A stretch in which the sensor lay still.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rest<T: Scalar> {
    /// Middle of the rest on the IMU's clock, s.
    pub time: T,
    /// Accelerometer: specific force `f_s`, m/s².
    pub acc: Moments<T>,
    /// Gyroscope: rate `w_ns_s`, rad/s; no samples where there is none.
    pub gyr: Moments<T>,
    /// Mean temperature, °C; NaN where it is not measured.
    pub temperature: T,
}

/// Some gyroscope samples of one stretch, as three sums: 36 bytes in `f32`, whatever their number.
///
/// With ω_i the rate held during Δt_i, and T_i the time of the block after sample i less the time before it:
///
/// ```text
/// s0 = Σ ω_i Δt_i      s1 = Σ ω_i Δt_i T_i      c = Σ_{i<j} ω_i × ω_j Δt_i Δt_j
/// ```
///
/// From them follows, for any gain A and bias b and to second order, the block's rotation vector
/// `A (s0 − T b) + ½ cof(A) (c − s1 × b)`. Source: models.md 3 (a reconstruction), here for samples that need
/// not be equally spaced; equal to it where they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block<T: Scalar> {
    /// Angle, rad.
    pub s0: Vector3<T>,
    /// First moment of the angle, rad·s.
    pub s1: Vector3<T>,
    /// Coning sum, rad².
    pub c: Vector3<T>,
}

impl<T: Scalar> Block<T> {
    /// This block, of a duration in s, and the next one, as one: the block of their samples, to rounding.
    pub fn join(&self, duration: T, next: &Self, next_duration: T) -> Self {
        // By components, for the same reason as in `Moments::push`.
        let sum = |a: &Vector3<T>, b: &Vector3<T>| Vector3::new(a.x + b.x, a.y + b.y, a.z + b.z);
        let (a, b) = (&self.s0, &next.s0);
        let cross = Vector3::new(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
        let later =
            |s1: T, s0: T, next_s1: T, next_s0: T| s1 + s0 * next_duration + next_s1 - next_s0 * duration;
        Self {
            s0: sum(a, b),
            s1: Vector3::new(
                later(self.s1.x, a.x, next.s1.x, b.x),
                later(self.s1.y, a.y, next.s1.y, b.y),
                later(self.s1.z, a.z, next.s1.z, b.z),
            ),
            c: sum(&sum(&self.c, &next.c), &cross),
        }
    }

    /// This block, of a duration in s, had the sensor read less by a constant rate, rad/s.
    #[must_use]
    #[inline]
    pub fn less(&self, rate: &Vector3<T>, duration: T) -> Self {
        Self { s0: self.s0 - rate * duration, s1: self.s1, c: self.c - self.s1.cross(rate) }
    }
}

/// How long each block of a turn lasts, s.
#[derive(Clone, Copy, Debug)]
pub enum Durations<'a, T> {
    /// All the same.
    Uniform(T),
    /// One for each block; blocks beyond the last are taken to have no length.
    Each(&'a [T]),
}

impl<T: Scalar> Durations<'_, T> {
    /// Duration of block `index`, s.
    pub fn get(&self, index: usize) -> T {
        match self {
            Self::Uniform(duration) => *duration,
            Self::Each(all) => all.get(index).copied().unwrap_or_else(T::zero),
        }
    }
}

/// Gathers samples into a [`Block`].
#[derive(Clone, Copy, Debug)]
pub struct BlockBuilder<T: Scalar> {
    count: u16,
    duration: T,
    /// Σ ω_i Δt_i · (2 · time before i + Δt_i), from which s1 follows at the end.
    early: Vector3<T>,
    s0: Vector3<T>,
    c: Vector3<T>,
}

impl<T: Scalar> Default for BlockBuilder<T> {
    fn default() -> Self {
        Self {
            count: 0,
            duration: T::zero(),
            early: Vector3::zeros(),
            s0: Vector3::zeros(),
            c: Vector3::zeros(),
        }
    }
}

impl<T: Scalar> BlockBuilder<T> {
    /// Takes in a rate `w_ns_s`, rad/s, that held for `duration`, s.
    #[inline]
    pub fn push(&mut self, rate: &Vector3<T>, duration: T) {
        // By components, for the same reason as in `Moments::push`.
        let (x, y, z) = (rate.x * duration, rate.y * duration, rate.z * duration);
        let (s, c, early) = (&mut self.s0, &mut self.c, &mut self.early);
        c.x += s.y * z - s.z * y;
        c.y += s.z * x - s.x * z;
        c.z += s.x * y - s.y * x;
        let twice = self.duration + self.duration + duration;
        early.x += x * twice;
        early.y += y * twice;
        early.z += z * twice;
        s.x += x;
        s.y += y;
        s.z += z;
        self.duration += duration;
        self.count = self.count.saturating_add(1);
    }

    /// Samples taken in since the last block.
    #[inline]
    pub fn count(&self) -> u16 {
        self.count
    }

    /// How long they held, s.
    #[inline]
    pub fn duration(&self) -> T {
        self.duration
    }

    /// The block and its duration, s; the builder is empty afterwards.
    pub fn finish(&mut self) -> (Block<T>, T) {
        let done = core::mem::take(self);
        let s1 = done.s0 * done.duration - done.early;
        (Block { s0: done.s0, s1, c: done.c }, done.duration)
    }
}

/// A motion from inside one rest to inside the next.
#[derive(Clone, Copy, Debug)]
pub struct Turn<'a, T: Scalar> {
    /// Gyroscope blocks in time order.
    pub blocks: &'a [Block<T>],
    /// Their durations, s.
    pub durations: Durations<'a, T>,
    /// Direction of the specific force in the rest before, unit vector, calibrated axes.
    pub before: Vector3<T>,
    /// The same in the rest after.
    pub after: Vector3<T>,
}

/// After how many blocks of a motion each reference attitude stands.
#[derive(Clone, Copy, Debug)]
pub enum Compared<'a> {
    /// Reference k after (k + 1) times as many.
    Every(u32),
    /// One number for each reference, ascending: references at rests.
    After(&'a [u32]),
}

impl Compared<'_> {
    /// Blocks before reference `index`; `None` without a number for it.
    pub fn get(&self, index: usize) -> Option<usize> {
        match self {
            Self::Every(blocks) => usize::try_from(*blocks).ok()?.checked_mul(index.checked_add(1)?),
            Self::After(all) => usize::try_from(*all.get(index)?).ok(),
        }
    }
}

/// A motion whose attitudes a rig knows: blocks of the gyroscope between reference attitudes.
///
/// In `f32` a block takes 36 bytes, 12 more for Earth rate and 12 more for specific force; a reference takes 16.
/// Quaternions (w first, of any length) take components from the table `r`, which carries the sensor, to the base
/// `p`, `v_p = q v_r q*`; the sensor's mounting on the table is part of its gain.
#[derive(Clone, Copy, Debug)]
pub struct Motion<'a, T: Scalar> {
    /// Gyroscope blocks in time order; their rates are nominal SI, rad/s.
    pub blocks: &'a [Block<T>],
    /// Their durations, s.
    pub durations: Durations<'a, T>,
    /// Mean Earth rate over each block, rad/s, components in the table's frame, from the reference attitudes; zero
    /// beyond the last. Empty: not taken out.
    pub earth: &'a [Vector3<T>],
    /// Mean specific force over each block, m/s², components in the table's frame; zero beyond the last. Looked at
    /// only where g-sensitivity is estimated.
    pub force: &'a [Vector3<T>],
    /// Attitude before the first block.
    pub start: Quaternion<T>,
    /// Attitudes to compare with, in time order.
    pub references: &'a [Quaternion<T>],
    /// Where they stand.
    pub compared: Compared<'a>,
}

impl<T: Scalar> Motion<'_, T> {
    /// Reference `index` and the blocks before it; `None` beyond the last that the blocks reach.
    #[inline]
    pub fn reference(&self, index: usize) -> Option<(usize, &Quaternion<T>)> {
        let blocks = self.compared.get(index).filter(|blocks| *blocks <= self.blocks.len())?;
        Some((blocks, self.references.get(index)?))
    }
}

/// A point that ought to lie on a sphere once calibrated: a rest of an accelerometer, a sample of a magnetometer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShellPoint<T: Scalar> {
    /// Sensor output, nominal SI, frame `s`.
    pub value: Vector3<T>,
    /// Expected distance outside the shell, same unit: noise on a curved surface lies outside on average
    /// ([`crate::model::norm::curvature_excess`]); zero for means of many samples.
    pub excess: T,
}

impl<T: Scalar> ShellPoint<T> {
    /// A point without correction for curvature.
    pub fn new(value: Vector3<T>) -> Self {
        Self { value, excess: T::zero() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_of_a_constant_have_no_spread() {
        let mut m = Moments::<f32>::default();
        for _ in 0..1000 {
            m.push(&Vector3::new(33_123.8, -1.0, 0.25));
        }
        assert_eq!((m.count(), m.variance()), (1000, Vector3::zeros()));
        assert_eq!(m.mean(), Vector3::new(33_123.8, -1.0, 0.25));
    }

    #[test]
    fn moments_agree_with_two_passes() {
        let samples: std::vec::Vec<_> = (0..50)
            .map(|i| Vector3::new(f64::from(i), f64::from(i * i % 7), 1e6 + f64::from(i % 3)))
            .collect();
        let mut m = Moments::default();
        samples.iter().for_each(|s| m.push(s));
        let mean = samples.iter().sum::<Vector3<f64>>() / 50.0;
        let variance =
            samples.iter().map(|s| (s - mean).component_mul(&(s - mean))).sum::<Vector3<f64>>() / 49.0;
        assert!((m.mean() - mean).norm() < 1e-9);
        assert!((m.variance() - variance).norm() < 1e-6);
    }

    #[test]
    fn moments_joined_are_those_of_all_samples() {
        let sample =
            |i: u32| Vector3::new(f64::from(i * i % 11), 9.8 + f64::from(i % 5) * 1e-3, -f64::from(i));
        let of = |range: core::ops::Range<u32>| {
            let mut moments = Moments::default();
            range.for_each(|i| moments.push(&sample(i)));
            moments
        };
        let (joined, all) = (of(0..13).join(&of(13..60)), of(0..60));
        assert_eq!(joined.count(), all.count());
        assert!((joined.mean() - all.mean()).norm() < 1e-13);
        assert!((joined.variance() - all.variance()).norm() < 1e-12);
        let none = Moments::<f64>::default();
        assert_eq!((none.join(&none), none.join(&all).mean()), (none, all.mean()));
    }

    #[test]
    fn two_blocks_joined_are_the_block_of_their_samples() {
        let rate = |k: usize| Vector3::new((k as f64).sin(), 0.3 * k as f64, (0.7 * k as f64).cos());
        let of = |range: std::ops::Range<usize>| {
            let mut builder = BlockBuilder::default();
            range.for_each(|k| builder.push(&rate(k), 0.01 + 0.001 * k as f64));
            builder.finish()
        };
        let ((a, a_duration), (b, b_duration), (both, duration)) = (of(0..4), of(4..9), of(0..9));
        let joined = a.join(a_duration, &b, b_duration);
        assert!((a_duration + b_duration - duration).abs() < 1e-15);
        for (x, y) in [(joined.s0, both.s0), (joined.s1, both.s1), (joined.c, both.c)] {
            assert!((x - y).norm() < 1e-15, "{x} {y}");
        }
    }

    #[test]
    fn a_block_of_equal_intervals_has_the_sums_of_the_paper_s_reconstruction() {
        let rates: [Vector3<f64>; 4] =
            [Vector3::x(), Vector3::new(0.0, 2.0, 0.5), Vector3::new(-1.0, 0.3, 0.0), Vector3::z()];
        let dt = 0.01;
        let mut b = BlockBuilder::default();
        rates.iter().for_each(|w| b.push(w, dt));
        let (block, duration) = b.finish();
        let m = 4.0;
        let s0: Vector3<f64> = rates.iter().sum();
        let s1: Vector3<f64> = rates.iter().enumerate().map(|(i, w)| w * (m - 1.0 - 2.0 * i as f64)).sum();
        let mut c = Vector3::zeros();
        for j in 0..4 {
            for i in 0..j {
                c += rates[i].cross(&rates[j]);
            }
        }
        assert!((duration - m * dt).abs() < 1e-15);
        assert!((block.s0 - s0 * dt).norm() < 1e-15);
        assert!((block.s1 - s1 * dt * dt).norm() < 1e-15);
        assert!((block.c - c * dt * dt).norm() < 1e-15);
        assert_eq!(b.count(), 0);
    }
}

//! What an accelerometer shows at rest.
//!
//! ```text
//! σ²_q = max(σ²_min, σ²_0, q²/4)         max(σ²_0, q²/4) where noise hides below a step that is coarse: q²/4 > σ²_0
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | σ²_min | variance of the quietest window so far that shows noise in each of its quarters |
//! | σ²_0 | least variance: [`RestSettings::least_variance`](super::RestSettings::least_variance) |
//! | q | step of the accelerometer: the least difference of two samples a quarter of a second apart, on any axis |
//!
//! Noise below a step comes and goes with the attitude: at one, all samples are equal; at another, an axis steps to and fro with
//! a variance of up to q²/4. A quarter of equal samples therefore says nothing of the noise, whether the step hides it or the
//! sensor repeats an old sample. A step is looked for in windows that seem too noisy, and counts once two samples that differ
//! were equal on an axis: those that are not rounded hardly are.

use nalgebra::Vector3;

use crate::{observation::Moments, scalar::Scalar};

/// What is known of an accelerometer's noise at rest.
#[derive(Clone, Copy, Debug)]
pub(super) struct RestNoise<T: Scalar> {
    /// Variance of the quietest window without a quarter of equal samples, (m/s²)²; the largest number before there is one.
    quietest: T,
    /// Square of the least difference of two samples, (m/s²)²; the largest number before two differ.
    step: T,
    /// Two samples that differ were equal on an axis: there is a step.
    rounds: bool,
    /// A window had a quarter of equal samples.
    repeats: bool,
    /// Windows that hold the last quarter of equal samples, this one and later ones.
    holding: u8,
}

impl<T: Scalar> Default for RestNoise<T> {
    fn default() -> Self {
        Self { quietest: T::LARGEST, step: T::LARGEST, rounds: false, repeats: false, holding: 0 }
    }
}

impl<T: Scalar> RestNoise<T> {
    /// Takes in the samples of a quarter, the last one of the next window.
    #[inline]
    pub(super) fn take_quarter(&mut self, samples: &Moments<T>) {
        let squares = samples.squares();
        let equal = squares.x + squares.y + squares.z == T::zero();
        self.holding = if equal { 4 } else { self.holding.saturating_sub(1) };
    }

    /// Takes in the variance of a window, (m/s²)².
    #[inline]
    pub(super) fn take(&mut self, variance: T) {
        if self.holding > 0 {
            self.repeats = true;
        } else if variance < self.quietest {
            self.quietest = variance;
        }
    }

    /// Takes in what the axes of two samples differ by, m/s².
    #[inline]
    pub(super) fn take_step(&mut self, one: &Vector3<T>, other: &Vector3<T>) {
        let (mut equal, mut least) = (false, T::LARGEST);
        let mut axis = |apart: T| {
            let square = apart * apart;
            equal |= square == T::zero();
            if square > T::zero() && square < least {
                least = square;
            }
        };
        axis(one.x - other.x);
        axis(one.y - other.y);
        axis(one.z - other.z);
        self.rounds |= equal && least < T::LARGEST;
        if least < self.step {
            self.step = least;
        }
    }

    /// Variance of a window at rest, sum of the axes, (m/s²)²; the largest number before the first window.
    #[inline]
    pub(super) fn variance(&self, least: T) -> T {
        let stepping = if self.rounds { T::of(0.25) * self.step } else { T::zero() };
        let is_coarse = stepping > least;
        let hidden = if is_coarse { stepping } else { least };
        let is_hidden = self.repeats && (is_coarse || self.quietest == T::LARGEST);
        if self.quietest > hidden && !is_hidden { self.quietest } else { hidden }
    }
}

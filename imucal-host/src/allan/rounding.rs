//! Rounding: whether samples show a sensor's noise, or where their steps lie.
//!
//! ```text
//! s² = σ² + q²/12      variance of samples that are rounded to steps of q, while q ≤ 2 σ
//! ```
//!
//! Beyond that, samples stay on one step or change between two, and how much they scatter depends on where between two steps the bias
//! lies: from nothing to q/2. Source: B. Widrow & I. Kollár, Quantization Noise (2008), chapter 4 (Sheppard's correction); the limit is
//! checked in the tests. Samples that repeat those before them are a rounded sensor's as well as those of an output that is read more often
//! than it changes; there all axes repeat at once. Not recognised: steps of several sizes, the least of which is small.

use nalgebra::Vector3;

/// Samples show the noise while their steps are no larger than this many times what they scatter by: q = 2.2 σ or so.
const SHOWN: f64 = 1.9;
/// An output is read more often than it changes where more than this share of the samples that rounding does not repeat are repeated.
const REPEATED: f64 = 0.2;

/// Follows the differences of neighbouring samples.
#[derive(Clone, Copy, Debug)]
pub struct Rounding {
    /// Differences so far.
    differences: u64,
    /// Those in which an axis did not change, and in which none did.
    same: [u64; 3],
    repeated: u64,
    /// Sums of their squares.
    squares: Vector3<f64>,
    /// The least of each axis that is not zero.
    step: Vector3<f64>,
}

/// Steps that hide the noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hidden {
    /// The step, in the samples' unit.
    pub step: f64,
    /// Standard deviation of the samples, from their differences.
    pub deviation: f64,
}

impl Default for Rounding {
    fn default() -> Self {
        Self {
            differences: 0,
            same: [0; 3],
            repeated: 0,
            squares: Vector3::zeros(),
            step: Vector3::repeat(f64::INFINITY),
        }
    }
}

impl Rounding {
    /// Takes the difference of a sample and the one before.
    pub fn push(&mut self, difference: &Vector3<f64>) {
        self.differences += 1;
        self.repeated += u64::from(*difference == Vector3::zeros());
        self.squares += difference.component_mul(difference);
        for (axis, difference) in difference.iter().enumerate() {
            match *difference == 0.0 {
                true => self.same[axis] += 1,
                false => self.step[axis] = self.step[axis].min(difference.abs()),
            }
        }
    }

    /// How often each value is read on average before it changes, where that is more often than rounding explains.
    pub fn readings(&self) -> Option<f64> {
        let all = self.differences.max(1) as f64;
        let by_rounding: f64 = self.same.iter().map(|same| *same as f64 / all).product();
        let read_again = self.repeated as f64 / all - by_rounding > REPEATED * (1.0 - by_rounding);
        read_again.then(|| all / (self.differences - self.repeated).max(1) as f64)
    }

    /// The steps of an axis, where they hide its noise; `None` as well where it never changes.
    pub fn hidden(&self, axis: usize) -> Option<Hidden> {
        let fresh = match self.readings() {
            Some(_) => self.differences - self.repeated,
            None => self.differences,
        };
        let deviation = (0.5 * self.squares[axis] / fresh.max(1) as f64).sqrt();
        let step = self.step[axis];
        (step.is_finite() && step > SHOWN * deviation).then_some(Hidden { step, deviation })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::random::{Purpose, Random};

    /// Noise of standard deviation 1 about these biases, rounded to steps, each value read so often.
    fn rounded(step: f64, bias: [f64; 3], readings: usize) -> Rounding {
        let mut random = Random::new(3, Purpose::Noise);
        let mut rounding = Rounding::default();
        let mut sample = || Vector3::from(bias.map(|bias| ((bias + random.normal()) / step).round() * step));
        let mut last = sample();
        for _ in 0..20_000 {
            let next = sample();
            rounding.push(&(next - last));
            (1..readings).for_each(|_| rounding.push(&Vector3::zeros()));
            last = next;
        }
        rounding
    }

    #[test]
    fn samples_scatter_by_noise_and_rounding_until_the_steps_hide_the_noise() {
        for step in [0.1, 1.0, 2.0] {
            for bias in [[0.0, 0.25 * step, 0.5 * step], [0.1 * step, 0.37 * step, 0.45 * step]] {
                for readings in [1, 4] {
                    let rounding = rounded(step, bias, readings);
                    let expected = (1.0 + step * step / 12.0).sqrt();
                    for axis in 0..3 {
                        assert_eq!(rounding.hidden(axis), None, "{step} {bias:?}");
                        let fresh = 20_000.0;
                        let found = (0.5 * rounding.squares[axis] / fresh).sqrt();
                        assert!(
                            (found / expected - 1.0).abs() < 0.05,
                            "{step} {bias:?}: {found}, {expected}"
                        );
                    }
                }
            }
        }
        for step in [2.6, 4.0, 6.0, 8.0] {
            for bias in [[0.0, 0.25 * step, 0.5 * step], [0.1 * step, 0.37 * step, 0.45 * step]] {
                let rounding = rounded(step, bias, 1);
                for axis in 0..3 {
                    let hidden = rounding.hidden(axis);
                    // Eight standard deviations from the next step an axis may never change.
                    let changes = rounding.step[axis].is_finite();
                    assert_eq!(hidden.is_some(), changes, "{step} {bias:?}: {rounding:?}");
                    assert!(hidden.is_none_or(|hidden| (hidden.step / step - 1.0).abs() < 1e-9));
                }
            }
        }
    }

    #[test]
    fn values_that_are_read_again_are_counted_and_rounded_ones_are_not() {
        for step in [1e-6, 1.0, 2.0] {
            let readings = rounded(step, [0.1, 0.3, 0.7], 4).readings().expect("read four times");
            // Some new values are the old one.
            assert!((3.8..4.8).contains(&readings), "{step}: {readings}");
        }
        for step in [1e-6, 2.0, 3.0, 4.0, 6.0, 8.0] {
            assert_eq!(rounded(step, [0.1, 0.3, 0.7], 1).readings(), None, "{step}");
        }
    }
}

//! How well a rest's mean is known, from what its own halves say.
//!
//! ```text
//! s² = κ · mean of |m₂ − m₁|²/4 over rests + q
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | m₁, m₂ | means over the first and the second half of a rest, one axis |
//! | κ | variance of noise slower than a rest over that within it, 1 where there is none |
//! | q | what the converter's steps leave of a mean where noise does not reach the next one ([`quantum`]) |
//!
//! The halves' difference is Allan's: it holds white noise, tremor and 1/f noise down to the rest's own duration.
//! Source: Allan 1966. Not held: what is slower than a rest.

use std::ops::Range;

use imucal_core::observation::Moments;
use nalgebra::Vector3;
use rayon::prelude::*;

use super::quantum;

/// Fewer samples are not halved.
const LEAST: usize = 8;

/// Variance of a rest's mean, each axis.
#[derive(Clone, Copy, Debug)]
pub struct MeanVariance {
    /// What the halves' differences come to.
    within: Vector3<f64>,
    /// q.
    steps: Vector3<f64>,
    /// Differences that say so.
    pub count: usize,
}

impl MeanVariance {
    /// s² for a κ.
    pub fn with_slower(&self, slower: f64) -> Vector3<f64> {
        self.within * slower + self.steps
    }
}

/// Variance of a rest's mean, of samples from a converter of such steps; `None` where no rest is long enough.
pub fn mean_variance(
    values: &[Vector3<f64>],
    usable: &[bool],
    rests: &[Range<usize>],
    step: &Vector3<f64>,
) -> Option<MeanVariance> {
    let differences = differences(values, usable, rests, 2);
    let count = differences.len();
    if count == 0 {
        return None;
    }
    let sum: Vector3<f64> = differences.iter().map(|d| d.map(|d| 0.25 * d * d)).sum();
    let of_axis = |axis: usize| {
        let samples = |rest: &Range<usize>| rest.clone().filter(|k| usable[*k]).map(move |k| values[k][axis]);
        let variances = quantum::variances_of_means(step[axis], rests.iter().map(samples));
        variances.iter().sum::<f64>() / variances.len() as f64
    };
    let mut steps = Vector3::zeros();
    steps.as_mut_slice().par_iter_mut().enumerate().for_each(|(axis, steps)| *steps = of_axis(axis));
    Some(MeanVariance { within: sum / count as f64, steps, count })
}

/// Mean of each second part less that of the part before it, of rests cut into so many parts that are long enough.
pub fn differences(
    values: &[Vector3<f64>],
    usable: &[bool],
    rests: &[Range<usize>],
    parts: usize,
) -> Vec<Vector3<f64>> {
    let mean = |rows: &[usize]| {
        let mut moments = Moments::default();
        rows.iter().for_each(|k| moments.push(&values[*k]));
        moments.mean()
    };
    let of_rest = |rest: &Range<usize>| {
        let rows: Vec<usize> = rest.clone().filter(|k| usable[*k]).collect();
        if rows.len() < LEAST {
            return Vec::new();
        }
        let part = |k: usize| mean(&rows[k * rows.len() / parts..(k + 1) * rows.len() / parts]);
        (0..parts / 2).map(|pair| part(2 * pair + 1) - part(2 * pair)).collect()
    };
    rests.iter().flat_map(of_rest).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::random::{Purpose, Random};

    #[test]
    fn white_noise_s_mean_has_the_variance_of_its_samples_over_their_count() {
        let mut random = Random::new(1, Purpose::Noise);
        let values: Vec<_> = (0..20_000).map(|_| random.normals() * 0.1).collect();
        let rests: Vec<_> = (0..200).map(|k| 100 * k..100 * (k + 1)).collect();
        let step = quantum::quantum(&values, &[true; 20_000]);
        let found = mean_variance(&values, &[true; 20_000], &rests, &step).unwrap();
        assert_eq!(found.count, 200);
        let variance = found.with_slower(1.0);
        assert!(variance.iter().all(|v| (v / 1e-4 - 1.0).abs() < 0.3), "{variance}");
    }

    #[test]
    fn a_mean_of_coarse_steps_is_no_finer_than_a_step() {
        let values: Vec<_> = (0..100).map(|k| Vector3::repeat(if k < 50 { 0.2 } else { 0.5 })).collect();
        let step = quantum::quantum(&values, &[true; 100]);
        let found = mean_variance(&values, &[true; 100], &[0..50, 50..100], &step).unwrap();
        let variance = found.with_slower(1.0);
        assert!((0.7..1.1).contains(&(variance.x / (0.09 / 12.0))), "{variance}");
    }
}

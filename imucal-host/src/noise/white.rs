//! White noise of a triad: one estimator a purpose.
//!
//! | purpose | estimator |
//! | --- | --- |
//! | errors of the means of rests: [`RestMeans::density`] | Allan variance at 0.5 s |
//! | weights of block means at rest: [`at_rest`] | steps between neighbouring pieces of a tenth of a second |
//! | weights of block means in motion: [`second_differences`] | second differences of residuals, since movements are smooth |
//! | size of a sample's noise, at rest or not: [`of_samples`] | median of steps from sample to sample |
//!
//! ```text
//! S = τ · ½ ⟨(ȳ_{k+1} − ȳ_k)²⟩        ȳ: means over τ, both of one rest
//! ```
//!
//! Means over τ = 0.5 s (Allan 1966) are long compared with a sensor's filter, which makes its samples alike, and short
//! compared with drift. The variance of a sample would be too small or too large by what the filter does.

use std::ops::Range;

use nalgebra::Vector3;

use crate::recording::order_statistics::{mean_without_largest, std_of_median};

/// τ, s.
pub(super) const AVERAGED: f64 = 0.5;
/// Fewer differences than this know the density to worse than a quarter.
const LEAST: usize = 48;
/// An axis cannot be quieter than this share of the noisiest: rounding has swallowed its noise.
const QUIETEST: f64 = 1e-3;

/// Means over τ in succession, of each rest on its own; `None` where samples are missing.
#[derive(Clone, Debug)]
pub struct RestMeans(Vec<Vec<Option<Vector3<f64>>>>);

impl RestMeans {
    /// Of the usable samples of rests.
    pub fn of(time: &[f64], values: &[Vector3<f64>], usable: &[bool], rests: &[Range<usize>]) -> Self {
        Self(rests.iter().map(|rows| means(time, values, usable, rows.clone())).collect())
    }

    /// Those of each rest.
    pub(super) fn rests(&self) -> impl Iterator<Item = &[Option<Vector3<f64>>]> {
        self.0.iter().map(Vec::as_slice)
    }

    /// Density of the white noise of each axis, unit²·s; `None` where the rests are too short or nothing but rounding moves the samples.
    pub fn density(&self) -> Option<Vector3<f64>> {
        let mut sum = Vector3::zeros();
        let mut count = 0;
        for pair in self.rests().flat_map(|means| means.windows(2)) {
            if let [Some(one), Some(next)] = pair {
                sum += (next - one).map(|step| step * step);
                count += 1;
            }
        }
        let density = sum * (0.5 * AVERAGED / f64::from(count));
        (count as usize >= LEAST && density.max().is_finite() && density.max() > 0.0)
            .then(|| density.map(|axis| axis.max(QUIETEST * density.max())))
    }
}

fn means(
    time: &[f64],
    values: &[Vector3<f64>],
    usable: &[bool],
    rows: Range<usize>,
) -> Vec<Option<Vector3<f64>>> {
    let begin = time[rows.start];
    let mut sums: Vec<(Vector3<f64>, f64)> = Vec::new();
    for row in rows.filter(|row| usable[*row]) {
        let at = ((time[row] - begin) / AVERAGED) as usize;
        // A jump of the clock is no reason to keep a sum for every interval of it.
        if at > sums.len() + 1000 {
            break;
        }
        if sums.len() <= at {
            sums.resize(at + 1, (Vector3::zeros(), 0.0));
        }
        sums[at].0 += values[row];
        sums[at].1 += 1.0;
    }
    let full = sums.iter().map(|(_, count)| *count).fold(0.0, f64::max);
    sums.into_iter().map(|(sum, count)| (count > 0.8 * full).then(|| sum / count)).collect()
}

/// A mean and how many samples it is of.
pub type Piece = (Vector3<f64>, f64);

/// Variance of one sample of each axis at rest, from steps between neighbouring pieces of so many rows of each stretch,
/// without the largest hundredth; zero without any.
pub fn at_rest(
    values: &[Vector3<f64>],
    usable: &[bool],
    stretches: impl Iterator<Item = Range<usize>>,
    rows: usize,
) -> [f64; 3] {
    let mut squares: [Vec<f64>; 3] = Default::default();
    for stretch in stretches {
        let stretch: Vec<usize> = stretch.collect();
        // A sensor may be slower than the recording: then some rows hold nothing of it.
        let pieces: Vec<Piece> = stretch
            .chunks_exact(rows)
            .filter_map(|rows| {
                let measured = rows.iter().filter(|row| usable[**row]);
                let (sum, count) =
                    measured.fold((Vector3::zeros(), 0.0), |(s, n), row| (s + values[*row], n + 1.0));
                (count > 0.0).then(|| (sum / count, count))
            })
            .collect();
        for pair in pieces.windows(2) {
            let ((before, m), (after, n)) = (pair[0], pair[1]);
            let step = after - before;
            let samples = 1.0 / (1.0 / m + 1.0 / n);
            squares.iter_mut().zip(step.iter()).for_each(|(s, step)| s.push(step * step * samples));
        }
    }
    squares.map(|squares| mean_without_largest(squares, 100))
}

/// Squared second differences of three neighbouring means, as variances of one sample, by axis.
pub fn second_differences([(a, l), (b, m), (c, n)]: [Piece; 3]) -> Vector3<f64> {
    let share = 1.0 / l + 4.0 / m + 1.0 / n;
    (a / l - 2.0 * b / m + c / n).map(|bend| bend * bend / share)
}

/// Standard deviation of a sample's noise: the largest of the axes'. Movements that last many samples hardly count.
pub fn of_samples(values: &[Vector3<f64>]) -> f64 {
    let of = |axis: usize| {
        let steps = values.windows(2).map(|pair| (pair[1][axis] - pair[0][axis]).abs());
        std_of_median(steps.filter(|step| step.is_finite()).collect()).unwrap_or(0.0) / 2.0f64.sqrt()
    };
    (0..3).map(of).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// 32 rests of 4 s at 100 Hz of noise through a one-pole filter of so much memory.
    fn found(memory: f64, drift: f64) -> Vector3<f64> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let time: Vec<f64> = (0..12_800).map(|k| 0.01 * f64::from(k)).collect();
        let mut state = Vector3::zeros();
        let values: Vec<Vector3<f64>> = time
            .iter()
            .map(|t| {
                let fresh = Vector3::new(normal(), 2.0 * normal(), 3.0 * normal());
                state = state * memory + fresh * (1.0 - memory);
                state + Vector3::repeat(drift * t)
            })
            .collect();
        let stretches: Vec<Range<usize>> = (0..32).map(|k| 400 * k..400 * (k + 1)).collect();
        RestMeans::of(&time, &values, &[true; 12_800], &stretches).density().unwrap()
    }

    #[test]
    fn the_density_is_that_of_long_means_despite_correlation_and_drift() {
        for (memory, drift) in [(0.0, 0.0), (0.8, 0.0), (0.0, 0.02)] {
            for (axis, sigma) in [1.0f64, 2.0, 3.0].into_iter().enumerate() {
                let ratio = found(memory, drift)[axis] / (0.01 * sigma * sigma);
                // 224 differences that share means know it to 11 %; the filter takes 9 % from means of half a second.
                assert!((0.7..1.25).contains(&ratio), "{memory} {drift} {axis}: {ratio}");
            }
        }
    }

    #[test]
    fn rests_that_are_too_short_or_too_still_tell_nothing() {
        let time: Vec<f64> = (0..1000).map(|k| 0.01 * f64::from(k)).collect();
        let still = vec![Vector3::x(); 1000];
        assert!(RestMeans::of(&time, &still, &[true; 1000], &[0..400, 500..900]).density().is_none());
        assert!(RestMeans::of(&time, &still, &[false; 1000], &[0..400, 500..900]).density().is_none());
    }
}

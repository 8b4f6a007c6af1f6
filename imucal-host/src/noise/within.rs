//! How probable each size of 1/f noise is by what moves within rests.
//!
//! ```text
//! ȳ_k = μ + e_k,   Cov(e) = S (I / τ + r Σ_T K_T)        of each axis and each rest
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | ȳ | means over τ = 0.5 s in succession ([`white`]) |
//! | μ | mean of the rest: any |
//! | S | density of the white noise: any |
//! | r | variance of each of the Gauss–Markov processes that 1/f noise is the sum of, over S, 1/s |
//! | K_T | covariance of the means of a process of correlation time T, a decade apart ([`flicker`]) |
//!
//! A fit has few residuals, a rest has many samples: where noise is 1/f, what it does within seconds shows how far it goes
//! in minutes. Likelihood: restricted, μ and S integrated out (Patterson & Thompson 1971). Not modelled: drift that begins
//! beyond a rest's length; a share of the prior is kept for that (`KEPT`).

use nalgebra::{Cholesky, DMatrix, Vector3};
use rayon::prelude::*;

use super::{Span, flicker, white, white::RestMeans};

/// The shortest correlation time that means over half a second distinguish from white noise, s.
const SHORTEST: f64 = 1.0;
/// Means of one stretch at most: a longer rest is several.
const LONGEST: usize = 40;
/// Share of the prior that what moves within rests does not alter.
const KEPT: f64 = 0.05;
/// Fewer distinct means of an axis come from a converter's steps, not from noise.
const DISTINCT: usize = 6;

/// Means within rests, in succession.
#[derive(Clone, Debug, Default)]
pub struct Within {
    stretches: Vec<Vec<Vector3<f64>>>,
}

impl Within {
    /// Of rests.
    pub fn of(rests: &RestMeans) -> Self {
        let mut stretches = Vec::new();
        for means in rests.rests() {
            for run in means.split(Option::is_none) {
                let run: Vec<Vector3<f64>> = run.iter().flatten().copied().collect();
                stretches.extend(run.chunks(LONGEST).filter(|run| run.len() > 1).map(<[_]>::to_vec));
            }
        }
        Self { stretches }
    }

    /// Whether there are any.
    pub fn is_empty(&self) -> bool {
        self.stretches.is_empty()
    }

    /// Prior weights of ratios after what moves within rests; `variance` turns a ratio into r, and `times` are the
    /// correlation times of the slower processes, s.
    pub fn weigh(
        &self,
        prior: &[(f64, f64)],
        times: &[f64],
        variance: impl Fn(f64) -> f64 + Sync,
    ) -> Vec<(f64, f64)> {
        if self.is_empty() {
            return prior.to_vec();
        }
        let drift = self.drift(times);
        let logs: Option<Vec<f64>> =
            prior.par_iter().map(|(ratio, _)| self.log(variance(*ratio), &drift)).collect();
        let Some(logs) = logs else { return prior.to_vec() };
        let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let likely: Vec<f64> =
            prior.iter().zip(&logs).map(|((_, weight), log)| weight * (log - most).exp()).collect();
        let (sum, all) = (likely.iter().sum::<f64>(), prior.iter().map(|(_, weight)| weight).sum::<f64>());
        let mixed = prior
            .iter()
            .zip(likely)
            .map(|((ratio, weight), likely)| (*ratio, (1.0 - KEPT) * all * likely / sum + KEPT * weight));
        mixed.collect()
    }

    /// Σ K_T of the longest stretch; that of a shorter one is its first part.
    fn drift(&self, times: &[f64]) -> DMatrix<f64> {
        let longest = self.stretches.iter().map(Vec::len).max().unwrap_or(0);
        let spans: Vec<Span> =
            (0..longest).map(|k| white::AVERAGED * k as f64..white::AVERAGED * (k + 1) as f64).collect();
        let all: Vec<f64> = std::iter::once(SHORTEST).chain(times.iter().copied()).collect();
        flicker::covariance_of(&spans, &flicker::of_times(&all, all.len() as f64))
    }

    /// Log-likelihood of r over all axes; `None` where nothing is left over.
    fn log(&self, r: f64, drift: &DMatrix<f64>) -> Option<f64> {
        let factor = Factor::of(r, drift)?;
        let freedom: usize = self.stretches.iter().map(|stretch| stretch.len() - 1).sum();
        let volume: f64 = self.stretches.iter().map(|stretch| factor.log_volume(stretch.len())).sum();
        let left: Vector3<f64> = self.stretches.iter().map(|stretch| factor.left(stretch)).sum();
        let axes = (0..3).filter(|axis| self.distinct(*axis) >= DISTINCT);
        let logs: Vec<f64> = axes.map(|axis| volume - 0.5 * freedom as f64 * left[axis].ln()).collect();
        (freedom > 0 && !logs.is_empty()).then(|| logs.iter().sum()).filter(|log: &f64| log.is_finite())
    }

    /// How many different means an axis has; no more are counted than matter.
    fn distinct(&self, axis: usize) -> usize {
        let mut seen: Vec<f64> = Vec::new();
        for mean in self.stretches.iter().flatten() {
            if seen.len() < DISTINCT && !seen.contains(&mean[axis]) {
                seen.push(mean[axis]);
            }
        }
        seen.len()
    }
}

/// Covariance of means in succession, C = L Lᵀ. The factor of fewer means is its first part.
struct Factor {
    lower: DMatrix<f64>,
    /// L⁻¹1.
    ones: Vec<f64>,
}

impl Factor {
    fn of(r: f64, drift: &DMatrix<f64>) -> Option<Self> {
        let count = drift.nrows();
        let white = DMatrix::identity(count, count) / white::AVERAGED;
        let lower = Cholesky::new(white + drift * r)?.unpack();
        let ones = whitened(&lower, vec![Vector3::repeat(1.0); count]).iter().map(|one| one.x).collect();
        Some(Self { lower, ones })
    }

    /// −½ ln|C| − ½ ln 1ᵀC⁻¹1 of so many means.
    fn log_volume(&self, count: usize) -> f64 {
        let log_root: f64 = self.lower.diagonal().iter().take(count).map(|entry| entry.ln()).sum();
        -log_root - 0.5 * self.ones[..count].iter().map(|one| one * one).sum::<f64>().ln()
    }

    /// Sum of squares about the best mean, whitened, of each axis.
    fn left(&self, stretch: &[Vector3<f64>]) -> Vector3<f64> {
        // About one of them first: a mean may be far from zero compared with its noise.
        let values = whitened(&self.lower, stretch.iter().map(|value| value - stretch[0]).collect());
        let (mut sum, mut total) = (Vector3::zeros(), 0.0);
        for (value, one) in values.iter().zip(&self.ones) {
            sum += value * *one;
            total += one * one;
        }
        let mean = sum / total;
        let about = values.iter().zip(&self.ones).map(|(value, one)| value - mean * *one);
        about.map(|about| about.component_mul(&about)).sum()
    }
}

/// L⁻¹ values, by the first rows of L.
fn whitened(lower: &DMatrix<f64>, mut values: Vec<Vector3<f64>>) -> Vec<Vector3<f64>> {
    for at in 0..values.len() {
        let value = values[at] / lower[(at, at)];
        values[at] = value;
        for (later, entry) in values.iter_mut().zip(lower.column(at).iter()).skip(at + 1) {
            *later -= value * *entry;
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use super::*;
    use crate::simulator::random::{Purpose, Random};

    /// The weight of no drift after 24 rests of 4 s at 50 Hz, with a drift of this standard deviation a decade.
    fn none_after(drift: f64) -> f64 {
        let mut random = Random::new(2, Purpose::Noise);
        let times = [1.0, 10.0, 100.0];
        let mut states = times.map(|_| random.normals() * drift);
        let mut sample = || {
            for (state, time) in states.iter_mut().zip(times) {
                let kept = (-0.02f64 / time).exp();
                *state = *state * kept + random.normals() * (drift * (1.0 - kept * kept).sqrt());
            }
            states.iter().sum::<Vector3<f64>>() + random.normals()
        };
        let values: Vec<Vector3<f64>> = (0..24 * 200).map(|_| sample()).collect();
        let time: Vec<f64> = (0..values.len()).map(|k| 0.02 * k as f64).collect();
        let rests: Vec<Range<usize>> = (0..24).map(|k| 200 * k..200 * (k + 1)).collect();
        let within = Within::of(&RestMeans::of(&time, &values, &vec![true; values.len()], &rests));
        let prior = [(0.0, 0.5), (0.5, 0.1), (2.0, 0.1), (8.0, 0.1), (32.0, 0.2)];
        within.weigh(&prior, &[10.0, 100.0], |ratio| ratio)[0].1
    }

    #[test]
    fn the_factor_of_many_means_is_that_of_fewer_too() {
        let stretch =
            |count: usize| (0..count).map(|k| Vector3::new(k as f64, 5.0, (k * k % 7) as f64)).collect();
        let within = Within { stretches: [12, 5].map(stretch).to_vec() };
        let drift = within.drift(&[10.0, 100.0]);
        let factor = Factor::of(0.7, &drift).unwrap();
        for stretch in &within.stretches {
            let count = stretch.len();
            let white = DMatrix::identity(count, count) / white::AVERAGED;
            let whole = (white + drift.view((0, 0), (count, count)) * 0.7).cholesky().unwrap();
            let weights = whole.solve(&DMatrix::repeat(count, 1, 1.0));
            let volume = -0.5 * (whole.ln_determinant() + weights.sum().ln());
            assert!((factor.log_volume(count) - volume).abs() < 1e-12, "{count}");
            for axis in 0..3 {
                let values = DMatrix::from_fn(count, 1, |k, _| stretch[k][axis]);
                let about = values.add_scalar(-weights.dot(&values) / weights.sum());
                let left = about.dot(&whole.solve(&about));
                assert!((factor.left(stretch)[axis] - left).abs() < 1e-12 * (1.0 + left), "{count} {axis}");
            }
        }
    }

    #[test]
    fn white_noise_makes_drift_less_probable_and_flicker_makes_it_sure() {
        // S is 0.02, so that a variance of 0.04 a decade is r = 2.
        let (white, flicker) = (none_after(0.0), none_after(0.2));
        assert!(white > 0.8, "{white}");
        assert!(flicker < 0.06, "{flicker}");
    }

    #[test]
    fn means_of_a_converter_s_few_steps_alter_nothing() {
        let values = vec![Vector3::new(1.0, 2.0, 3.0); 800];
        let time: Vec<f64> = (0..800).map(|k| 0.02 * f64::from(k)).collect();
        let within = Within::of(&RestMeans::of(&time, &values, &[true; 800], &[0..400, 400..800]));
        let prior = [(0.0, 0.5), (1.0, 0.5)];
        assert_eq!(within.weigh(&prior, &[10.0], |ratio| ratio), prior);
    }
}

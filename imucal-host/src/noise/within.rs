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

use std::{collections::BTreeMap, ops::Range};

use nalgebra::{Cholesky, DMatrix, DVector, Vector3};
use rayon::prelude::*;

use super::{Span, flicker, white};

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
    /// Of the usable samples of rests.
    pub fn of(time: &[f64], values: &[Vector3<f64>], usable: &[bool], rests: &[Range<usize>]) -> Self {
        let mut stretches = Vec::new();
        for rows in rests {
            let means = white::means(time, values, usable, rows.clone());
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
        let logs: Option<Vec<f64>> =
            prior.par_iter().map(|(ratio, _)| self.log(variance(*ratio), times)).collect();
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

    /// Log-likelihood of r over all axes; `None` where nothing is left over.
    fn log(&self, r: f64, times: &[f64]) -> Option<f64> {
        let mut factors: BTreeMap<usize, Factor> = BTreeMap::new();
        for stretch in &self.stretches {
            let count = stretch.len();
            if let std::collections::btree_map::Entry::Vacant(entry) = factors.entry(count) {
                entry.insert(Factor::of(count, r, times)?);
            }
        }
        let freedom: usize = self.stretches.iter().map(|stretch| stretch.len() - 1).sum();
        let volume: f64 = self.stretches.iter().map(|stretch| factors[&stretch.len()].log_volume).sum();
        let axes = (0..3).filter(|axis| self.distinct(*axis) >= DISTINCT);
        let log = |axis: usize| {
            let left: f64 =
                self.stretches.iter().map(|stretch| factors[&stretch.len()].left(stretch, axis)).sum();
            volume - 0.5 * freedom as f64 * left.ln()
        };
        let logs: Vec<f64> = axes.map(log).collect();
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

/// Covariance of so many means in succession, factorised.
struct Factor {
    factor: Cholesky<f64, nalgebra::Dyn>,
    /// C⁻¹1 and 1ᵀC⁻¹1.
    weight: (DVector<f64>, f64),
    /// −½ ln|C| − ½ ln 1ᵀC⁻¹1.
    log_volume: f64,
}

impl Factor {
    fn of(count: usize, r: f64, times: &[f64]) -> Option<Self> {
        let spans: Vec<Span> =
            (0..count).map(|k| white::AVERAGED * k as f64..white::AVERAGED * (k + 1) as f64).collect();
        let all: Vec<f64> = std::iter::once(SHORTEST).chain(times.iter().copied()).collect();
        let drift = flicker::covariance_of(&spans, &flicker::of_times(&all, all.len() as f64 * r));
        let factor = Cholesky::new(DMatrix::identity(count, count) / white::AVERAGED + drift)?;
        let weights = factor.solve(&DVector::repeat(count, 1.0));
        let total = weights.sum();
        let log_volume = -0.5 * (factor.ln_determinant() + total.ln());
        Some(Self { factor, weight: (weights, total), log_volume })
    }

    /// Sum of squares about the best mean, whitened.
    fn left(&self, stretch: &[Vector3<f64>], axis: usize) -> f64 {
        // About one of them first: a mean may be far from zero compared with its noise.
        let values = DVector::from_fn(stretch.len(), |k, _| stretch[k][axis] - stretch[0][axis]);
        let mean = self.weight.0.dot(&values) / self.weight.1;
        let about = values.add_scalar(-mean);
        about.dot(&self.factor.solve(&about))
    }
}

#[cfg(test)]
mod tests {
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
        let within = Within::of(&time, &values, &vec![true; values.len()], &rests);
        let prior = [(0.0, 0.5), (0.5, 0.1), (2.0, 0.1), (8.0, 0.1), (32.0, 0.2)];
        within.weigh(&prior, &[10.0, 100.0], |ratio| ratio)[0].1
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
        let within = Within::of(&time, &values, &[true; 800], &[0..400, 400..800]);
        let prior = [(0.0, 0.5), (1.0, 0.5)];
        assert_eq!(within.weigh(&prior, &[10.0], |ratio| ratio), prior);
    }
}

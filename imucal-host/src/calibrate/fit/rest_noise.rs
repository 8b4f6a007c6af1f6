//! What rests show of the noise of their means: white noise and the converter's steps, before any fit.

use std::ops::Range;

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::{
    noise::{Span, flicker, interval::Parts, white::RestMeans, within::Within},
    observe::quantum::variances_of_means,
    recording::Series,
};

/// An axis is no quieter than this share of what the axes are on average: rounding may have swallowed its noise.
const QUIETEST: f64 = 0.01;

/// A triad's samples, and when it rested.
#[derive(Clone, Copy, Debug)]
pub struct AtRest<'a> {
    /// The samples.
    pub series: Series<'a>,
    /// Rows of the rests.
    pub rows: &'a [Range<usize>],
    /// Step of the converter on each axis ([`crate::observe::quantum`]).
    pub step: Vector3<f64>,
}

/// Noise of the means of rests, each axis on its own.
#[derive(Clone, Debug)]
pub struct RestNoise {
    /// When they rested, s.
    pub spans: Vec<Span>,
    /// Density of the white noise, unit²·s; zero where no axis shows any.
    pub density: Vector3<f64>,
    /// Squared error that steps leave in each mean, unit².
    pub steps: Vec<Vector3<f64>>,
    /// Means within the rests.
    pub within: Within,
}

impl RestNoise {
    /// Of some of the rests; what moves within rests is that of all.
    #[must_use]
    pub fn of_those(&self, rests: &[usize]) -> Self {
        Self {
            spans: rests.iter().map(|k| self.spans[*k].clone()).collect(),
            steps: rests.iter().map(|k| self.steps[*k]).collect(),
            ..self.clone()
        }
    }

    /// Variances of the drift over the white noise, 1/s, with prior weights, for rests of these spans.
    pub fn drifts(&self, spans: &[Span]) -> Vec<(f64, f64)> {
        drifts(&self.within, spans)
    }
}

/// Variances of the drift over the white noise, 1/s, with their weights after what moves within the rests.
pub fn drifts(within: &Within, spans: &[Span]) -> Vec<(f64, f64)> {
    let observed = spans.iter().map(|span| span.end - span.start).sum();
    let times = flicker::times(spans);
    within.weigh(&Parts::drifts(observed, 2.0, 13), &times, |ratio| ratio / times.len() as f64)
}

impl AtRest<'_> {
    /// What the rests show of their means.
    pub fn noise(&self) -> RestNoise {
        self.noise_with_steps(|step, axis| {
            variances_of_means(step, self.rows.iter().map(|rows| self.along(rows, axis)))
        })
    }

    /// What the rests show of the samples of a cloud, of which those in a rest's neighbourhood err as the rest does: each
    /// rest on its own, so that nothing is taken off for where the others show that noise keeps a value.
    pub fn noise_of_cloud(&self) -> RestNoise {
        let alone = |step, rows, axis| variances_of_means(step, std::iter::once(self.along(rows, axis)));
        self.noise_with_steps(|step, axis| {
            self.rows.iter().flat_map(|rows| alone(step, rows, axis)).collect()
        })
    }

    fn along(&self, rows: &Range<usize>, axis: usize) -> impl Iterator<Item = f64> {
        self.samples(rows).map(move |v| v[axis])
    }

    fn noise_with_steps(&self, steps: impl Fn(f64, usize) -> Vec<f64> + Sync) -> RestNoise {
        let mut of_axes: [Vec<f64>; 3] = Default::default();
        of_axes.par_iter_mut().enumerate().for_each(|(axis, of)| *of = steps(self.step[axis], axis));
        let means = self.means();
        RestNoise {
            spans: self.rows.iter().map(|rows| self.span(rows)).collect(),
            density: self.density_of(&means),
            steps: (0..self.rows.len()).map(|k| Vector3::from_fn(|axis, _| of_axes[axis][k])).collect(),
            within: Within::of(&means),
        }
    }

    /// Means within the rests.
    pub fn means(&self) -> RestMeans {
        let Series { time, values, usable, .. } = self.series;
        RestMeans::of(time, values, usable, self.rows)
    }

    /// When each rest was.
    pub fn spans(&self) -> Vec<Span> {
        self.rows.iter().map(|rows| self.span(rows)).collect()
    }

    fn span(&self, rows: &Range<usize>) -> Span {
        self.series.time[rows.start]..self.series.time[rows.end - 1] + self.series.interval
    }

    /// Usable samples of some rows.
    pub fn samples(&self, rows: &Range<usize>) -> impl Iterator<Item = &Vector3<f64>> {
        rows.clone().filter(|k| self.series.usable[*k]).map(|k| &self.series.values[k])
    }

    /// Density of the white noise: of means half a second apart, or of the samples where rests are too short for that.
    pub fn density_of(&self, means: &RestMeans) -> Vector3<f64> {
        let density = means.density().unwrap_or_else(|| self.variance() * self.series.interval);
        let least = QUIETEST * density.mean();
        density.map(|axis| axis.max(least))
    }

    /// Variance of a sample within rests.
    fn variance(&self) -> Vector3<f64> {
        let (mut squares, mut freedom) = (Vector3::zeros(), 0.0);
        for rows in self.rows {
            let count = self.samples(rows).count() as f64;
            if count > 1.0 {
                let mean = self.samples(rows).sum::<Vector3<f64>>() / count;
                squares += self.samples(rows).map(|v| (v - mean).map(|d| d * d)).sum::<Vector3<f64>>();
                freedom += count - 1.0;
            }
        }
        if freedom > 0.0 { squares / freedom } else { Vector3::zeros() }
    }
}

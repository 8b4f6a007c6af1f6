//! What a cubic through a sample's neighbours does not foretell.
//!
//! ```text
//! e_k = x_k − (4 (x_{k−1} + x_{k+1}) − (x_{k−2} + x_{k+2})) / 6
//! ```

use std::ops::Range;

use nalgebra::Vector3;

use crate::recording::median;

/// Neighbours further apart than so many intervals foretell nothing.
const APART: f64 = 1.6;
/// An impact is larger by this factor than the median of |e| about it.
const STANDS_OUT: f64 = 6.0;
/// Length of the stretches over which medians are taken, s, and so many of them to each side.
const STRETCH: f64 = 0.5;
const ABOUT: usize = 2;
/// Median of the squared length of three normal numbers.
const MEDIAN_OF_THREE_SQUARES: f64 = 2.366;

/// e of samples that have four neighbours, by time, s.
pub struct Unforeseen {
    samples: Vec<(f64, Vector3<f64>)>,
    /// Median interval, s.
    pub interval: f64,
}

/// e within a span.
pub struct Within {
    /// Integral of |e|², by time.
    pub power: f64,
    /// Largest |e|.
    pub largest: f64,
}

impl Unforeseen {
    /// Of samples at times, s.
    pub fn of(time: &[f64], values: &[Vector3<f64>]) -> Self {
        let interval = interval(time);
        let of = |(t, x): (&[f64], &[Vector3<f64>])| {
            let even = t.windows(2).all(|pair| pair[1] - pair[0] < APART * interval);
            let size = unforeseen([x[0], x[1], x[2], x[3], x[4]]);
            (even && size.iter().all(|own| own.is_finite())).then_some((t[2], size))
        };
        Self { samples: time.windows(5).zip(values.windows(5)).filter_map(of).collect(), interval }
    }

    /// Of one in so many samples that these are about so far apart, s.
    pub fn at_interval(time: &[f64], values: &[Vector3<f64>], apart: f64) -> Self {
        let stride = (apart / interval(time).max(f64::MIN_POSITIVE)).round().max(1.0) as usize;
        let times: Vec<f64> = time.iter().step_by(stride).copied().collect();
        let values: Vec<Vector3<f64>> = values.iter().step_by(stride).copied().collect();
        Self::of(&times, &values)
    }

    /// Times and e of the samples in a span, s.
    pub fn samples(&self, span: &Range<f64>) -> &[(f64, Vector3<f64>)] {
        let from = self.samples.partition_point(|(time, _)| *time < span.start);
        let to = self.samples.partition_point(|(time, _)| *time <= span.end);
        &self.samples[from..to.max(from)]
    }

    /// Power and size in a span, s.
    pub fn within(&self, span: &Range<f64>) -> Within {
        let sizes = || self.samples(span).iter().map(|(_, e)| e.norm());
        Within {
            power: sizes().map(|size| size * size).sum::<f64>() * self.interval,
            largest: sizes().fold(0.0, f64::max),
        }
    }

    /// The median of all |e|.
    pub fn usual(&self) -> f64 {
        median(self.samples.iter().map(|(_, e)| e.norm()).collect()).unwrap_or(0.0)
    }

    /// Power of three axes' noise in a sample, over all samples.
    pub fn noise(&self) -> f64 {
        noise(&self.samples)
    }

    /// The same of the samples in a span, s.
    pub fn noise_near(&self, span: &Range<f64>) -> f64 {
        noise(self.samples(span))
    }

    /// Least |e| of an impact, where the usual is that of all.
    pub fn floor(&self) -> f64 {
        STANDS_OUT * self.usual()
    }

    /// Times at which |e| is far larger than about it, and larger than `floor`.
    pub fn impacts(&self, floor: f64) -> Vec<f64> {
        let begins = self.samples.first().map_or(0.0, |(time, _)| *time);
        let stretch = |time: f64| ((time - begins) / STRETCH) as usize;
        let mut sizes: Vec<Vec<f64>> = Vec::new();
        for (time, e) in &self.samples {
            let at = stretch(*time);
            if sizes.len() <= at {
                sizes.resize(at + 1, Vec::new());
            }
            sizes[at].push(e.norm());
        }
        let medians: Vec<Option<f64>> = sizes.into_iter().map(median).collect();
        let about = |at: usize| {
            let near = medians[at.saturating_sub(ABOUT)..(at + ABOUT + 1).min(medians.len())].iter();
            median(near.flatten().copied().collect()).unwrap_or(0.0)
        };
        let limits: Vec<f64> = (0..medians.len()).map(|at| (STANDS_OUT * about(at)).max(floor)).collect();
        let is_impact = |(time, e): &&(f64, Vector3<f64>)| e.norm() > limits[stretch(*time)];
        self.samples.iter().filter(is_impact).map(|(time, _)| *time).collect()
    }
}

/// Mean of |e|² by its median, which a few impacts do not move.
fn noise(samples: &[(f64, Vector3<f64>)]) -> f64 {
    3.0 / MEDIAN_OF_THREE_SQUARES
        * median(samples.iter().map(|(_, e)| e.norm_squared()).collect()).unwrap_or(0.0)
}

/// e of the third of five samples.
pub fn unforeseen(x: [Vector3<f64>; 5]) -> Vector3<f64> {
    x[2] - ((x[1] + x[3]) * 4.0 - (x[0] + x[4])) / 6.0
}

/// Median interval, s.
pub fn interval(time: &[f64]) -> f64 {
    median(time.windows(2).map(|pair| pair[1] - pair[0]).collect()).unwrap_or(0.0)
}

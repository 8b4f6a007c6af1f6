//! A vector between its samples: a cubic with the slopes of the neighbours.
//!
//! ```text
//! x(s) = x_k + (l + (b + c u) u) u,   u = (s − t_k) / h,   c = l + a − 2 Δ,   b = Δ − l − c
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | h, Δ | time and difference between the two samples |
//! | l, a | slope times h at the first and at the second: that of the parabola through a sample and its two neighbours |
//!
//! Source: Catmull and Rom, A class of local interpolating splines (1974), for uneven samples.

use nalgebra::{Matrix3, Vector3};

/// Samples with the slope of each.
#[derive(Clone, Debug)]
pub struct Cubic {
    /// The samples, without gaps.
    pub values: Vec<Vector3<f64>>,
    /// Their slopes, per s.
    pub slopes: Vec<Vector3<f64>>,
}

impl Cubic {
    /// Through samples at times, s, of which there are two at least. Missing samples lie on the line between their
    /// neighbours.
    pub fn new(time: &[f64], values: &[Vector3<f64>]) -> Self {
        let values = bridged(time, values);
        let slope = |k: usize| {
            let (before, after) = (k.saturating_sub(1), (k + 1).min(values.len() - 1));
            let over = |a: usize, b: usize| (values[b] - values[a]) / (time[b] - time[a]);
            if before == k || after == k {
                return over(before, after);
            }
            // The slope of the parabola through three samples.
            let (left, right) = (time[k] - time[before], time[after] - time[k]);
            (over(before, k) * right + over(k, after) * left) / (left + right)
        };
        Self { slopes: (0..values.len()).map(slope).collect(), values }
    }

    /// In other axes.
    #[must_use]
    pub fn turned(mut self, c: &Matrix3<f64>) -> Self {
        self.values.iter_mut().chain(&mut self.slopes).for_each(|value| *value = c * *value);
        self
    }

    /// Value and slope at a time between samples `k` and `k + 1` of these times; beyond them those of the nearer one.
    pub fn at(&self, time: &[f64], k: usize, s: f64) -> (Vector3<f64>, Vector3<f64>) {
        let span = time[k + 1] - time[k];
        let x = ((s - time[k]) / span).clamp(0.0, 1.0);
        let (from, to) = (self.values[k], self.values[k + 1]);
        let (leaves, arrives) = (self.slopes[k] * span, self.slopes[k + 1] * span);
        let (square, cube) = (to - from, leaves + arrives - (to - from) * 2.0);
        let bend = square - leaves - cube;
        let value = from + (leaves + (bend + cube * x) * x) * x;
        let slope = (leaves + (bend * 2.0 + cube * (3.0 * x)) * x) / span;
        (value, slope)
    }
}

/// The sample at or before a time of which there is another one after it.
pub fn sample_before(time: &[f64], s: f64) -> usize {
    time.partition_point(|t| *t <= s).clamp(1, time.len() - 1) - 1
}

/// Samples with missing ones put on the line between their neighbours.
fn bridged(time: &[f64], values: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let given: Vec<usize> =
        (0..values.len()).filter(|k| values[*k].iter().all(|value| value.is_finite())).collect();
    let mut bridged = values.to_vec();
    let (Some(first), Some(last)) = (given.first().copied(), given.last().copied()) else {
        return vec![Vector3::zeros(); values.len()];
    };
    bridged[..first].fill(values[first]);
    bridged[last..].fill(values[last]);
    for pair in given.windows(2) {
        for k in pair[0] + 1..pair[1] {
            let share = (time[k] - time[pair[0]]) / (time[pair[1]] - time[pair[0]]);
            bridged[k] = values[pair[0]] + (values[pair[1]] - values[pair[0]]) * share;
        }
    }
    bridged
}

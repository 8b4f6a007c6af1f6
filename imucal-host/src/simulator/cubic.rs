//! A vector between its samples: a cubic with the slopes of the neighbours.
//!
//! ```text
//! x(s) = x_k + (l + (b + c u) u) u,   u = (s − t_k) / h,   c = l + a − 2 Δ,   b = Δ − l − c
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | h, Δ | time and difference between the two samples |
//! | l, a | slope times h at the first and at the second: of the polynomial through it and two neighbours on each side |
//!
//! Next to an end or a gap slopes are those of the parabola through a sample and its two neighbours.
//!
//! Of a smooth movement it is wrong by h⁴ x⁗ / 384 at the most, as the unit test on a sway shows.
//!
//! Source: Catmull and Rom, A class of local interpolating splines (1974), for uneven samples and wider slopes.

use std::ops::RangeInclusive;

use nalgebra::{Matrix3, Vector3};

/// Samples to each side that a slope is taken from.
const WIDE: usize = 2;
/// Intervals that differ by more than this factor are those of a gap.
const UNEVEN: f64 = 2.0;

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
            let reach = WIDE.min(k).min(values.len() - 1 - k);
            let about = k - reach..=k + reach;
            let (least, most) =
                time[about.clone()].windows(2).fold((f64::INFINITY, 0.0f64), |(least, most), pair| {
                    let interval = pair[1] - pair[0];
                    (least.min(interval), most.max(interval))
                });
            match reach {
                0 if k == 0 => (values[1] - values[0]) / (time[1] - time[0]),
                0 => (values[k] - values[k - 1]) / (time[k] - time[k - 1]),
                WIDE if most > UNEVEN * least => polynomial_slope(time, &values, k, k - 1..=k + 1),
                _ => polynomial_slope(time, &values, k, about),
            }
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

/// Slope at sample `k` of the polynomial through these samples, by Lagrange's formula.
fn polynomial_slope(
    time: &[f64],
    values: &[Vector3<f64>],
    k: usize,
    through: RangeInclusive<usize>,
) -> Vector3<f64> {
    let others = through.clone().filter(|i| *i != k);
    let weight = |i: usize| {
        let apart = through.clone().filter(|j| *j != i && *j != k);
        let share: f64 = apart.map(|j| (time[k] - time[j]) / (time[i] - time[j])).product();
        share / (time[i] - time[k])
    };
    others.map(|i| (values[i] - values[k]) * weight(i)).sum()
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest error between samples of a sway of 1 rad/s, so many a second.
    fn error(rate: f64) -> f64 {
        let time: Vec<f64> = (0..400).map(|k| f64::from(k) / rate).collect();
        let values: Vec<_> = time.iter().map(|t| Vector3::repeat(t.sin())).collect();
        let cubic = Cubic::new(&time, &values);
        let middles = time.windows(2).skip(3).take(time.len() - 7).map(|pair| 0.5 * (pair[0] + pair[1]));
        let errors = middles.map(|s| (cubic.at(&time, sample_before(&time, s), s).0.x - s.sin()).abs());
        errors.fold(0.0, f64::max)
    }

    #[test]
    fn between_samples_of_a_smooth_movement_it_errs_by_the_fourth_power_of_their_interval() {
        for rate in [5.0f64, 10.0, 20.0] {
            let stated = rate.powi(-4) / 384.0;
            let found = error(rate) / stated;
            assert!((0.9..1.5).contains(&found), "{rate}: {found}");
        }
    }

    #[test]
    fn a_quartic_has_its_slope_at_uneven_samples_and_a_parabola_next_to_a_gap() {
        let even = [0.0, 1.0, 2.5, 3.7, 5.0, 6.1];
        let quartic: Vec<_> = even.iter().map(|t: &f64| Vector3::repeat(t.powi(4) - t.powi(3))).collect();
        let slope = Cubic::new(&even, &quartic).slopes[3].x;
        let expected = 4.0 * 3.7f64.powi(3) - 3.0 * 3.7f64.powi(2);
        assert!((slope - expected).abs() < 1e-9, "{slope} {expected}");
        let gap = [0.0, 1.0, 2.0, 3.0, 30.0, 31.0];
        let parabola: Vec<_> = gap.iter().map(|t: &f64| Vector3::repeat(t * t)).collect();
        let slopes = Cubic::new(&gap, &parabola).slopes;
        assert!((slopes[3].x - 6.0).abs() < 1e-9 && (slopes[5].x - 61.0).abs() < 1e-9, "{slopes:?}");
    }
}

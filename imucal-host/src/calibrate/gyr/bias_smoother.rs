//! How a gyroscope's bias wanders over a recording: its means at rest, smoothed no more than their noise asks for.
//!
//! ```text
//! y_i = b(t_i) + v_i,   v_i ~ N(0, R_i),   b(t_{i+1}) = b(t_i) + w_i,   w_i ~ N(0, q (t_{i+1} − t_i))
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | y_i, R_i | mean rate of still stretch i less Earth's rotation, and its variance from the samples' own |
//! | b, q | bias, one axis; variance of its walk a second, by maximum likelihood over a grid |
//!
//! Source: the local level model, filtered and smoothed (Rauch, Tung & Striebel 1965). A walk is kept where it raises
//! the log-likelihood by [`WALKS`]; otherwise the bias is one constant and the path is zero.

use nalgebra::Vector3;

use crate::{calibrate::outcome::BiasWander, noise::Span};

/// Least gain of the log-likelihood for which a bias is taken to walk: chance explains it once in 200 times.
pub const WALKS: f64 = 3.3;

/// The mean rate of one still stretch.
#[derive(Clone, Debug)]
pub struct Still {
    /// When, s.
    pub span: Span,
    /// Mean rate less Earth's rotation, rad/s.
    pub mean: Vector3<f64>,
    /// Variance of the mean if the samples' noise is white, (rad/s)².
    pub variance: Vector3<f64>,
}

impl Still {
    /// Middle of it, s.
    pub fn time(&self) -> f64 {
        0.5 * (self.span.start + self.span.end)
    }
}

/// How far the bias is from its mean, linear between the still stretches.
#[derive(Clone, Debug, Default)]
pub struct Wander {
    nodes: Vec<(f64, Vector3<f64>)>,
}

impl Wander {
    /// The path of some still stretches in time order, with what it comes to.
    pub fn of(stills: &[Still]) -> (Self, Vector3<f64>, BiasWander) {
        let count = stills.len().max(1) as f64;
        let mean = stills.iter().map(|s| s.mean).sum::<Vector3<f64>>() / count;
        let mut spread = Vector3::zeros();
        let mut expected = Vector3::zeros();
        let mut path = vec![Vector3::zeros(); stills.len()];
        let mut interpolated = false;
        for axis in 0..3 {
            let of = |value: &dyn Fn(&Still) -> f64| stills.iter().map(value).sum::<f64>();
            spread[axis] = (of(&|s| (s.mean[axis] - mean[axis]).powi(2)) / (count - 1.0).max(1.0)).sqrt();
            expected[axis] = (of(&|s| s.variance[axis]) / count).sqrt();
            let points: Vec<Point> =
                stills.iter().map(|s| Point { t: s.time(), y: s.mean[axis], r: s.variance[axis] }).collect();
            if let Some(smooth) = walk(&points) {
                interpolated = true;
                let level = smooth.iter().sum::<f64>() / count;
                path.iter_mut().zip(smooth).for_each(|(node, value)| node[axis] = value - level);
            }
        }
        let nodes = stills.iter().map(Still::time).zip(path).collect();
        (Self { nodes }, mean, BiasWander { spread, expected, interpolated })
    }

    /// The path through some values, one a still stretch; nothing without any.
    pub fn through(stills: &[Still], values: &[Vector3<f64>]) -> Self {
        Self { nodes: stills.iter().map(Still::time).zip(values.iter().copied()).collect() }
    }

    /// The bias less its mean at a time, rad/s.
    pub fn at(&self, time: f64) -> Vector3<f64> {
        let next = self.nodes.partition_point(|(t, _)| *t <= time);
        let (before, after) = (next.checked_sub(1).and_then(|k| self.nodes.get(k)), self.nodes.get(next));
        match (before, after) {
            (Some((t, from)), Some((end, to))) => from + (to - from) * ((time - t) / (end - t)),
            (Some((_, only)), None) | (None, Some((_, only))) => *only,
            (None, None) => Vector3::zeros(),
        }
    }
}

/// A measured level of one axis.
#[derive(Clone, Copy, Debug)]
struct Point {
    t: f64,
    y: f64,
    r: f64,
}

/// The smoothed levels, where a walk explains them better than a constant.
fn walk(points: &[Point]) -> Option<Vec<f64>> {
    let [first, .., last] = points else { return None };
    let noise = points.iter().map(|p| p.r).sum::<f64>() / points.len() as f64;
    let spacing = (last.t - first.t) / (points.len() - 1) as f64;
    let constant = filter(points, 0.0).0;
    let trials = (-16..=24).map(|k| noise / spacing * 10f64.powf(0.25 * f64::from(k)));
    let best = trials.map(|q| (filter(points, q).0, q)).max_by(|a, b| a.0.total_cmp(&b.0))?;
    (best.0 - constant > WALKS).then(|| smooth(points, best.1))
}

/// Log-likelihood given the first point, and the filtered level and its variance at each.
fn filter(points: &[Point], q: f64) -> (f64, Vec<(f64, f64)>) {
    let mut likelihood = 0.0;
    let mut levels: Vec<(f64, f64)> = Vec::with_capacity(points.len());
    for (k, point) in points.iter().enumerate() {
        let Some((level, p)) = levels.last().copied() else {
            levels.push((point.y, point.r));
            continue;
        };
        let p = p + q * (point.t - points[k - 1].t);
        let (innovation, s) = (point.y - level, p + point.r);
        likelihood -= 0.5 * (innovation * innovation / s + s.ln());
        let gain = p / s;
        levels.push((level + gain * innovation, p * (1.0 - gain)));
    }
    (likelihood, levels)
}

fn smooth(points: &[Point], q: f64) -> Vec<f64> {
    let (_, filtered) = filter(points, q);
    let mut levels: Vec<f64> = filtered.iter().map(|(level, _)| *level).collect();
    for k in (0..levels.len().saturating_sub(1)).rev() {
        let p = filtered[k].1;
        let ahead = p + q * (points[k + 1].t - points[k].t);
        levels[k] += p / ahead * (levels[k + 1] - levels[k]);
    }
    levels
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stills(bias: &dyn Fn(f64) -> f64) -> Vec<Still> {
        (0..30)
            .map(|k| {
                let time = 7.0 * f64::from(k);
                let noise = 1e-4 * (1.9 * f64::from(k * k)).sin() * 2f64.sqrt();
                let mean = Vector3::new(bias(time) + noise, noise, -noise);
                Still { span: time - 2.0..time + 2.0, mean, variance: Vector3::repeat(1e-8) }
            })
            .collect()
    }

    #[test]
    fn noise_alone_is_no_wander() {
        let (wander, mean, found) = Wander::of(&stills(&|_| 0.02));
        assert!(!found.interpolated && (mean.x - 0.02).abs() < 1e-4);
        assert_eq!(wander.at(33.0), Vector3::zeros());
    }

    #[test]
    fn a_bias_that_swings_by_ten_times_the_noise_is_followed() {
        let bias = |t: f64| 1e-3 * (t / 30.0).sin();
        let (wander, mean, found) = Wander::of(&stills(&bias));
        assert!(found.interpolated);
        for k in 0..200 {
            let t = f64::from(k);
            assert!((wander.at(t).x + mean.x - bias(t)).abs() < 3e-4, "{t}");
        }
    }
}

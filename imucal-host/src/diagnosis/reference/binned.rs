//! A vector's samples as means over short, even bins, each at the mean of its samples' times.

use std::ops::Range;

use nalgebra::Vector3;

/// Bins about a place that are searched first.
const NEAR: usize = 4;

/// Means over bins.
#[derive(Clone, Debug)]
pub(super) struct Binned {
    /// Means of the times, s; bins without a sample are left out.
    pub time: Vec<f64>,
    /// Means of the samples.
    pub values: Vec<Vector3<f64>>,
    /// Length of a bin, s.
    pub step: f64,
}

impl Binned {
    /// Of samples in the order of their times.
    pub fn new(samples: impl Iterator<Item = (f64, Vector3<f64>)>, step: f64) -> Self {
        let mut binned = Self { time: Vec::new(), values: Vec::new(), step };
        let mut bin = (f64::NEG_INFINITY, 0.0);
        for (time, value) in samples {
            let own = (time / step).floor();
            if own > bin.0 {
                binned.time.push(time);
                binned.values.push(value);
                bin = (own, 1.0);
            } else if let (Some(mean_time), Some(mean)) = (binned.time.last_mut(), binned.values.last_mut()) {
                bin.1 += 1.0;
                *mean_time += (time - *mean_time) / bin.1;
                *mean += (value - *mean) / bin.1;
            }
        }
        binned
    }

    /// On the line between the means before and after a time; `None` beyond the ends.
    pub fn at(&self, time: f64) -> Option<Vector3<f64>> {
        let after = self.after(time);
        let before = after.checked_sub(1)?;
        let (next, share) =
            (self.values.get(after)?, (time - self.time[before]) / (self.time[after] - self.time[before]));
        Some(self.values[before] + (next - self.values[before]) * share)
    }

    /// The first bin after a time: near where it would be if no bin were missing, or anywhere.
    fn after(&self, time: f64) -> usize {
        let place = self.time.first().map_or(0.0, |first| (time - first) / self.step).max(0.0) as usize;
        let near = place.saturating_sub(NEAR)..(place + NEAR).min(self.time.len());
        let found = self.time.get(near.clone()).map(|times| times.partition_point(|own| *own <= time));
        match found {
            Some(within) if 0 < within && within < near.len() => near.start + within,
            _ => self.time.partition_point(|own| *own <= time),
        }
    }

    /// Bins whose time lies in a range.
    pub fn within(&self, range: &Range<f64>) -> Range<usize> {
        let of = |bound: f64| self.time.partition_point(|time| *time < bound);
        of(range.start)..of(range.end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_repeated_wherever_its_samples_lie_and_gaps_are_bridged() {
        let times = (0..400).map(|k| 0.007 * f64::from(k)).filter(|t| !(1.0..1.3).contains(t));
        let line = |t: f64| Vector3::new(t, 2.0 - t, 0.5 * t);
        let binned = Binned::new(times.map(|t| (t, line(t))), 0.02);
        for t in [0.1, 0.777, 1.15, 2.5] {
            assert!((binned.at(t).unwrap() - line(t)).norm() < 1e-12, "{t}");
        }
        assert!(binned.at(-0.1).is_none() && binned.at(3.0).is_none());
        let within = binned.within(&(0.5..0.6));
        assert!(binned.time[within].iter().all(|t| (0.5..0.6).contains(t)));
    }
}

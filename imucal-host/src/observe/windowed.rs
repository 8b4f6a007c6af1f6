//! Variance and mean of the window around each row.
//!
//! Two running sums follow the ends of the window by the same additions; their difference is the window's sum. Nothing is kept of the
//! rows between.

use std::ops::Range;

use nalgebra::Vector3;

use super::rest::Samples;

/// A window is used while this share of its rows is usable: dropouts are common, clipping is long.
const USABLE_SHARE: f64 = 0.8;

/// Rows around each row that its window holds.
fn window(k: usize, half: usize, rows: usize) -> Range<usize> {
    k.saturating_sub(half)..k.saturating_add(half).saturating_add(1).min(rows)
}

/// Sums of the usable rows before one, and of the gaps. `origin` is a value near the data, so that differences of sums lose no digits
/// that matter.
#[derive(Clone, Copy)]
struct RunningSquares<'a> {
    samples: Samples<'a>,
    origin: Vector3<f64>,
    longest_gap: f64,
    row: usize,
    sum: Vector3<f64>,
    square: f64,
    count: u32,
    gaps: u32,
}

impl<'a> RunningSquares<'a> {
    fn new(samples: Samples<'a>, longest_gap: f64) -> Self {
        let first_usable = samples.acc.iter().zip(samples.usable).find(|(_, usable)| **usable);
        let origin = first_usable.map(|(value, _)| *value).unwrap_or_default();
        let sum = Vector3::zeros();
        Self { samples, origin, longest_gap, row: 0, sum, square: 0.0, count: 0, gaps: 0 }
    }

    /// Takes the rows up to `row`, which it does not hold itself.
    fn advance(&mut self, row: usize) {
        let Samples { time, acc, usable, .. } = self.samples;
        for k in self.row..row {
            if k > 0 && time[k] - time[k - 1] > self.longest_gap {
                self.gaps += 1;
            }
            if usable[k] {
                let x = acc[k] - self.origin;
                self.sum += x;
                self.square += x.norm_squared();
                self.count += 1;
            }
        }
        self.row = row;
    }
}

/// Variance of the usable rows around each row, sum over the axes; infinite where too few of them are, or time jumps.
pub(super) fn variance(samples: Samples<'_>, half: usize, longest_gap: f64) -> Vec<f64> {
    let rows = samples.acc.len();
    let mut from = RunningSquares::new(samples, longest_gap);
    let mut to = from;
    (0..rows)
        .map(|k| {
            let w = window(k, half, rows);
            from.advance(w.start);
            to.advance(w.end);
            let n = f64::from(to.count - from.count);
            if to.gaps > from.gaps || n < USABLE_SHARE * w.len() as f64 {
                return f64::INFINITY;
            }
            let mean = (to.sum - from.sum) / n;
            ((to.square - from.square) / n - mean.norm_squared()).max(0.0)
        })
        .collect()
}

/// Sum of the usable rows before one.
#[derive(Clone, Copy)]
struct RunningSum<'a> {
    values: &'a [Vector3<f64>],
    usable: &'a [bool],
    row: usize,
    sum: Vector3<f64>,
    count: u32,
}

impl RunningSum<'_> {
    /// Takes the rows up to `row`, which it does not hold itself.
    fn advance(&mut self, row: usize) {
        for k in (self.row..row).filter(|k| self.usable[*k]) {
            self.sum += self.values[k];
            self.count += 1;
        }
        self.row = row;
    }
}

/// Mean of the usable rows around each row; zero where there is none.
pub(super) fn mean(values: &[Vector3<f64>], usable: &[bool], half: usize) -> Vec<Vector3<f64>> {
    let rows = values.len();
    let mut from = RunningSum { values, usable, row: 0, sum: Vector3::zeros(), count: 0 };
    let mut to = from;
    (0..rows)
        .map(|k| {
            let w = window(k, half, rows);
            from.advance(w.start);
            to.advance(w.end);
            (to.sum - from.sum) / f64::from((to.count - from.count).max(1))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_have_the_variance_and_the_mean_of_their_usable_rows() {
        let time: Vec<f64> = (0..60).map(|k| 0.1 * f64::from(k) + if k < 40 { 0.0 } else { 3.0 }).collect();
        let values: Vec<Vector3<f64>> =
            time.iter().map(|t| Vector3::new((3.0 * t).sin(), 9.8 + 0.1 * t, (7.0 * t).cos())).collect();
        let usable: Vec<bool> = (0..60).map(|k| k % 17 != 5 && !(20..25).contains(&k)).collect();
        let samples = Samples { time: &time, acc: &values, gyr: None, temperature: None, usable: &usable };
        let (half, rows) = (5, values.len());
        let (variances, means) = (variance(samples, half, 1.0), mean(&values, &usable, half));
        let mut infinite = 0;
        for k in 0..rows {
            let w = window(k, half, rows);
            let held: Vec<&Vector3<f64>> = w.clone().filter(|k| usable[*k]).map(|k| &values[k]).collect();
            let count = held.len() as f64;
            let centre = held.iter().copied().sum::<Vector3<f64>>() / count;
            assert!((means[k] - centre).norm() < 1e-12, "{k}");
            // A gap counts at the row behind it.
            if w.contains(&40) || count < USABLE_SHARE * w.len() as f64 {
                infinite += 1;
                assert_eq!(variances[k], f64::INFINITY, "{k}");
            } else {
                let squares: f64 = held.iter().map(|value| (*value - centre).norm_squared()).sum();
                assert!((variances[k] - squares / count).abs() < 1e-12, "{k}");
            }
        }
        assert!(infinite > 10 && infinite < rows, "{infinite}");
    }
}

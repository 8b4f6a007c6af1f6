//! Mean and variance of the window around each row.
//!
//! Two running sums follow the ends of the window by the same additions; their difference is the window's sum. Nothing is kept of the
//! rows between.

use std::ops::Range;

use nalgebra::Vector3;

use crate::recording::Series;

/// A window is used while this share of its samples is usable: dropouts are common, clipping is long.
pub(super) const USABLE_SHARE: f64 = 0.8;

/// A gap longer than this many usual intervals ends a rest.
const GAP: f64 = 5.0;

/// Samples a row, where rows are `interval` s apart: below one where other sensors are measured between them.
pub(super) fn density(series: Series<'_>, interval: f64) -> f64 {
    (interval / series.interval).min(1.0)
}

/// What the usable rows of a window come to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    /// Their mean; zero where there is none.
    pub mean: Vector3<f64>,
    /// Their variance, sum over the axes; infinite where too few rows are usable, or time jumps.
    pub variance: f64,
}

/// Rows around each row that its window holds.
fn window(k: usize, half: usize, rows: usize) -> Range<usize> {
    k.saturating_sub(half)..k.saturating_add(half).saturating_add(1).min(rows)
}

/// Sums of the usable rows before one, and of the gaps. `origin` is a value near the data, so that differences of sums lose no digits
/// that matter.
#[derive(Clone, Copy)]
struct RunningSums<'a> {
    series: Series<'a>,
    origin: Vector3<f64>,
    longest_gap: f64,
    row: usize,
    sum: Vector3<f64>,
    square: f64,
    count: u32,
    gaps: u32,
}

impl<'a> RunningSums<'a> {
    fn new(series: Series<'a>, longest_gap: f64) -> Self {
        let first_usable = series.values.iter().zip(series.usable).find(|(_, usable)| **usable);
        let origin = first_usable.map(|(value, _)| *value).unwrap_or_default();
        let sum = Vector3::zeros();
        Self { series, origin, longest_gap, row: 0, sum, square: 0.0, count: 0, gaps: 0 }
    }

    /// Takes the rows up to `row`, which it does not hold itself.
    fn advance(&mut self, row: usize) {
        let Series { time, values, usable, .. } = self.series;
        for k in self.row..row {
            if k > 0 && time[k] - time[k - 1] > self.longest_gap {
                self.gaps += 1;
            }
            if usable[k] {
                let x = values[k] - self.origin;
                self.sum += x;
                self.square += x.norm_squared();
                self.count += 1;
            }
        }
        self.row = row;
    }
}

/// Something of the window of so many rows, `interval` s apart, to each side of each row; more of `GAP` intervals are a jump.
pub(super) fn windows<T>(series: Series<'_>, half: usize, interval: f64, of: impl Fn(Window) -> T) -> Vec<T> {
    let rows = series.values.len();
    let mut from = RunningSums::new(series, GAP * interval);
    let least = USABLE_SHARE * density(series, interval);
    let mut to = from;
    (0..rows)
        .map(|k| {
            let held = window(k, half, rows);
            from.advance(held.start);
            to.advance(held.end);
            let n = f64::from(to.count - from.count);
            if n == 0.0 {
                return of(Window { mean: Vector3::zeros(), variance: f64::INFINITY });
            }
            let mean = (to.sum - from.sum) / n;
            let broken = to.gaps > from.gaps || n < least * held.len() as f64;
            let variance = ((to.square - from.square) / n - mean.norm_squared()).max(0.0);
            of(Window { mean: mean + to.origin, variance: if broken { f64::INFINITY } else { variance } })
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
        let series = Series { time: &time, values: &values, usable: &usable, interval: 0.1 };
        let (half, rows) = (5, values.len());
        let found = windows(series, half, 0.2, |window| window);
        let mut infinite = 0;
        for (k, found) in found.iter().enumerate() {
            let w = window(k, half, rows);
            let held: Vec<&Vector3<f64>> = w.clone().filter(|k| usable[*k]).map(|k| &values[k]).collect();
            let count = held.len() as f64;
            let centre = held.iter().copied().sum::<Vector3<f64>>() / count;
            assert!((found.mean - centre).norm() < 1e-12, "{k}");
            // A gap counts at the row behind it.
            if w.contains(&40) || count < USABLE_SHARE * w.len() as f64 {
                infinite += 1;
                assert_eq!(found.variance, f64::INFINITY, "{k}");
            } else {
                let squares: f64 = held.iter().map(|value| (*value - centre).norm_squared()).sum();
                assert!((found.variance - squares / count).abs() < 1e-12, "{k}");
            }
        }
        assert!(infinite > 10 && infinite < rows, "{infinite}");
    }

    #[test]
    fn samples_between_those_of_another_sensor_fill_a_window() {
        let time: Vec<f64> = (0..40).map(|k| 0.1 * f64::from(k)).collect();
        let values = vec![Vector3::z(); 40];
        let usable: Vec<bool> = (0..40).map(|k| k % 2 == 0).collect();
        let of = |interval| {
            let series = Series { time: &time, values: &values, usable: &usable, interval };
            windows(series, 5, 0.1, |window| window.variance)
        };
        assert!(of(0.1)[20].is_infinite());
        assert_eq!(of(0.2)[20], 0.0);
    }
}

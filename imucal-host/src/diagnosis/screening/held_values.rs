//! Rows that repeat the one before until a new value comes, as a table at a higher rate than its source does.

use crate::recording::median;

/// Values are held where half of them stand in so many rows or more.
const HELD: f64 = 2.0;
/// Values that stand in more than so many times the median of rows are a rest.
const REST: f64 = 1.5;
/// Distances of new values are even where they spread by less than this share of their mean.
const EVEN: f64 = 0.25;
/// Fewer changes than this are a machine at rest.
const FEWEST: usize = 50;

/// Values that are held.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldValues {
    /// Rows that repeat an older one. At rest a value that stands for longer comes again at the usual distance.
    pub repeated: Vec<usize>,
    /// How many rows hold the same value, in the median.
    pub rows: f64,
    /// New values come at even distances, but for rests.
    pub is_even: bool,
}

/// Looks at so many rows; `same` says whether a row, other than the first, is the same as the one before. `None` where most
/// are new.
pub fn held(rows: usize, same: &dyn Fn(usize) -> bool) -> Option<HeldValues> {
    let starts: Vec<usize> = (0..rows).filter(|row| *row == 0 || !same(*row)).collect();
    let held = median(starts.windows(2).map(|pair| (pair[1] - pair[0]) as f64).collect())?;
    if held < HELD || starts.len() < FEWEST {
        return None;
    }
    let (mean, spread) = usual(starts.windows(2).map(|pair| (pair[1] - pair[0]) as f64), held);
    let ends = starts.iter().skip(1).copied().chain([rows]);
    let old = |(start, end): (&usize, usize)| {
        let (start, length) = (*start, (end - *start) as f64);
        let values = ((length / mean).round() as usize).max(1);
        let mut fresh =
            (0..values).map(move |value| start + (value as f64 * mean).round() as usize).peekable();
        (start..end).filter(move |row| fresh.next_if_eq(row).is_none())
    };
    let repeated = starts.iter().zip(ends).flat_map(old).collect();
    Some(HeldValues { repeated, rows: held, is_even: spread < EVEN * mean })
}

/// Mean and standard deviation of how many rows hold a value, without rests.
fn usual(lengths: impl Iterator<Item = f64>, median: f64) -> (f64, f64) {
    let usual: Vec<f64> = lengths.filter(|length| *length <= REST * median).collect();
    let n = usual.len() as f64;
    let mean = usual.iter().sum::<f64>() / n;
    let variance = usual.iter().map(|length| (length - mean).powi(2)).sum::<f64>() / n;
    (mean, variance.sqrt())
}

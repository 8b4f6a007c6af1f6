//! Rows that repeat the one before until a new value comes, as a table at a higher rate than its source does.

use crate::recording::median;

/// Values are held where half of them stand in so many rows or more.
const HELD: f64 = 2.0;
/// Fewer changes than this are a machine at rest.
const FEWEST: usize = 50;

/// Values that are held.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldValues {
    /// Rows that repeat an older one.
    pub repeated: Vec<usize>,
    /// How many rows hold the same value, in the median.
    pub rows: f64,
}

/// Looks at so many rows; `same` says whether a row, other than the first, is the same as the one before. `None` where most
/// are new. At rest a value that comes again after as many rows is as fresh as before.
pub fn held(rows: usize, same: &dyn Fn(usize) -> bool) -> Option<HeldValues> {
    let starts: Vec<usize> = (0..rows).filter(|row| *row == 0 || !same(*row)).collect();
    let held = median(starts.windows(2).map(|pair| (pair[1] - pair[0]) as f64).collect())?;
    if held < HELD || starts.len() < FEWEST {
        return None;
    }
    let ends = starts.iter().skip(1).copied().chain([rows]);
    let old = |(start, end): (&usize, usize)| {
        let start = *start;
        (start..end).filter(move |row| !(row - start).is_multiple_of(held as usize))
    };
    Some(HeldValues { repeated: starts.iter().zip(ends).flat_map(old).collect(), rows: held })
}

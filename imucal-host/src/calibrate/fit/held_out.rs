//! Residuals of observations that the fit has not seen.
//!
//! | way | each time | for |
//! | --- | --- | --- |
//! | [`by_steps`] | one Gauss–Newton step from the optimum of all | observations left out one by one |
//! | [`by_folds`] | a fit to the others | contiguous parts, where neighbours are alike |

use std::ops::Range;

use nalgebra::SVector;
use rayon::prelude::*;

use super::{leverage::Leverage, rows::Rows};

/// Sum of squared errors of `count` observations of `each` rows, left out in turn; `squared` gives that of one at the
/// parameters of the others. `None` where these do not determine the parameters.
pub fn by_steps<const P: usize>(
    rows: &Rows<P>,
    theta: &SVector<f64, P>,
    (count, each): (usize, usize),
    squared: impl Fn(usize, &SVector<f64, P>) -> f64,
) -> Option<f64> {
    let leverage = Leverage::of(rows)?;
    let mut sum = 0.0;
    for k in 0..count {
        let without = theta + leverage.step_without(each * k..each * (k + 1))?;
        sum += squared(k, &without);
    }
    Some(sum)
}

/// Sum of squared errors of `count` observations, left out in contiguous parts in turn; `squared` gives that of a part
/// by a fit to the others, `None` where that does not converge.
pub fn by_folds(
    count: usize,
    folds: usize,
    squared: impl Fn(Range<usize>) -> Option<f64> + Sync,
) -> Option<f64> {
    let folds = folds.min(count);
    let sums: Option<Vec<f64>> = (0..folds)
        .into_par_iter()
        .map(|fold| squared(fold * count / folds..(fold + 1) * count / folds))
        .collect();
    Some(sums?.iter().sum())
}

/// Root of the mean of squares.
pub fn root_mean(squared_sum: f64, count: usize) -> f64 {
    (squared_sum / count as f64).sqrt()
}

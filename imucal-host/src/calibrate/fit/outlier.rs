//! Gross outliers: left out by name, never down-weighted.
//!
//! The rule is the core's ([`imucal_core::accept::outlier`]), here for many observations and in rounds.

pub use imucal_core::accept::outlier::{GROSS, LEAST, MOST};

use crate::recording::order_statistics::std_of_median;

/// A fit without its outliers.
#[derive(Clone, Debug)]
pub struct Kept<F> {
    /// The fit.
    pub fit: F,
    /// Observations used, in order.
    pub used: Vec<usize>,
    /// Those left out, in the order in which they were, with their size in robust standard deviations.
    pub left_out: Vec<(usize, f64)>,
}

impl<F> Kept<F> {
    /// With those left out in the observations' order.
    pub fn in_order(mut self) -> Self {
        self.left_out.sort_by_key(|(index, _)| *index);
        self
    }
}

/// Fits `count` observations, leaving out outliers in up to so many rounds. `fit` makes a fit to some observations
/// from the fit before, and gives a residual of each.
pub fn leaving_out<F>(
    count: usize,
    rounds: usize,
    fit: &mut impl FnMut(&[usize], Option<&F>) -> (F, Vec<f64>),
) -> Kept<F> {
    let mut used: Vec<usize> = (0..count).collect();
    let mut left_out = Vec::new();
    let (mut fitted, mut residuals) = fit(&used, None);
    for _ in 0..rounds {
        let found = outliers(&residuals);
        if found.is_empty() {
            break;
        }
        for (index, size) in found.into_iter().rev() {
            left_out.push((used.remove(index), size));
        }
        (fitted, residuals) = fit(&used, Some(&fitted));
    }
    Kept { fit: fitted, used, left_out }
}

/// As [`leaving_out`]; where all rounds together would leave out more than [`MOST`], none is.
pub fn leaving_out_few<F>(
    count: usize,
    rounds: usize,
    mut fit: impl FnMut(&[usize], Option<&F>) -> (F, Vec<f64>),
) -> Kept<F> {
    let kept = leaving_out(count, rounds, &mut fit);
    let too_many = kept.left_out.len() as f64 > MOST * count as f64;
    if too_many { leaving_out(count, 0, &mut fit) } else { kept.in_order() }
}

/// Robust standard deviation of residuals around zero.
fn robust_std(residuals: &[f64]) -> Option<f64> {
    std_of_median(residuals.iter().map(|r| r.abs()).collect())
}

/// Indices of the residuals to leave out, with their size in robust standard deviations.
pub fn outliers(residuals: &[f64]) -> Vec<(usize, f64)> {
    if residuals.len() < LEAST {
        return Vec::new();
    }
    let Some(std) = robust_std(residuals).filter(|s| *s > 0.0) else {
        return Vec::new();
    };
    let found: Vec<(usize, f64)> = residuals
        .iter()
        .enumerate()
        .map(|(k, r)| (k, r.abs() / std))
        .filter(|(_, size)| *size > GROSS || size.is_nan())
        .collect();
    if found.len() as f64 > MOST * residuals.len() as f64 { Vec::new() } else { found }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gross_error_is_found_and_noise_is_not() {
        let mut residuals: Vec<f64> = (0..40).map(|k| f64::from(k % 7) - 3.0).collect();
        assert!(outliers(&residuals).is_empty());
        residuals[11] = 60.0;
        assert_eq!(outliers(&residuals).iter().map(|o| o.0).collect::<Vec<_>>(), [11]);
    }

    #[test]
    fn where_a_third_would_go_none_goes() {
        let residuals: Vec<f64> = (0..60).map(|k| if k % 3 == 0 { 100.0 } else { 1.0 }).collect();
        assert!(outliers(&residuals).is_empty());
    }
}

//! Gross outliers: left out by name, never down-weighted.
//!
//! An observation is left out where its residual exceeds [`GROSS`] times the robust spread (1.4826 · median of the
//! absolute values). Ordinary noise does not reach that in a lifetime; a knock on the table or a magnet does. Where
//! more than [`MOST`] would go, none goes: then the model is wrong, not the data.

use crate::recording::median;

/// Robust standard deviations beyond which an observation is left out.
pub const GROSS: f64 = 7.0;
/// Largest share of observations left out.
pub const MOST: f64 = 0.1;
/// Fewer observations have no spread to speak of.
const LEAST: usize = 12;

/// Robust standard deviation of residuals around zero.
fn robust_std(residuals: &[f64]) -> Option<f64> {
    Some(1.4826 * median(residuals.iter().map(|r| r.abs()).collect())?)
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

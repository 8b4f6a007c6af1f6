//! Gross outliers: left out by name, never down-weighted.
//!
//! An observation is left out where its residual exceeds [`GROSS`] times the robust spread (median of the absolute values over
//! [`MEDIAN_SIZE`]). Ordinary noise does not reach that in a lifetime; a knock on the table or a magnet does. Where more than
//! [`MOST`] would go, none goes: then the model is wrong, not the data.

use crate::scalar::Scalar;

/// Robust standard deviations beyond which an observation is left out.
pub const GROSS: f64 = 7.0;
/// Largest share of observations left out.
pub const MOST: f64 = 0.1;
/// Fewer observations have no spread to speak of.
pub const LEAST: usize = 12;
/// Median of |x| of normal numbers, over σ: Φ⁻¹(3/4).
pub const MEDIAN_SIZE: f64 = 0.674_489_750_196_081_7;

/// Size beyond which a residual is gross; `None` where there are too few residuals, no spread, or more than [`MOST`] would be.
/// Residuals are not negative, up to a few dozen: the time is quadratic in their number.
pub fn gross<T: Scalar>(residuals: &[T]) -> Option<T> {
    if residuals.len() < LEAST {
        return None;
    }
    let limit = median(residuals)? * T::of(GROSS / MEDIAN_SIZE);
    let within = residuals.iter().filter(|size| **size <= limit).count();
    let beyond = residuals.len().saturating_sub(within);
    let few =
        T::whole(u32::try_from(beyond).ok()?) <= T::of(MOST) * T::whole(u32::try_from(residuals.len()).ok()?);
    (limit > T::zero() && few).then_some(limit)
}

/// The upper median, by counting: nothing is sorted, and nothing moves.
fn median<T: Scalar>(values: &[T]) -> Option<T> {
    let middle = values.len() / 2;
    let is_middle = |value: &&T| {
        let below = values.iter().filter(|other| *other < *value).count();
        let upto = values.iter().filter(|other| *other <= *value).count();
        below <= middle && middle < upto
    };
    values.iter().find(is_middle).copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn a_gross_error_is_found_and_noise_is_not() {
        let mut residuals: Vec<f32> = (0..40u8).map(|k| (f32::from(k % 7) - 3.0).abs()).collect();
        let limit = gross(&residuals).expect("a spread");
        assert!(residuals.iter().all(|size| *size <= limit));
        residuals[11] = 60.0;
        assert!(gross(&residuals).expect("a spread") < 60.0);
    }

    #[test]
    fn where_a_third_would_go_none_goes() {
        let residuals: Vec<f64> = (0..60).map(|k| if k % 3 == 0 { 100.0 } else { 1.0 }).collect();
        assert_eq!(gross(&residuals), None);
    }

    #[test]
    fn a_median_is_the_middle_of_the_sorted_values() {
        assert_eq!(median(&[5.0, 1.0, 4.0, 2.0, 3.0]), Some(3.0));
        assert_eq!(median(&[2.0, 2.0, 2.0, 1.0]), Some(2.0));
        assert_eq!(median::<f32>(&[]), None);
        assert_eq!(median(&[f32::NAN, f32::NAN]), None);
    }
}

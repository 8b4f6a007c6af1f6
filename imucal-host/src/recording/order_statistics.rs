//! Medians and means without the largest, which a few jolts or steps do not move, and what they are of normal numbers.

pub use imucal_core::accept::outlier::MEDIAN_SIZE;

/// Median of x², over σ².
pub const MEDIAN_SQUARE: f64 = MEDIAN_SIZE * MEDIAN_SIZE;
/// Mean of those x² that lie below their ninth decile, over σ².
const MEAN_SQUARE_BELOW_NINTH_DECILE: f64 = 0.623;

/// The middle value (the upper one of an even number); `None` of nothing. NaN sorts beyond every
/// number, so take it out before.
#[must_use]
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Standard deviation of normal numbers from their sizes |x|; `None` of nothing.
pub fn std_of_median(sizes: Vec<f64>) -> Option<f64> {
    Some(median(sizes)? / MEDIAN_SIZE)
}

/// Variance of normal numbers from their squares, without the largest tenth.
pub fn variance_without_largest_tenth(squares: Vec<f64>) -> f64 {
    mean_without_largest(squares, 10) / MEAN_SQUARE_BELOW_NINTH_DECILE
}

/// Mean without the largest one in so many.
pub fn mean_without_largest(mut values: Vec<f64>, one_in: usize) -> f64 {
    let kept = values.len() - values.len() / one_in;
    if kept < values.len() {
        values.select_nth_unstable_by(kept, f64::total_cmp);
    }
    values[..kept].iter().sum::<f64>() / kept.max(1) as f64
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    #[test]
    fn each_constant_is_that_of_normal_numbers() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let values: Vec<f64> = (0..400_000).map(|_| 3.0 * normal()).collect();
        let size = std_of_median(values.iter().map(|x| x.abs()).collect()).unwrap();
        let squares: Vec<f64> = values.iter().map(|x| x * x).collect();
        let square = median(squares.clone()).unwrap() / MEDIAN_SQUARE;
        let trimmed = variance_without_largest_tenth(squares);
        assert!((size / 3.0 - 1.0).abs() < 0.006, "{size}");
        assert!(
            (square / 9.0 - 1.0).abs() < 0.012 && (trimmed / 9.0 - 1.0).abs() < 0.012,
            "{square} {trimmed}"
        );
    }
}

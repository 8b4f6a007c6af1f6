//! Whether temperatures can be distinguished from time, and are far enough apart.
//!
//! ```text
//! apart = min over monotone m of  Σ (θ_k − m(t_k))² / Σ (θ_k − θ̄)²
//! ```
//!
//! What drifts with time, an ageing bias or one that settles, is most often a monotone function of it. Temperatures that
//! are one as well cannot be distinguished from it, whatever their span; those that come back can. The share that no rising and no
//! falling function of time explains is 0 for a ramp and for two plateaus, 0.69 for a ramp up and down, and near 1 for
//! temperatures in any order. Source: isotonic regression by pooling neighbours (Ayer et al. 1955). Not modelled: a drift
//! that turns back when the temperature does.

use crate::scalar::Scalar;

/// Least span of the temperatures, K.
pub const LEAST_SPAN: f64 = 10.0;
/// Least share of the temperature's variance that no monotone function of time has.
pub const LEAST_APART: f64 = 0.1;

/// Neighbours that are pooled: their sum and their number.
pub type Pool<T> = (T, T);

/// Lowest and highest temperature, °C.
pub fn span<T: Scalar>(temperatures: &[T]) -> (T, T) {
    let none = (T::of(f64::INFINITY), T::of(f64::NEG_INFINITY));
    temperatures.iter().fold(none, |(least, most), value| {
        (if *value < least { *value } else { least }, if *value > most { *value } else { most })
    })
}

/// Share of the variance that no monotone function of the order has, of temperatures in the order of time. `pools` is room for as
/// many as there are temperatures; with less room the share is too large.
pub fn apart<T: Scalar>(temperatures: &[T], pools: &mut [Pool<T>]) -> T {
    let count = T::whole(u32::try_from(temperatures.len()).unwrap_or(u32::MAX));
    let mut mean = T::zero();
    temperatures.iter().for_each(|value| mean += *value);
    mean /= count;
    let off = |value: &T| *value - mean;
    let mut all = T::zero();
    temperatures.iter().map(off).for_each(|value| all += value * value);
    let rising = explained(temperatures.iter().map(off), pools);
    let falling = explained(temperatures.iter().map(|value| -off(value)), pools);
    (all - if rising > falling { rising } else { falling }) / all
}

/// Sum of squares of the best function that never falls, of values about their mean.
fn explained<T: Scalar>(values: impl Iterator<Item = T>, pools: &mut [Pool<T>]) -> T {
    let mut used = 0usize;
    for value in values {
        let mut pool = (value, T::one());
        while let Some(last) = used.checked_sub(1).and_then(|last| pools.get(last))
            && last.0 * pool.1 >= pool.0 * last.1
        {
            pool = (last.0 + pool.0, last.1 + pool.1);
            used = used.saturating_sub(1);
        }
        if let Some(slot) = pools.get_mut(used) {
            *slot = pool;
            used = used.saturating_add(1);
        }
    }
    let mut sum = T::zero();
    pools.iter().take(used).for_each(|(total, count)| sum += *total * *total / *count);
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn apart_of(of: impl Fn(f64) -> f64) -> f64 {
        let ramp: Vec<f64> = (0..200).map(|k| of(f64::from(k) / 199.0)).collect();
        apart(&ramp, &mut [(0.0, 0.0); 200])
    }

    #[test]
    fn a_ramp_is_alone_with_time_and_one_that_comes_back_is_not() {
        assert!(apart_of(|t| 20.0 + 30.0 * t).abs() < 1e-9);
        assert!(apart_of(|t| 50.0 - 30.0 * t.sqrt()).abs() < 1e-9);
        assert!(apart_of(|t| if t < 0.4 { 20.0 } else { 45.0 }).abs() < 1e-9, "two plateaus");
        let back = apart_of(|t| 20.0 + 60.0 * (0.5 - (t - 0.5).abs()));
        assert!((back - 0.686).abs() < 0.01, "{back}");
    }

    #[test]
    fn single_precision_gives_the_same_share() {
        let warm = |k: u16| 20.0 + 15.0 * libm::sinf(0.3 * f32::from(k)) + 0.1 * f32::from(k % 7);
        let single: Vec<f32> = (0..38).map(warm).collect();
        let double: Vec<f64> = single.iter().copied().map(f64::from).collect();
        let (a, b) = (apart(&single, &mut [(0.0, 0.0); 38]), apart(&double, &mut [(0.0, 0.0); 38]));
        assert!((f64::from(a) - b).abs() < 1e-5, "{a} {b}");
        assert_eq!(span(&single).0, single.iter().copied().fold(f32::INFINITY, f32::min));
    }
}

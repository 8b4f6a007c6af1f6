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

use super::refusal::TemperatureRefusal;

/// Least span of the temperatures, K.
pub const LEAST_SPAN: f64 = 10.0;
/// Least share of the temperature's variance that no monotone function of time has.
pub const LEAST_APART: f64 = 0.1;

/// Checks temperatures, °C, of observations in the order of time.
///
/// # Errors
/// not-measured, narrow-span or alone-with-time.
pub fn check(temperatures: &[f64]) -> Result<(), TemperatureRefusal> {
    let have = temperatures.iter().filter(|value| value.is_finite()).count();
    if have < temperatures.len() || have == 0 {
        return Err(TemperatureRefusal::NotMeasured { have, of: temperatures.len() });
    }
    let span = span(temperatures);
    if span.1 - span.0 < LEAST_SPAN {
        return Err(TemperatureRefusal::Narrow { span: span.1 - span.0, need: LEAST_SPAN });
    }
    let apart = apart(temperatures);
    if apart < LEAST_APART {
        return Err(TemperatureRefusal::AloneWithTime { apart, need: LEAST_APART });
    }
    Ok(())
}

/// Lowest and highest temperature, °C.
pub fn span(temperatures: &[f64]) -> (f64, f64) {
    let least = temperatures.iter().copied().fold(f64::INFINITY, f64::min);
    (least, temperatures.iter().copied().fold(f64::NEG_INFINITY, f64::max))
}

/// Share of the variance that no monotone function of the order has.
pub fn apart(temperatures: &[f64]) -> f64 {
    let mean = temperatures.iter().sum::<f64>() / temperatures.len() as f64;
    let all: f64 = temperatures.iter().map(|value| (value - mean).powi(2)).sum();
    let falling: Vec<f64> = temperatures.iter().map(|value| -value).collect();
    f64::min(left_by_rising(temperatures), left_by_rising(&falling)) / all
}

/// Sum of squares about the best function that never falls.
fn left_by_rising(values: &[f64]) -> f64 {
    // Pools of neighbours: sum and count.
    let mut pools: Vec<(f64, f64)> = Vec::new();
    for value in values {
        let mut pool = (*value, 1.0);
        while let Some(last) = pools.last().copied()
            && last.0 / last.1 >= pool.0 / pool.1
        {
            pools.pop();
            pool = (last.0 + pool.0, last.1 + pool.1);
        }
        pools.push(pool);
    }
    let squares: f64 = values.iter().map(|value| value * value).sum();
    squares - pools.iter().map(|(sum, count)| sum * sum / count).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(of: impl Fn(f64) -> f64) -> Vec<f64> {
        (0..200).map(|k| of(f64::from(k) / 199.0)).collect()
    }

    #[test]
    fn a_ramp_is_alone_with_time_and_one_that_comes_back_is_not() {
        let refused = |t: Vec<f64>| matches!(check(&t), Err(TemperatureRefusal::AloneWithTime { .. }));
        assert!(refused(ramp(|t| 20.0 + 30.0 * t)) && refused(ramp(|t| 50.0 - 30.0 * t.sqrt())));
        assert!(refused(ramp(|t| if t < 0.4 { 20.0 } else { 45.0 })), "two plateaus");
        let up_and_down = ramp(|t| 20.0 + 60.0 * (0.5 - (t - 0.5).abs()));
        assert_eq!(check(&up_and_down), Ok(()));
        assert!((apart(&up_and_down) - 0.686).abs() < 0.01, "{}", apart(&up_and_down));
    }

    #[test]
    fn ten_kelvin_are_asked_for() {
        let of = |span: f64| check(&ramp(|t| 25.0 + span * (0.5 - (t - 0.5).abs()) * 2.0));
        assert!(matches!(of(9.0), Err(TemperatureRefusal::Narrow { .. })));
        assert_eq!(of(12.0), Ok(()));
        assert!(matches!(check(&[20.0, f64::NAN]), Err(TemperatureRefusal::NotMeasured { have: 1, of: 2 })));
    }
}

//! Whether temperatures can be distinguished from time, and are far enough apart: the core's figures, and what is refused by them.

use imucal_core::temperature::course::{self, LEAST_APART, LEAST_SPAN};

use super::refusal::TemperatureRefusal;

/// Checks temperatures, °C, of observations in the order of time.
///
/// # Errors
/// not-measured, narrow-span or alone-with-time.
pub fn check(temperatures: &[f64]) -> Result<(), TemperatureRefusal> {
    let have = temperatures.iter().filter(|value| value.is_finite()).count();
    if have < temperatures.len() || have == 0 {
        return Err(TemperatureRefusal::NotMeasured { have, of: temperatures.len() });
    }
    let (least, most) = course::span(temperatures);
    if most - least < LEAST_SPAN {
        return Err(TemperatureRefusal::Narrow { span: most - least, need: LEAST_SPAN });
    }
    let apart = course::apart(temperatures, &mut vec![(0.0, 0.0); temperatures.len()]);
    if apart < LEAST_APART {
        return Err(TemperatureRefusal::AloneWithTime { apart, need: LEAST_APART });
    }
    Ok(())
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
    }

    #[test]
    fn ten_kelvin_are_asked_for() {
        let of = |span: f64| check(&ramp(|t| 25.0 + span * (0.5 - (t - 0.5).abs()) * 2.0));
        assert!(matches!(of(9.0), Err(TemperatureRefusal::Narrow { .. })));
        assert_eq!(of(12.0), Ok(()));
        assert!(matches!(check(&[20.0, f64::NAN]), Err(TemperatureRefusal::NotMeasured { have: 1, of: 2 })));
    }
}

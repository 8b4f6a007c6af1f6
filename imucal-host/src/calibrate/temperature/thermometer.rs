//! Whether a thermometer's readings are those of a sensor that warms and cools: the core's criteria, over a recording.

use imucal_core::observer::thermometer::{ThermometerFault, ThermometerObserver};

use super::refusal::TemperatureRefusal;

/// Judges the readings, °C, of these times, s; those that are not finite are passed over.
///
/// # Errors
/// stuck or jump, with when and by how much.
pub fn check(time: &[f64], readings: &[f64]) -> Result<(), TemperatureRefusal> {
    let begin = time.first().copied().unwrap_or(0.0);
    let mut observer = ThermometerObserver::default();
    for (at, reading) in time.iter().zip(readings).filter(|(_, reading)| reading.is_finite()) {
        observer.push(((at - begin) * 1e6).round() as u64, *reading);
    }
    let seconds = |time: u64| time as f64 / 1e6;
    match observer.fault() {
        None => Ok(()),
        Some(ThermometerFault::Jump { at, by }) => {
            Err(TemperatureRefusal::Jump { at: begin + seconds(at), by })
        }
        Some(ThermometerFault::Stuck { from, duration, usual }) => Err(TemperatureRefusal::Stuck {
            from: begin + seconds(from),
            duration: seconds(duration),
            usual: seconds(usual),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An hour at 1 Hz: up by 30 K and down again, in steps of 0.05 K that flicker.
    fn ramp() -> (Vec<f64>, Vec<f64>) {
        let time: Vec<f64> = (0..3600).map(f64::from).collect();
        let warm = |t: &f64| {
            let truth = 20.0 + 30.0 * (1.0 - (t / 1800.0 - 1.0).abs()) + 0.04 * (7.1 * t).sin();
            (truth / 0.05).round() * 0.05
        };
        let readings = time.iter().map(warm).collect();
        (time, readings)
    }

    #[test]
    fn a_ramp_up_and_down_is_a_thermometer_s() {
        let (time, readings) = ramp();
        assert_eq!(check(&time, &readings), Ok(()));
    }

    #[test]
    fn a_reading_that_stays_while_the_ramp_goes_on_is_stuck() {
        let (time, mut readings) = ramp();
        let at = readings[600];
        readings[600..1500].fill(at);
        let refused = check(&time, &readings);
        assert!(matches!(refused, Err(TemperatureRefusal::Jump { .. } | TemperatureRefusal::Stuck { .. })));
        // Without the leap at its end: to the recording's end.
        let (_, mut readings) = ramp();
        readings[2400..].fill(at);
        let joined: Vec<f64> = readings[..2400].iter().copied().chain(vec![readings[2399]; 1200]).collect();
        assert!(
            matches!(check(&time, &joined), Err(TemperatureRefusal::Stuck { .. })),
            "{:?}",
            check(&time, &joined)
        );
    }

    #[test]
    fn one_wild_reading_is_a_jump() {
        let (time, mut readings) = ramp();
        readings[1000] = -45.0;
        let refused = check(&time, &readings);
        assert!(matches!(refused, Err(TemperatureRefusal::Jump { at, .. }) if at == 1000.0), "{refused:?}");
    }

    #[test]
    fn a_soak_that_a_coarse_thermometer_leaves_by_single_steps_is_not_stuck() {
        let (time, mut readings) = ramp();
        let peak = 40.0;
        readings.iter_mut().for_each(|value| *value = (f64::min(*value, peak) / 0.5).round() * 0.5);
        assert_eq!(check(&time, &readings), Ok(()));
    }
}

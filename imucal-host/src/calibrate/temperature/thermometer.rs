//! Whether a thermometer's readings are those of a sensor that warms and cools.
//!
//! | fault | criterion |
//! | --- | --- |
//! | it jumps | one reading differs from the one before by more than `LEAP` and `FASTEST` times the time between them |
//! | it is stuck | one reading is repeated for longer than `LONG` and `LONGER` times as long as any other, and it is left by a leap of `STEPS` of its steps, or not at all |
//!
//! A sensor has a thermal mass: a package of a few grams warms by some tenths of a kelvin a second. A soak at a constant
//! temperature is not stuck where the thermometer's last digit moves, or where it goes on by single steps. Source: ours.
//! Not seen: a thermometer that is stuck from beginning to end, which is a constant temperature; a coarse one that
//! rests on one digit until the recording ends counts as stuck.

use super::refusal::TemperatureRefusal;

/// The least jump, K.
const LEAP: f64 = 3.0;
/// How fast a sensor warms at most, K/s.
const FASTEST: f64 = 1.0;
/// The shortest repetition that is looked at, s.
const LONG: f64 = 30.0;
/// See the table.
const LONGER: f64 = 10.0;
/// See the table.
const STEPS: f64 = 4.0;
/// A leap of less is a step like others, K.
const LEAST_LEAP: f64 = 0.5;

/// A repetition of one reading.
#[derive(Clone, Copy, Debug)]
struct Run {
    from: f64,
    until: f64,
    value: f64,
    next: Option<f64>,
}

impl Run {
    fn duration(&self) -> f64 {
        self.until - self.from
    }
}

/// Judges the readings, °C, of these times, s; those that are not finite are passed over.
///
/// # Errors
/// stuck or jump, with when and by how much.
pub fn check(time: &[f64], readings: &[f64]) -> Result<(), TemperatureRefusal> {
    let measured = || time.iter().zip(readings).filter(|(_, value)| value.is_finite());
    let pairs = measured().zip(measured().skip(1));
    for ((before, from), (at, to)) in pairs {
        if (to - from).abs() > LEAP + FASTEST * (at - before) {
            return Err(TemperatureRefusal::Jump { at: *at, by: to - from });
        }
    }
    let runs = runs(measured());
    let Some(longest) = runs.iter().max_by(|a, b| a.duration().total_cmp(&b.duration())) else {
        return Ok(());
    };
    let others = runs.iter().filter(|run| run.from != longest.from).map(Run::duration);
    let usual = others.fold(0.0, f64::max);
    let step =
        runs.windows(2).map(|pair| (pair[1].value - pair[0].value).abs()).fold(f64::INFINITY, f64::min);
    let leaps =
        longest.next.is_none_or(|next| (next - longest.value).abs() > f64::max(STEPS * step, LEAST_LEAP));
    let stuck = runs.len() > 2 && longest.duration() > f64::max(LONG, LONGER * usual) && leaps;
    if stuck {
        let (from, duration) = (longest.from, longest.duration());
        return Err(TemperatureRefusal::Stuck { from, duration, usual });
    }
    Ok(())
}

fn runs<'a>(measured: impl Iterator<Item = (&'a f64, &'a f64)>) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (at, value) in measured {
        match runs.last_mut() {
            Some(run) if run.value == *value => run.until = *at,
            last => {
                if let Some(run) = last {
                    run.next = Some(*value);
                }
                runs.push(Run { from: *at, until: *at, value: *value, next: None });
            }
        }
    }
    runs
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

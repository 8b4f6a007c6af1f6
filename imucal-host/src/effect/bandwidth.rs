//! The sensor's low-pass: `P.bandwidth`.
//!
//! ```text
//! (τ + h) ẏ = x + h ẋ − y      exact for an input that is straight between rows
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | τ | lag of a slow input, s |
//! | h | half the interval at which the filter is computed, s: to second order of it, y_k = y_{k−1} + (x_k − y_{k−1}) · 2 h / (τ + 2 h) |
//!
//! Not modelled: filters of a higher order.

use super::{Act, Effect, Needs, Parameter, SensorKind, SensorRun, Words, of};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "The sensor or its firmware filters its output: a delay, and less amplitude when brisk.",
        remedy: "Put the filter into the simulator, or widen it in the unit's settings.",
        needs: "Sinusoids at three or more frequencies, or brisk slews.",
    };
    let tau = Parameter::magnitude("tau", "s", of(kind, 5e-3, 4e-3, 0.016), 0.2);
    let interval = Parameter::detail("interval", "s", 5e-3);
    let effect = Effect::member(kind, "bandwidth", Act::Memory(kind, alter), vec![tau, interval], words)
        .needing(Needs::EXACT_ATTITUDE)
        .like("clk.time_offset", "the other triads: one clock makes all of them late alike");
    match kind {
        SensorKind::Acc => effect.like("acc.lever_arm", "sinusoids at several frequencies"),
        SensorKind::Gyr => {
            effect.like("gyr.angular_acceleration", "none at low frequency: the two are the same")
        }
        SensorKind::Mag => effect.like("mag.eddy_current", "a coil step at rest"),
    }
}

fn alter(values: &[f64], run: &mut SensorRun<'_>) {
    let value = |at: usize| values.get(at).copied().unwrap_or(0.0);
    let (lag, half) = (value(0), 0.5 * value(1));
    let (Some(first), true) = (run.output.first().copied(), lag > 0.0) else { return };
    let tau = lag + half;
    let (mut state, mut before) = (first, first);
    for row in 1..run.output.len() {
        let ratio = run.since_before(row) / tau;
        if ratio > 0.0 {
            let kept = libm::exp(-ratio);
            let lag = (1.0 - kept) / ratio;
            state = state * kept + before * (lag - kept) + run.output[row] * (1.0 - lag);
        }
        before = run.output[row];
        run.output[row] = state + (before - state) * (half / tau);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::effect::Input;

    #[test]
    fn a_ramp_comes_out_late_by_the_time_constant() {
        let input = Input::empty(400);
        let mut output: Vec<Vector3<f64>> = input.iter().map(|row| Vector3::repeat(row.time)).collect();
        alter(&[0.037], &mut SensorRun { input: &input, sensed: &[], output: &mut output });
        assert!((output[399].x - (3.99 - 0.037)).abs() < 1e-9, "{}", output[399].x);
    }

    #[test]
    fn a_filter_that_is_computed_row_by_row_is_one_of_that_interval() {
        let input = Input::empty(4000);
        let signal = |row: &Input| Vector3::repeat((4.0 * row.time).sin() + 0.5 * (9.0 * row.time).cos());
        let given: Vec<Vector3<f64>> = input.iter().map(signal).collect();
        let share = 0.25;
        let mut computed = given.clone();
        for row in 1..given.len() {
            computed[row] = computed[row - 1] + (given[row] - computed[row - 1]) * share;
        }
        // share = 0.01 / (lag + 0.01)
        let off = |values: &[f64]| {
            let mut output = given.clone();
            alter(values, &mut SensorRun { input: &input, sensed: &[], output: &mut output });
            let differences =
                output.iter().zip(&computed).skip(1000).map(|(one, other)| (one - other).amax());
            differences.fold(0.0, f64::max)
        };
        assert!(
            10.0 * off(&[0.03, 0.01]) < off(&[0.03, 0.0]),
            "{} {}",
            off(&[0.03, 0.01]),
            off(&[0.03, 0.0])
        );
    }

    #[test]
    fn rows_that_are_not_evenly_apart_come_out_late_by_as_much() {
        let mut input = Input::empty(400);
        let mut time = 0.0;
        for (row, input) in input.iter_mut().enumerate() {
            time += if row % 40 < 4 { 0.25 } else { 0.045 };
            input.time = time;
        }
        let mut output: Vec<Vector3<f64>> = input.iter().map(|row| Vector3::repeat(row.time)).collect();
        alter(&[0.0006], &mut SensorRun { input: &input, sensed: &[], output: &mut output });
        for (output, input) in output.iter().zip(&input).skip(1) {
            assert!((output.x - (input.time - 0.0006)).abs() < 1e-9, "{}", output.x);
        }
    }
}

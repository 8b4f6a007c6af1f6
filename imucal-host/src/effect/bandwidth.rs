//! The sensor's low-pass: `P.bandwidth`.
//!
//! ```text
//! τ ẏ = x − y      exact for an input that is straight between rows
//! ```

use super::{Act, Effect, Needs, Parameter, SensorKind, SensorRun, Words, of};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "The sensor or its firmware filters its output: a delay, and less amplitude when brisk.",
        remedy: "Put the filter into the simulator, or widen it in the unit's settings.",
        needs: "Sinusoids at three or more frequencies, or brisk slews.",
    };
    let tau = Parameter::magnitude("tau", "s", of(kind, 5e-3, 4e-3, 0.016), 0.2);
    let effect = Effect::member(kind, "bandwidth", Act::Sensor(kind, alter), vec![tau], words)
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
    let tau = values.first().copied().unwrap_or(0.0);
    let (Some(first), true) = (run.output.first().copied(), tau > 0.0) else { return };
    let (mut state, mut before) = (first, first);
    for row in 1..run.output.len() {
        let ratio = run.since_before(row) / tau;
        if ratio > 0.0 {
            let kept = libm::exp(-ratio);
            let lag = (1.0 - kept) / ratio;
            state = state * kept + before * (lag - kept) + run.output[row] * (1.0 - lag);
        }
        before = run.output[row];
        run.output[row] = state;
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

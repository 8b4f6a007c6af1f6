//! A triad that is read later than the others: `P.lag`, a term of recordings whose movement no rig's clock gives.
//!
//! ```text
//! y(t) → y(t − lag)      straight between rows, held before the first and behind the last
//! ```

use super::{Act, Effect, Free, Parameter, Part, SensorKind, SensorRun, Words, member_id};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "The triad is a chip of its own, whose samples reach their row later than those of the others.",
        remedy: "Record the time at which each chip was read.",
        needs: "Brisk motion.",
    };
    let lag = Parameter::amplitude("lag", "s", 5e-3);
    // Without a position an accelerometer shows hardly more than gravity.
    let free = if kind == SensorKind::Mag { Free::ReadApart } else { Free::Placed };
    Effect::new(&member_id(kind, "lag"), Act::Memory(kind, alter), vec![lag], words)
        .part(Part::Nuisance(free))
}

fn alter(values: &[f64], run: &mut SensorRun<'_>) {
    let lag = values.first().copied().unwrap_or(0.0);
    let (Some(last), before) = (run.output.len().checked_sub(1), run.output.to_vec()) else { return };
    let mut next = 0;
    for (input, output) in run.input.iter().zip(run.output.iter_mut()) {
        let then = input.time - lag;
        while next < last && run.input[next].time <= then {
            next += 1;
        }
        let from = next.saturating_sub(1);
        let span = run.input[next].time - run.input[from].time;
        let share = if span > 0.0 { ((then - run.input[from].time) / span).clamp(0.0, 1.0) } else { 0.0 };
        *output = before[from] + (before[next] - before[from]) * share;
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::effect::Input;

    #[test]
    fn a_row_shows_what_was_there_a_lag_before() {
        let input = Input::empty(100);
        for lag in [0.023, -0.017] {
            let mut output: Vec<Vector3<f64>> = input.iter().map(|row| Vector3::repeat(row.time)).collect();
            alter(&[lag], &mut SensorRun { input: &input, sensed: &[], output: &mut output });
            assert!((output[50].x - (0.5 - lag)).abs() < 1e-12, "{}", output[50].x);
            let end = if lag > 0.0 { output[0].x } else { output[99].x };
            assert_eq!(end, if lag > 0.0 { 0.0 } else { 0.99 });
        }
    }
}

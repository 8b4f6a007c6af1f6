//! Output that remembers where the input came from: `acc.hysteresis`, `gyr.hysteresis`.
//!
//! ```text
//! z follows x only where it is more than d behind (play);      y += h (z − x) / d
//! ```

use super::{Act, Effect, Needs, Parameter, SensorKind, SensorRun, Words, XYZ, member_id, of, si, vector};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "Springs or glue that creep: after a change the output stays behind by up to h.",
        remedy: "Approach every attitude from the same side, or model the play.",
        needs: "The same attitude reached from both sides.",
    };
    let mut parameters = Parameter::amplitudes(&XYZ, &si(kind), of(kind, 5e-3, 1e-3, 0.1));
    parameters.push(Parameter::shape("play", &si(kind), of(kind, 0.5, 0.05, 2.0)));
    // The filter of a reference attitude lags behind a rate as play does.
    let needs = if kind == SensorKind::Gyr { Needs::EXACT_ATTITUDE } else { Needs::NOTHING };
    Effect::member(kind, "hysteresis", Act::Memory(kind, alter), parameters, words)
        .needing(needs)
        .like(&member_id(kind, "bias_drift"), "the same attitude from both sides, early and late")
        .like(&member_id(kind, "scale_asymmetry"), "the same attitude from both sides")
}

fn alter(values: &[f64], run: &mut SensorRun<'_>) {
    let ([_, _, _, play], Some(mut follower)) = (values, run.sensed.first().copied()) else { return };
    let height = vector(values, 0);
    for (output, sensed) in run.output.iter_mut().zip(run.sensed) {
        follower = follower.zip_map(sensed, |z, x| z.clamp(x - play, x + play));
        *output += height.component_mul(&(follower - sensed)) / *play;
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn what_is_left_at_rest_depends_on_the_side_it_came_from() {
        let path = [0.0, 1.0, 2.0, 1.0, -1.0, 1.0].map(Vector3::repeat);
        let mut output = [Vector3::zeros(); 6];
        alter(&[0.1, 0.0, 0.0, 0.5], &mut SensorRun { input: &[], sensed: &path, output: &mut output });
        // At 1 the follower was 0.5 behind on the way up, 0.5 ahead on the way down.
        assert_eq!([output[1].x, output[3].x, output[5].x], [-0.1, 0.1, -0.1]);
        assert_eq!(output[3].y, 0.0);
    }
}

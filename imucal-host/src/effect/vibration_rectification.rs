//! Vibration that shows as a bias: `acc.vibration_rectification`.
//!
//! The rig vibrates while it turns, with a power that follows the square of its rate within 0.2 s. The vibration itself
//! is not simulated.

use super::{Act, Effect, Parameter, SensorKind, SensorRun, Words, XYZ, vector};

/// Time in which the rig's vibration builds up and dies down, s.
const BUILD_UP: f64 = 0.2;

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "The proof mass rectifies vibration: a bias that follows the vibration's power.",
        remedy: "Damp the mount, or widen the range; do not calibrate while the rig shakes.",
        needs: "Different levels of vibration at the same attitude, such as drives on and off.",
    };
    let act = Act::Memory(SensorKind::Acc, alter);
    Effect::new(
        "acc.vibration_rectification",
        act,
        Parameter::amplitudes(&XYZ, "(m/s^2)/(rad/s)^2", 5e-3),
        words,
    )
    .like("acc.lever_arm", "drives on and off at rest")
    .like("acc.scale_quadratic", "drives on and off at rest")
}

fn alter(values: &[f64], run: &mut SensorRun<'_>) {
    let c = vector(values, 0);
    let power = run.squared_rate_within(BUILD_UP);
    run.output.iter_mut().zip(power).for_each(|(output, power)| *output += c * power);
}

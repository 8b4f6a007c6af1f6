//! The encoders' zeros are off: `rig.encoder_offset`.

use super::{Act, Effect, Machine, Needs, Parameter, Words};
use crate::recording::GIMBALS;

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "An encoder's zero is not where the gimbal's axes line up: true angle = encoder + offset.",
        remedy: "Set the zeros with a level and an autocollimator, or estimate the middle gimbal's offset.",
        needs: "Rests that turn each gimbal while the inner ones stand at several angles.",
    };
    Effect::new("rig.encoder_offset", Act::Rig(alter), Parameter::amplitudes(&GIMBALS, "rad", 1e-3), words)
        .needing(Needs::GIMBALS)
        .like("P.misalignment", "inner gimbal: none, remounting the unit changes both")
        .like("rig.heading", "outer gimbal: none while the outer axis is vertical")
        .like(
            "rig.axis_nonorthogonality",
            "full turns of the outer gimbal at middle angles of 0 and 90 degrees",
        )
        .like("rig.wobble", "full turns of the outer gimbal at several middle angles")
}

fn alter(values: &[f64], machine: &mut Machine) {
    machine.gimbals.iter_mut().zip(values).for_each(|(gimbal, value)| gimbal.angle += value);
}

//! Successive gimbal axes are not at right angles: `rig.axis_nonorthogonality`.

use super::{Act, Effect, Machine, Needs, Parameter, Words};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "A gimbal's bearings are not square to those of the next: a small turn about their common normal.",
        remedy: "Measure the two angles with an autocollimator, or estimate them from rests.",
        needs: "Rests that turn each gimbal while the next one stands at 0 and 90 degrees.",
    };
    let names = ["outer_middle", "middle_inner"];
    Effect::new(
        "rig.axis_nonorthogonality",
        Act::Rig(alter),
        Parameter::amplitudes(&names, "rad", 1e-3),
        words,
    )
    .needing(Needs::GIMBALS)
    .like("rig.wobble", "full turns of the outer gimbal at several middle angles")
    .like("rig.encoder_offset", "full turns of the outer gimbal at middle angles of 0 and 90 degrees")
}

fn alter(values: &[f64], machine: &mut Machine) {
    machine.skew.iter_mut().zip(values).for_each(|(skew, value)| *skew += value);
}

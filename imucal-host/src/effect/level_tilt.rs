//! The base is not level: `rig.level_tilt`.

use super::{Act, Effect, Machine, Parameter, Part, SensorKind, Words};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "The base of the rig is tilted against gravity by more than the model says.",
        remedy: "Level the base, or estimate its two tilts with the accelerometer's triad.",
        needs: "Rests at four or more outer angles with gravity across the outer axis.",
    };
    Effect::new("rig.level_tilt", Act::Rig(alter), Parameter::amplitudes(&["x", "y"], "rad", 1.7e-3), words)
        .part(Part::RigTerm(&[SensorKind::Acc, SensorKind::Mag]))
        .like(
            "acc.bias",
            "rests at opposite outer angles: a tilt stays with the room, a bias turns with the table",
        )
        .like("rig.axis_nonorthogonality", "rests at four outer angles with the middle gimbal at zero")
}

fn alter(values: &[f64], machine: &mut Machine) {
    machine.tilt.iter_mut().zip(values).for_each(|(tilt, value)| *tilt += value);
}

//! The base does not point north: `rig.heading`.

use super::{Act, Effect, Machine, Parameter, Part, SensorKind, Words};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "The base is turned about the vertical against the north of the model.",
        remedy: "Survey the base's azimuth, or estimate the heading of the field in it.",
        needs: "A magnetometer in rests at several attitudes, and a known direction of the field.",
    };
    Effect::new("rig.heading", Act::Rig(alter), vec![Parameter::amplitude("heading", "rad", 9e-3)], words)
        .part(Part::RigTerm(&[SensorKind::Mag]))
        .like(
            "rig.encoder_offset",
            "none with a vertical outer axis: the outer encoder's zero is the same angle",
        )
}

fn alter(values: &[f64], machine: &mut Machine) {
    machine.heading += values.first().copied().unwrap_or(0.0);
}

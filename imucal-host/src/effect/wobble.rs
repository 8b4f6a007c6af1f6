//! The outer axis wobbles in its bearing: `rig.wobble`.
//!
//! ```text
//! turn about u, v = c cos 2α + s sin 2α      u, v: the base's axes across the outer one, each with its own c and s
//! ```
//!
//! Twice a turn: a wobble of once a turn is a constant skew, see `rig.axis_nonorthogonality`.

use super::{Act, Effect, Machine, Needs, Parameter, Words};

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "The outer bearing's races are not round, so that its axis nods as it turns.",
        remedy: "Measure the nod with a level on the outer gimbal; replace the bearing, or put it into the model.",
        needs: "Rests at eight or more outer angles around the full turn.",
    };
    let names = ["u_cos", "u_sin", "v_cos", "v_sin"];
    Effect::new("rig.wobble", Act::Rig(alter), Parameter::amplitudes(&names, "rad", 3e-4), words)
        .needing(Needs::GIMBALS)
        .like("rig.axis_nonorthogonality", "full turns of the outer gimbal at several middle angles")
        .like("rig.encoder_offset", "full turns of the outer gimbal at several middle angles")
        .like("rig.encoder_harmonic", "rests at the same outer angles with the table about another axis")
}

fn alter(values: &[f64], machine: &mut Machine) {
    let outer = machine.gimbals[0];
    let (sin, cos) = libm::sincos(2.0 * outer.angle);
    for (wobble, [c, s]) in machine.wobble.iter_mut().zip(values.as_chunks::<2>().0) {
        let (value, slope) = (c * cos + s * sin, 2.0 * (s * cos - c * sin));
        *wobble = wobble.plus(outer.through(value, slope, -4.0 * value));
    }
}

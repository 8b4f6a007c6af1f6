//! The encoders err periodically: `rig.encoder_harmonic`.
//!
//! ```text
//! α = a + c₁ cos a + s₁ sin a + c₂ cos 2a + s₂ sin 2a      a: as the encoder says
//! ```

use super::{Act, Effect, Machine, Needs, Parameter, Words};

const NAMES: [&str; 12] = [
    "outer_c1",
    "outer_s1",
    "outer_c2",
    "outer_s2",
    "middle_c1",
    "middle_s1",
    "middle_c2",
    "middle_s2",
    "inner_c1",
    "inner_s1",
    "inner_c2",
    "inner_s2",
];

pub(super) fn effect() -> Effect {
    let words = Words {
        cause: "An encoder's disc is eccentric (once a turn) or elliptic (twice a turn).",
        remedy: "Map each encoder against a polygon and autocollimator, or read it with opposite heads.",
        needs: "Rests at eight or more angles of each gimbal, around the full turn.",
    };
    Effect::new("rig.encoder_harmonic", Act::Rig(alter), Parameter::amplitudes(&NAMES, "rad", 3e-4), words)
        .needing(Needs::GIMBALS)
        .like("rig.wobble", "rests at the same outer angles with the table about another axis")
        .like("rig.encoder_offset", "rests around the full turn of each gimbal")
}

fn alter(values: &[f64], machine: &mut Machine) {
    for (gimbal, [c1, s1, c2, s2]) in machine.gimbals.iter_mut().zip(values.as_chunks::<4>().0) {
        let (sin, cos) = libm::sincos(gimbal.angle);
        let (sin2, cos2) = libm::sincos(2.0 * gimbal.angle);
        *gimbal = gimbal.plus(gimbal.through(
            c1 * cos + s1 * sin + c2 * cos2 + s2 * sin2,
            s1 * cos - c1 * sin + 2.0 * (s2 * cos2 - c2 * sin2),
            -c1 * cos - s1 * sin - 4.0 * (c2 * cos2 + s2 * sin2),
        ));
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::effect::Swing;

    #[test]
    fn the_errors_derivatives_are_those_of_the_error() {
        let values: Vec<f64> = (0..12).map(|k| 0.01 * f64::from(k - 5)).collect();
        let at = |t: f64| {
            let mut machine = Machine::exact([Vector3::z(), Vector3::y(), Vector3::x()]);
            machine.gimbals =
                [Swing { angle: 0.3 + 0.7 * t + 0.2 * t * t, rate: 0.7 + 0.4 * t, acceleration: 0.4 }; 3];
            alter(&values, &mut machine);
            machine.gimbals[1]
        };
        let h = 1e-4;
        assert!(((at(1.0 + h).angle - at(1.0 - h).angle) / (2.0 * h) - at(1.0).rate).abs() < 1e-8);
        assert!(((at(1.0 + h).rate - at(1.0 - h).rate) / (2.0 * h) - at(1.0).acceleration).abs() < 1e-8);
    }
}

//! Output that bends with the input's cube: `P.scale_cubic`.
//!
//! ```text
//! y += c x³
//! ```

use super::{Act, Effect, Parameter, SensorKind, SensorRows, Words, XYZ, member_id, of, si, vector};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "The sensitivity falls off or grows towards both ends of the range.",
        remedy: match kind {
            SensorKind::Acc => {
                "Add a cubic term per axis to the calibration: on a rig, `imucal calibrate --model acc=I20`."
            }
            _ => "Add a cubic term per axis to the calibration.",
        },
        needs: "Each axis at levels between zero and the largest, of both signs.",
    };
    let unit = format!("1/({})^2", si(kind));
    let scale = of(kind, 5e-6, 5e-4, 4e-7);
    Effect::member(
        kind,
        "scale_cubic",
        Act::Sensor(kind, alter),
        Parameter::amplitudes(&XYZ, &unit, scale),
        words,
    )
    .like(&member_id(kind, "scale"), "inputs at several levels; six faces alone cannot")
    .like(&member_id(kind, "saturation"), "inputs well below the limit")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let c = vector(values, 0);
    run.add(|_, x| c.component_mul(&x.component_mul(&x.component_mul(x))));
}

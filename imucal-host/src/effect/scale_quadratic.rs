//! Output that bends with the input's square: `P.scale_quadratic`.
//!
//! ```text
//! y += c x²
//! ```

use super::{Act, Effect, Parameter, SensorKind, SensorRows, Words, XYZ, member_id, of, si, vector};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "The sensitivity grows along an axis from one end of the range to the other.",
        remedy: match kind {
            SensorKind::Acc => {
                "Add a quadratic term per axis to the calibration: on a rig, `imucal calibrate --model acc=I17`."
            }
            _ => "Add a quadratic term per axis to the calibration.",
        },
        needs: "Each axis at three or more levels of input.",
    };
    let unit = format!("1/({})", si(kind));
    let scale = of(kind, 5e-5, 1e-3, 2e-5);
    Effect::member(
        kind,
        "scale_quadratic",
        Act::Sensor(kind, alter),
        Parameter::amplitudes(&XYZ, &unit, scale),
        words,
    )
    .like(&member_id(kind, "scale_asymmetry"), "inputs at half and at full level of both signs")
    .like(&member_id(kind, "cross_axis_product"), "input along one axis at a time")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let c = vector(values, 0);
    run.add(|_, x| c.component_mul(&x.component_mul(x)));
}

//! Products of two axes: `P.cross_axis_product`.
//!
//! ```text
//! y_i += c_i,xy x y + c_i,yz y z + c_i,zx z x
//! ```

use nalgebra::Vector3;

use super::{Act, Effect, Parameter, SensorKind, SensorRows, Words, matrix, member_id, of, si};

const NAMES: [&str; 9] = ["x_xy", "x_yz", "x_zx", "y_xy", "y_yz", "y_zx", "z_xy", "z_yz", "z_zx"];

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "An axis' sensitivity depends on the input across it: asymmetric proof mass, cross-field of a magnetometer.",
        remedy: match kind {
            SensorKind::Acc => {
                "Add the product terms to the calibration: on a rig, `imucal calibrate --model acc=I23` has one an axis."
            }
            SensorKind::Gyr => "Add the product terms to the calibration.",
            SensorKind::Mag => {
                "Add the product terms to the calibration; flip the magnetometer by set and reset."
            }
        },
        needs: "Attitudes with input along two axes at once, of all signs.",
    };
    let unit = format!("1/({})", si(kind));
    let scale = of(kind, 3e-5, 1e-3, 2e-5);
    Effect::member(
        kind,
        "cross_axis_product",
        Act::Sensor(kind, alter),
        Parameter::amplitudes(&NAMES, &unit, scale),
        words,
    )
    .like(&member_id(kind, "misalignment"), "inputs of both signs on each pair of axes")
    .like(&member_id(kind, "scale_quadratic"), "input along one axis at a time")
}

fn alter(values: &[f64], run: &mut SensorRows<'_>) {
    let c = matrix(values);
    run.add(|_, x| c * Vector3::new(x.x * x.y, x.y * x.z, x.z * x.x));
}

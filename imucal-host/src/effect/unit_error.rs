//! Values in another unit than they are said to be: `P.unit_error`.

use std::f64::consts::PI;

use super::{Act, DataRun, Effect, Parameter, Part, SensorKind, Spoils, Words, member_id, of};
use crate::recording::unit::STANDARD_GRAVITY;

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "The values are too large by a unit's factor (m/s^2 for g, deg/s for rad/s, mG for uT) to this power.",
        remedy: "Correct the unit in the manifest.",
        needs: "Any input of known size.",
    };
    let power = Parameter { range: (-3.0, 3.0), material: 0.01, ..Parameter::amplitude("power", "-", 1.0) };
    let act = Act::Data(
        kind,
        of(
            kind,
            |values, run| alter(values, run, STANDARD_GRAVITY),
            |values, run| alter(values, run, 180.0 / PI),
            |values, run| alter(values, run, 10.0),
        ),
    );
    Effect::member(kind, "unit_error", act, vec![power], words)
        .part(Part::Fault(Spoils::Scale))
        .like(&member_id(kind, "scale"), "its size: a wrong unit is off by a known factor")
}

fn alter(values: &[f64], run: &mut DataRun<'_>, factor: f64) {
    let factor = libm::pow(factor, values.first().copied().unwrap_or(0.0));
    run.samples.iter_mut().for_each(|sample| *sample *= factor);
}

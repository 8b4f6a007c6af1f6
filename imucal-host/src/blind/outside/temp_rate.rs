//! A bias that follows how fast the unit warms: `y += c Ṫ`.

use super::{XYZ, amplitudes, mechanism, of, vector};
use crate::{
    effect::{Act, Effect, SensorRun},
    recording::SensorKind,
};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let parameters = amplitudes(&XYZ, of(kind, 0.1, 0.01, 2.0));
    mechanism(
        kind,
        "temp_rate",
        Act::Memory(kind, alter),
        parameters,
        "Gradients in the package while it warms.",
    )
}

fn alter(values: &[f64], run: &mut SensorRun<'_>) {
    let c = vector(values, 0);
    let input = run.input;
    for (row, output) in run.output.iter_mut().enumerate() {
        let (from, to) = (row.saturating_sub(1), (row + 1).min(input.len() - 1));
        let time = input[to].time - input[from].time;
        if time > 0.0 {
            let change = input[to].temperature - input[from].temperature;
            *output += c * (change / time);
        }
    }
}

//! A converter that settles too slowly: after a fast change it shows for a while a share of what it held.
//!
//! ```text
//! y += c (h − x)      h: x at the row before the change, for as long as it is dead
//! ```

use nalgebra::Vector3;

use crate::{
    blind::outside::{XYZ, amplitudes, mechanism, of, shape, vector},
    effect::{Act, Effect, SensorRun},
    recording::SensorKind,
};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let mut parameters = amplitudes(&XYZ, 0.1);
    parameters.extend([shape("slope", of(kind, 10.0, 3.0, 12.0)), shape("dead", 0.03)]);
    mechanism(kind, "dead_time", Act::Memory(kind, alter), parameters, "The converter is dead for a while.")
}

fn alter(values: &[f64], run: &mut SensorRun<'_>) {
    let [_, _, _, slope, dead] = *values else { return };
    let c = vector(values, 0);
    let mut held: [Option<(f64, f64)>; 3] = [None; 3];
    for row in 1..run.sensed.len() {
        let (time, since) = (run.input[row].time, run.since_before(row));
        let (before, here) = (run.sensed[row - 1], run.sensed[row]);
        let missed = Vector3::from_fn(|axis, _| {
            held[axis] = held[axis].filter(|(until, _)| time < *until);
            if held[axis].is_none() && (here[axis] - before[axis]).abs() > slope * since {
                held[axis] = Some((time + dead, before[axis]));
            }
            held[axis].map_or(0.0, |(_, value)| value - here[axis])
        });
        run.output[row] += c.component_mul(&missed);
    }
}

//! A stream that holds coordinate acceleration instead of specific force: it lacks gravity.

use nalgebra::Vector3;

use crate::{
    recording::{Recording, SensorKind, Stream},
    simulator::Recorded,
};

/// A stream whose specific force is smaller on average than this share of gravity lacks it.
const WEIGHTLESS: f64 = 0.3;
/// Rows that are averaged.
const ROWS: usize = 2000;

/// Why a stream is no specific force, for a reader; `None` where it is one.
pub fn missing(recording: &Recording, stream: &Stream, movement: &dyn Recorded) -> Option<String> {
    if !movement.gives(SensorKind::Acc) {
        return None;
    }
    let gravity = movement.place().gravity;
    let stride = recording.rows().div_ceil(ROWS).max(1);
    let (mut sum, mut count) = (Vector3::zeros(), 0.0);
    for row in (0..recording.rows()).step_by(stride).filter(|row| movement.known()[*row]) {
        let truth = movement.truth(recording.time[row], &|_| ());
        sum += truth.c_t_p * truth.f_t;
        count += 1.0;
    }
    let found = sum.norm() / f64::max(count, 1.0);
    (count > 0.0 && found < WEIGHTLESS * gravity).then(|| {
        format!(
            "{}: the simulated accelerometer reads {found:.2} m/s² on average, levelled by the simulated rate, where one \
             at rest reads {gravity:.2} m/s²: it holds coordinate acceleration instead of specific force; subtract \
             gravity before the turn into the sensor's axes, f = C (a - g)",
            stream.name
        )
    })
}

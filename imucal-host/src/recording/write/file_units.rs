//! From a recording in SI units back to a table in file units.

use crate::recording::{
    Recording,
    place::Places,
    read::{
        clock::Clock,
        columns::{
            GIMBAL, KNOWN, POSITION, REFERENCE, SEGMENT, SIM_TEMPERATURE, SIMULATED, TEMPERATURE, TIME,
            Table, simulated_slot_of, slot_of,
        },
        number::round_to_digits,
    },
    sensor_kind::SensorKind,
    triple::{Nominal, Triple},
};

/// Digits kept of a converted value: less than a conversion's rounding, more than any sensor has.
const DIGITS: usize = 14;
/// Digits kept of a time: fifteen where they are read as the same time, else sixteen.
const TIME_DIGITS: [usize; 2] = [15, 16];

/// Which columns of [`table_of`] hold numbers of an `f32`.
pub(crate) fn singles_of(recording: &Recording) -> [bool; KNOWN] {
    let mut singles = [false; KNOWN];
    for kind in SensorKind::ALL {
        if recording.sensor(kind).is_some_and(|triple| triple.single) {
            singles[slot_of(kind)..][..3].fill(true);
        }
    }
    singles
}

/// The recording in file units.
pub(crate) fn table_of(recording: &Recording) -> Table {
    let units = &recording.manifest.units;
    let mut columns = vec![Vec::new(); KNOWN];
    let clock = Clock::of(units.t, recording.epoch);
    columns[TIME] = recording.time.iter().map(|time| counted(*time, clock.per_si())).collect();
    for kind in SensorKind::ALL {
        if let Some(triple) = recording.sensor(kind) {
            for axis in 0..3 {
                columns[slot_of(kind) + axis] = raw(triple, axis);
            }
        }
    }
    columns[TEMPERATURE] = recording.temperature.clone().unwrap_or_default();
    for (axis, column) in columns[GIMBAL..REFERENCE].iter_mut().enumerate() {
        let angles = recording.gimbal.iter().flatten().map(|row| row[axis]);
        *column = converted(angles, units.gimbal.per_si(), DIGITS);
    }
    for (part, column) in columns[REFERENCE..POSITION].iter_mut().enumerate() {
        *column = recording.reference.iter().flatten().map(|row| row[part]).collect();
    }
    for (axis, column) in columns[POSITION..SIMULATED].iter_mut().enumerate() {
        *column = recording.position.iter().flatten().map(|row| row[axis]).collect();
    }
    put_simulated(recording, &mut columns);
    let label = |label: &Option<i64>| label.map_or(f64::NAN, |label| label as f64);
    columns[SEGMENT] = recording.segment.iter().flatten().map(label).collect();
    let extra = recording.extra.clone();
    Table { columns, extra, header: None, places: Places::WHOLE, clock, warnings: Vec::new() }
}

fn put_simulated(recording: &Recording, columns: &mut [Vec<f64>]) {
    let Some(simulated) = &recording.simulated else { return };
    for kind in SensorKind::ALL {
        let values = simulated.sensor(kind).unwrap_or_default();
        for axis in 0..3 {
            columns[simulated_slot_of(kind) + axis] = values.iter().map(|value| value[axis]).collect();
        }
    }
    columns[SIM_TEMPERATURE] = simulated.temperature.clone().unwrap_or_default();
}

/// A time, s, in a unit of which so many make a second.
fn counted(time: f64, per_si: f64) -> f64 {
    if per_si == 1.0 {
        return time;
    }
    let [short, long] = TIME_DIGITS.map(|digits| round_to_digits(time * per_si, digits));
    if short / per_si == time { short } else { long }
}

fn converted(values: impl Iterator<Item = f64>, per_si: f64, digits: usize) -> Vec<f64> {
    if per_si == 1.0 {
        return values.collect();
    }
    values.map(|value| round_to_digits(value * per_si, digits)).collect()
}

fn raw(triple: &Triple, axis: usize) -> Vec<f64> {
    let values = triple.values.iter().map(|value| value[axis]);
    if triple.single {
        return values.map(|value| f64::from(triple.nominal.to_raw(value) as f32)).collect();
    }
    if triple.nominal == Nominal::IDENTITY {
        return values.collect();
    }
    values.map(|value| round_to_digits(triple.nominal.to_raw(value), DIGITS)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_written_as_it_was_read() {
        for (per_si, times) in
            [(1e3, [8030.0, 0.1, 123_456.789_012_3]), (1e9, [999_999_999_999_999.0, 7.0, 1e14])]
        {
            for time in times {
                assert_eq!(counted(time / per_si, per_si), time);
            }
        }
        for row in 0..100_000 {
            let time = f64::from(row) * 10.0;
            assert_eq!(counted(time / 1e3, 1e3), time);
        }
    }
}

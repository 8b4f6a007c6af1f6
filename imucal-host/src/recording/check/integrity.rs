//! What is missing, clipped or stuck in a recording.

use std::ops::Range;

use rayon::prelude::*;

use super::{
    saturation::{self, Saturation},
    stuck,
};
use crate::recording::{Recording, sensor_kind::SensorKind, triple::Triple};

/// An interval this many times the median is a gap.
const GAP: f64 = 5.0;

/// Findings about a recording. Rows count from 0, ranges are half-open.
#[derive(Clone, Debug, PartialEq)]
pub struct Integrity {
    /// Intervals longer than five times the median.
    pub gaps: Vec<Gap>,
    /// Of each sensor that was recorded.
    pub sensors: Vec<SensorIntegrity>,
}

/// Samples missing between two rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// First row after the gap.
    pub row: usize,
    /// Time of the row before, s.
    pub start: f64,
    /// Time between the two rows, s.
    pub duration: f64,
}

/// Findings about one sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorIntegrity {
    /// The sensor.
    pub sensor: SensorKind,
    /// Rows in which at least one axis was not measured.
    pub missing: usize,
    /// Stretches at a limit of the sensor, by axis and row.
    pub saturated: Vec<Saturation>,
    /// Stretches in which no axis changes for too long.
    pub stuck: Vec<Range<usize>>,
    /// Of each row: measured on all axes, not saturated and not stuck.
    pub usable: Vec<bool>,
}

impl Integrity {
    /// Findings about a sensor, if it was recorded.
    #[must_use]
    pub fn sensor(&self, kind: SensorKind) -> Option<&SensorIntegrity> {
        self.sensors.iter().find(|each| each.sensor == kind)
    }
}

/// Looks for gaps, missing samples, saturation and stuck stretches.
#[must_use]
pub fn inspect(recording: &Recording) -> Integrity {
    let sensors = SensorKind::ALL
        .into_par_iter()
        .filter_map(|kind| recording.sensor(kind).map(|triple| inspect_sensor(recording, kind, triple)))
        .collect();
    Integrity { gaps: gaps(recording), sensors }
}

fn gaps(recording: &Recording) -> Vec<Gap> {
    let Some(median) = recording.median_interval() else {
        return Vec::new();
    };
    let pairs = recording.time.windows(2).enumerate();
    pairs
        .map(|(at, pair)| Gap { row: at + 1, start: pair[0], duration: pair[1] - pair[0] })
        .filter(|gap| gap.duration > GAP * median)
        .collect()
}

fn inspect_sensor(recording: &Recording, sensor: SensorKind, triple: &Triple) -> SensorIntegrity {
    let mut usable: Vec<bool> =
        triple.values.iter().map(|value| value.iter().all(|component| component.is_finite())).collect();
    let missing = usable.iter().filter(|measured| !**measured).count();
    let saturated = saturation::find(triple);
    let stuck = stuck::find(&recording.time, &triple.values);
    for rows in saturated.iter().map(|stretch| &stretch.rows).chain(&stuck) {
        usable[rows.clone()].fill(false);
    }
    SensorIntegrity { sensor, missing, saturated, stuck, usable }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::recording::Manifest;

    #[test]
    fn gaps_missing_and_stuck_rows_are_found_and_masked() {
        let time = (0..300).map(|row| f64::from(row) * 0.01 + if row >= 100 { 1.0 } else { 0.0 }).collect();
        let mut recording = Recording::new("run.csv", Manifest::default(), time);
        let mut values: Vec<_> =
            (0..300).map(|row| Vector3::new(f64::from(row * 7 % 13), f64::from(row * 3 % 7), 9.8)).collect();
        values[10].y = f64::NAN;
        values[150..250].fill(Vector3::new(1.0, 1.0, 9.0));
        recording.acc = recording.manifest.triple(SensorKind::Acc, values).ok();
        let found = inspect(&recording);
        assert_eq!(found.gaps.len(), 1);
        assert_eq!(found.gaps[0].row, 100);
        assert!((found.gaps[0].duration - 1.01).abs() < 1e-9 && (found.gaps[0].start - 0.99).abs() < 1e-9);
        let acc = found.sensor(SensorKind::Acc).unwrap();
        assert_eq!((acc.missing, acc.saturated.len(), acc.stuck.len()), (1, 0, 1));
        assert_eq!(acc.stuck[0], 150..250);
        assert_eq!(acc.usable.iter().filter(|usable| !**usable).count(), 101);
        assert!(found.sensor(SensorKind::Gyr).is_none());
    }

    #[test]
    fn a_recording_of_one_row_has_no_gaps() {
        let mut recording = Recording::new("run.csv", Manifest::default(), vec![0.0]);
        recording.acc = recording.manifest.triple(SensorKind::Acc, vec![Vector3::z()]).ok();
        assert!(inspect(&recording).gaps.is_empty());
    }
}

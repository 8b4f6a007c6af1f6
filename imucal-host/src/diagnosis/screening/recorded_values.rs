//! A recorded sensor that is slower than the rows of its table, which repeat each value until the next one comes, as a
//! magnetometer's does next to a fast gyroscope.
//!
//! Taken as it is, each change would seem late by half of the time that a value is held, and in steps. The first row of each value
//! is kept, and the others have none. Not modelled: rows whose converter repeats values by chance, which come at uneven
//! distances and are left as they are.

use std::borrow::Cow;

use nalgebra::Vector3;

use super::held_values::held;
use crate::recording::{Recording, SensorKind};

/// The recording without repeated values, and what a reader ought to know of each sensor that had some.
pub fn fresh(recording: &Recording) -> (Cow<'_, Recording>, Vec<String>) {
    let mut fresh = Cow::Borrowed(recording);
    let mut remarks = Vec::new();
    for kind in SensorKind::ALL {
        let Some(sensor) = recording.sensor(kind) else { continue };
        let same = |row: usize| sensor.values[row] == sensor.values[row - 1];
        let Some(found) = held(sensor.values.len(), &same).filter(|found| found.is_even) else {
            continue;
        };
        let own = fresh.to_mut();
        let triple = match kind {
            SensorKind::Acc => &mut own.acc,
            SensorKind::Gyr => &mut own.gyr,
            SensorKind::Mag => &mut own.mag,
        };
        if let Some(triple) = triple {
            found.repeated.iter().for_each(|row| triple.values[*row] = Vector3::repeat(f64::NAN));
        }
        remarks.push(format!(
            "each value of the {kind} stands in {:.0} rows: the first row of each is used, the others are left out",
            found.rows
        ));
    }
    (fresh, remarks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{Manifest, Nominal, Triple, Unit};

    /// A magnetometer of 1000 rows.
    fn recording(value: impl Fn(usize) -> f64) -> Recording {
        let time: Vec<f64> = (0..1000).map(|row| 0.01 * row as f64).collect();
        let values = (0..1000).map(|row| Vector3::repeat(value(row))).collect();
        let unit = Unit::MicroTesla;
        let mag = Triple { values, unit, nominal: Nominal::IDENTITY, full_scale: None, single: false };
        Recording { mag: Some(mag), ..Recording::new("held.csv", Manifest::default(), time) }
    }

    #[test]
    fn a_slower_magnetometer_has_a_value_where_a_new_one_comes() {
        // 30 values a second in 100 rows.
        let slow = recording(|row| (row * 3 / 10) as f64);
        let (fresh, remarks) = fresh(&slow);
        let given = fresh.mag.as_ref().unwrap().values.iter().filter(|value| value.x.is_finite()).count();
        assert!((299..=302).contains(&given), "{given}");
        assert!(remarks[0].contains("mag stands in 3 rows"), "{remarks:?}");
    }

    #[test]
    fn values_that_a_coarse_converter_repeats_by_chance_stay() {
        let mut state = 7_u64;
        let chance: Vec<f64> = (0..1000)
            .scan(0.0, |value, _| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                *value += if state >> 33 & 3 == 0 { 1.0 } else { 0.0 };
                Some(*value)
            })
            .collect();
        let coarse = recording(|row| chance[row]);
        let (same, remarks) = fresh(&coarse);
        assert!(matches!(same, Cow::Borrowed(_)) && remarks.is_empty(), "{remarks:?}");
    }
}

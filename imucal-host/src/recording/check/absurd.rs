//! Samples that no sensor can have measured: a digit or a decimal point lost on the way.
//!
//! One of them would drown the noise of all rows in any sum. They become missing, with a warning.

use rayon::prelude::*;

use crate::recording::{Recording, place::Places, sensor_kind::SensorKind, warning::Warning};

/// Beyond ten thousand times gravity, m/s², nothing that is calibrated survives.
const ACCELERATION: f64 = 1e5;
/// More than a hundred thousand turns a minute, rad/s.
const RATE: f64 = 1e4;
/// The Earth's field has no such neighbour: this many times the median.
const FIELD: f64 = 1e4;

/// Takes absurd samples out, and notes the first of each axis and their number.
pub(crate) fn mask(recording: &mut Recording, places: &Places) {
    let absurd: Vec<_> = SensorKind::ALL.par_iter().map(|kind| find(recording, *kind)).collect();
    let path = recording.path.clone();
    for (kind, absurd) in SensorKind::ALL.into_iter().zip(absurd) {
        let triple = match kind {
            SensorKind::Acc => &mut recording.acc,
            SensorKind::Gyr => &mut recording.gyr,
            SensorKind::Mag => &mut recording.mag,
        };
        let (Some(triple), Some(absurd)) = (triple, absurd) else { continue };
        for ((axis, column), rows) in kind.columns().into_iter().enumerate().zip(absurd) {
            let Some(first) = rows.first().copied() else { continue };
            recording.warnings.push(Warning::Absurd {
                path: path.clone(),
                place: places.of(first),
                column: column.to_owned(),
                found: triple.nominal.to_raw(triple.values[first][axis]),
                unit: triple.unit,
                more: rows.len() - 1,
            });
            rows.iter().for_each(|row| triple.values[*row][axis] = f64::NAN);
        }
    }
}

/// Rows of absurd samples, by axis; none where most samples are beyond the limit, which the unit explains and not a lost digit.
fn find(recording: &Recording, kind: SensorKind) -> Option<[Vec<usize>; 3]> {
    let triple = recording.sensor(kind)?;
    let limit = match kind {
        SensorKind::Acc => ACCELERATION,
        SensorKind::Gyr => RATE,
        SensorKind::Mag => FIELD * triple.median_norm().filter(|median| *median > 0.0)?,
    };
    let beyond = |axis: usize| {
        let rows = 0..triple.values.len();
        rows.filter(|row| triple.values[*row][axis].abs() > limit).collect::<Vec<_>>()
    };
    let found = [0, 1, 2].map(beyond);
    // The median takes longer to find than the largest.
    let is_none = found.iter().all(Vec::is_empty);
    (!is_none && triple.median_norm()? < limit).then_some(found)
}

#[cfg(test)]
mod tests {
    use crate::recording::fixture::{assert_says, csv};

    #[test]
    fn a_sample_that_lost_its_decimal_point_is_taken_out_and_named() {
        let fixture = csv("t,acc_x,acc_y,acc_z\n0,0,0,9.8\n1,0,98012345,9.8\n2,0,0,9.8\n3,0,-1e300,9.8\n");
        let values = fixture.read().acc.unwrap().values;
        assert!(values[1].y.is_nan() && values[3].y.is_nan() && values[1].z == 9.8 && values[2].y == 0.0);
        assert_says(&fixture.warnings()[0], &["run.csv, line 3, column `acc_y`", "9.801e7 m/s^2", "1 more"]);
    }

    #[test]
    fn a_magnetometer_in_any_unit_is_measured_against_itself() {
        let fixture = csv("t,mag_x,mag_y,mag_z\n0,40,0,0\n1,40,0,1e9\n2,0,40,0\n");
        assert!(fixture.read().mag.unwrap().values[1].z.is_nan());
    }
}

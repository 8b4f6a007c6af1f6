//! Stretches in which a sensor repeats itself.

use std::ops::Range;

use nalgebra::Vector3;

/// No shorter stretch is called stuck, s.
const DURATION: f64 = 0.5;
/// Nor one shorter than this many of the sensor's usual repetitions.
const REPETITIONS: usize = 20;

/// Rows in which all three axes repeat one value for too long. A sensor slower than the recording
/// repeats each of its values for some rows; that run length is the measure. Missing rows end a run.
pub(crate) fn find(time: &[f64], values: &[Vector3<f64>]) -> Vec<Range<usize>> {
    let runs = runs(values);
    let mut lengths: Vec<usize> = runs.iter().map(Range::len).collect();
    lengths.sort_unstable();
    // A single run is the whole recording and no measure of itself.
    let usual = lengths.get(lengths.len() / 2).filter(|_| lengths.len() > 1).copied().unwrap_or(1);
    let long = |run: &Range<usize>| {
        run.len() > REPETITIONS * usual && time[run.end - 1] - time[run.start] > DURATION
    };
    runs.into_iter().filter(long).collect()
}

/// Maximal stretches of equal, measured rows.
fn runs(values: &[Vector3<f64>]) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for (row, value) in values.iter().enumerate() {
        match runs.last_mut() {
            // NaN equals nothing.
            Some(run) if run.end == row && values[run.start] == *value => run.end += 1,
            _ if value.iter().all(|component| component.is_finite()) => runs.push(row..row + 1),
            _ => {}
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    fn time(rows: usize) -> Vec<f64> {
        (0..rows).map(|row| row as f64 * 0.01).collect()
    }

    fn noise(row: usize) -> Vector3<f64> {
        Vector3::new((row * 7 % 13) as f64, (row * 5 % 11) as f64, 9.8)
    }

    #[test]
    fn a_frozen_second_is_stuck_and_half_a_second_is_not() {
        let frozen = |from: usize, to: usize| {
            (0..400).map(|row| noise(if (from..to).contains(&row) { from } else { row })).collect::<Vec<_>>()
        };
        assert_eq!(find(&time(400), &frozen(100, 200)).first(), Some(&(100..200)));
        assert!(find(&time(400), &frozen(100, 150)).is_empty());
    }

    #[test]
    fn a_slow_sensor_that_holds_its_value_is_not_stuck_until_it_stops() {
        let held: Vec<_> =
            (0..2000).map(|row| noise(if row >= 1500 { 1500 / 10 } else { row / 10 })).collect();
        assert_eq!(find(&time(2000), &held).first(), Some(&(1500..2000)));
        assert!(find(&time(1500), &held[..1500]).is_empty());
    }

    #[test]
    fn missing_rows_end_a_run() {
        let mut values: Vec<_> = (0..200).map(noise).collect();
        values[60..160].fill(Vector3::new(1.0, 2.0, 3.0));
        values[110] = Vector3::repeat(f64::NAN);
        assert!(find(&time(200), &values).is_empty());
        assert_eq!(runs(&values).len(), 60 + 2 + 40);
    }
}

//! Stretches in which a sensor repeats itself.

use std::{iter, ops::Range};

use nalgebra::Vector3;

/// No shorter stretch is called stuck, s.
const DURATION: f64 = 0.5;
/// Nor one shorter than this many of the sensor's usual repetitions.
const REPETITIONS: usize = 20;

/// Rows in which all three axes repeat one value for too long. A sensor slower than the recording
/// repeats each of its values for some rows; that run length is the measure. Missing rows end a run.
pub(crate) fn find(time: &[f64], values: &[Vector3<f64>]) -> Vec<Range<usize>> {
    // Runs by their length, and those that may be too long.
    let (mut counts, mut repeated) = (Vec::new(), Vec::new());
    for run in runs(values) {
        let length = run.len();
        if counts.len() <= length {
            counts.resize(length + 1, 0);
        }
        counts[length] += 1;
        if length > REPETITIONS {
            repeated.push(run);
        }
    }
    let usual = usual(&counts);
    let long = |run: &Range<usize>| {
        run.len() > REPETITIONS * usual && time[run.end - 1] - time[run.start] > DURATION
    };
    repeated.retain(long);
    repeated
}

/// The median length of runs, of which there are so many of each length.
fn usual(counts: &[usize]) -> usize {
    let total: usize = counts.iter().sum();
    if total < 2 {
        // A single run is the whole recording and no measure of itself.
        return 1;
    }
    let up_to = counts.iter().scan(0, |sum, count| {
        *sum += count;
        Some(*sum)
    });
    up_to.take_while(|up_to| *up_to <= total / 2).count()
}

/// Maximal stretches of equal, measured rows, in order.
fn runs(values: &[Vector3<f64>]) -> impl Iterator<Item = Range<usize>> {
    let mut next = 0;
    iter::from_fn(move || {
        let measured = |value: &Vector3<f64>| value.iter().all(|component| component.is_finite());
        let start = next + values[next..].iter().position(measured)?;
        // NaN equals nothing.
        let length = values[start..].iter().take_while(|value| **value == values[start]).count();
        next = start + length;
        Some(start..next)
    })
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
    fn the_usual_length_is_the_upper_median() {
        assert_eq!(usual(&[]), 1);
        assert_eq!(usual(&[0, 0, 0, 1]), 1);
        assert_eq!(usual(&[0, 1, 0, 1]), 3);
        assert_eq!(usual(&[0, 2, 0, 1]), 1);
        assert_eq!(usual(&[0, 3, 4, 1]), 2);
    }

    #[test]
    fn missing_rows_end_a_run() {
        let mut values: Vec<_> = (0..200).map(noise).collect();
        values[60..160].fill(Vector3::new(1.0, 2.0, 3.0));
        values[110] = Vector3::repeat(f64::NAN);
        assert!(find(&time(200), &values).is_empty());
        assert_eq!(runs(&values).count(), 60 + 2 + 40);
    }
}

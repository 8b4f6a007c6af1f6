//! What is missing, clipped or stuck in a recording, in words: stretch by stretch, or of very many their number and the longest.

use std::ops::Range;

use crate::recording::check::integrity::{Gap, Integrity, SensorIntegrity};

/// As many of a kind are listed one by one.
const LISTED: usize = 8;
/// Batches of fewer rows than this, between gaps, hold times at which they were read.
const BATCH: usize = 50;

/// Warnings of a recording of so many rows.
pub(super) fn of(integrity: &Integrity, rows: usize) -> Vec<String> {
    let mut warnings = gaps(&integrity.gaps, rows);
    for sensor in &integrity.sensors {
        let prefix = sensor.sensor.prefix();
        if sensor.missing > 0 {
            warnings.push(format!("{prefix}: {} rows not measured", sensor.missing));
        }
        for axis in 0..3 {
            let of_axis = sensor.saturated.iter().filter(|stretch| stretch.axis == axis);
            let stretches: Vec<_> = of_axis.map(|stretch| stretch.rows.clone()).collect();
            let name = format!("{prefix}_{}", ["x", "y", "z"][axis]);
            warnings.extend(left_out(&name, "clipped", &stretches));
        }
        warnings.extend(stuck(sensor));
    }
    warnings
}

/// Warnings of the stretches in which a sensor repeats itself.
pub(crate) fn stuck(sensor: &SensorIntegrity) -> Vec<String> {
    left_out(sensor.sensor.prefix(), "stuck", &sensor.stuck)
}

fn gaps(gaps: &[Gap], rows: usize) -> Vec<String> {
    let one = |gap: &Gap| {
        format!("gap of {:.3} s before row {} (after t = {:.3} s)", gap.duration, gap.row, gap.start)
    };
    if gaps.len() <= LISTED {
        return gaps.iter().map(one).collect();
    }
    let longest = gaps.iter().max_by(|a, b| a.duration.total_cmp(&b.duration));
    let mut warnings: Vec<String> =
        longest.iter().map(|gap| format!("{} gaps; the longest is a {}", gaps.len(), one(gap))).collect();
    let batch = rows / (gaps.len() + 1);
    if batch < BATCH {
        warnings.push(format!(
            "a gap after every {batch} rows: the times seem to be those at which rows were read in batches; write for each row \
             the time at which it was measured"
        ));
    }
    warnings
}

/// Stretches of a sensor or an axis that are left out.
fn left_out(name: &str, why: &str, stretches: &[Range<usize>]) -> Vec<String> {
    let one = |rows: &Range<usize>| format!("{why} in rows {} to {}", rows.start, rows.end);
    if stretches.len() <= LISTED {
        return stretches.iter().map(|rows| format!("{name}: {}; left out", one(rows))).collect();
    }
    let rows: usize = stretches.iter().map(ExactSizeIterator::len).sum();
    let longest = stretches.iter().max_by_key(|rows| rows.len()).map(one).unwrap_or_default();
    vec![format!(
        "{name}: {why} in {} stretches of {rows} rows together; the longest {longest}; left out",
        stretches.len()
    )]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_stretches_are_listed_and_of_many_the_longest_is_named() {
        let few = left_out("gyr", "stuck", &[0..100, 200..220]);
        assert_eq!(few, ["gyr: stuck in rows 0 to 100; left out", "gyr: stuck in rows 200 to 220; left out"]);
        let many: Vec<_> = (0..20).map(|k| 100 * k..100 * k + 10 + k).collect();
        let many = left_out("acc_x", "clipped", &many);
        let all = "acc_x: clipped in 20 stretches of 390 rows together; the longest clipped in rows 1900 to 1929; left out";
        assert_eq!(many, [all]);
    }

    #[test]
    fn rows_that_were_read_in_batches_are_named() {
        let gap = |row: usize| Gap { row, start: 0.1 * row as f64, duration: 0.1 };
        assert_eq!(gaps(&[gap(10)], 1000).len(), 1);
        let all: Vec<Gap> = (1..100).map(|k| gap(10 * k)).collect();
        let named = gaps(&all, 1000);
        assert!(named.len() == 2 && named[1].starts_with("a gap after every 10 rows"), "{named:?}");
        assert_eq!(gaps(&all[..10], 1000).len(), 1, "a batch of 90 rows is none");
    }
}

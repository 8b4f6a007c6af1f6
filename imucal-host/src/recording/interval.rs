//! Whether the times can be in the unit the manifest says.
//!
//! Wrong by a thousand they turn a stream of samples into shots taken one by one, each for a rest; wrong the other
//! way they make windows of a second longer than any memory.

use super::Recording;
use super::read_error::ReadError;
use super::unit::TimeUnit;
use super::warning::Warning;

/// Intervals, s, that need no explanation: sampled, or shot by shot.
const USUAL: std::ops::RangeInclusive<f64> = 1e-5..=2.0;
/// Intervals, s, of inertial units.
const SAMPLED: std::ops::RangeInclusive<f64> = 1e-4..=0.2;
/// Below it, s, nothing inertial is sampled.
const SHORTEST: f64 = 1e-7;
/// Nor do so many seconds, more than a day, lie between two shots of one recording.
const LONGEST: f64 = 1e5;
/// A hand that takes shots is not as steady as this: width of the middle four fifths over the median.
const STEADY: f64 = 0.1;
/// Nor as patient as to take so many.
const MANY: usize = 100;

/// Whether an interval, s, is one that a wrong unit would explain.
pub(crate) fn is_unusual(seconds: f64) -> bool {
    !USUAL.contains(&seconds)
}

/// Refuses times that are clearly in another unit, and notes those that are merely unusual.
pub(crate) fn check(recording: &mut Recording) -> Result<(), ReadError> {
    let Some(found) = recording.median_interval().filter(|interval| is_unusual(*interval)) else {
        return Ok(());
    };
    let unit = recording.manifest.units.t;
    let fits = |other: &TimeUnit| SAMPLED.contains(&(found * unit.per_si() / other.per_si()));
    let suggestion = [TimeUnit::Second, TimeUnit::Millisecond, TimeUnit::Microsecond].into_iter().find(fits);
    let sampled = recording.rows() >= MANY && is_steady(&recording.time, found);
    if !(SHORTEST..=LONGEST).contains(&found) || (sampled && suggestion.is_some()) {
        return Err(ReadError::IntervalImplausible {
            path: recording.path.clone(),
            unit,
            found,
            remedy: suggestion.map_or_else(
                || "correct the times, or t of [units] in the manifest".to_owned(),
                |other| {
                    format!(
                        "the times look like `{other}`: write t = \"{other}\" below [units] in the manifest"
                    )
                },
            ),
        });
    }
    recording.warnings.push(Warning::IntervalUnusual { path: recording.path.clone(), unit, found });
    Ok(())
}

fn is_steady(time: &[f64], median: f64) -> bool {
    let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_unstable_by(f64::total_cmp);
    let last = steps.len().saturating_sub(1);
    steps
        .get(last - last / 10)
        .zip(steps.get(last / 10))
        .is_some_and(|(high, low)| high - low < STEADY * median)
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{Fixture, assert_says, csv};

    fn samples(rows: usize, time: impl Fn(usize) -> f64) -> String {
        (0..rows).fold("t,acc_x,acc_y,acc_z\n".to_owned(), |text, k| text + &format!("{},0,0,9.8\n", time(k)))
    }

    #[test]
    fn steady_times_that_another_unit_explains_are_refused_with_that_unit() {
        let message = csv(samples(200, |k| k as f64 * 10.0)).error();
        assert_says(&message, &["run.csv, column `t`", "1e1 s", "`s`", "t = \"ms\"", "[units]"]);
        assert_says(&csv(samples(200, |k| k as f64 * 1e4)).error(), &["t = \"us\""]);
        let seconds = samples(200, |k| k as f64 * 0.01);
        let fixture = Fixture::new("run.csv", "[units]\nt = \"us\"\n", seconds);
        assert_says(&fixture.error(), &["1e-8 s", "`us`", "t = \"s\""]);
    }

    #[test]
    fn shots_half_a_minute_apart_are_only_warned_about() {
        let uneven = csv(samples(200, |k| k as f64 * 30.0 + (k % 7) as f64));
        assert_says(&uneven.warnings()[0], &["median interval", "check t of [units]"]);
        assert_says(&csv(samples(24, |k| k as f64 * 30.0)).warnings()[0], &["median interval"]);
    }

    #[test]
    fn times_that_nothing_samples_at_are_refused() {
        assert_says(
            &csv(samples(3, |k| k as f64 * 1e-300)).error(),
            &["run.csv, column `t`", "1e-300 s", "correct"],
        );
    }
}

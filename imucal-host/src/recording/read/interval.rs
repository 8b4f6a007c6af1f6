//! Whether the times can be in the unit the manifest says.
//!
//! Wrong by a thousand they turn a stream of samples into shots taken one by one, each for a rest; wrong the other
//! way they make windows of a second longer than any memory.

use crate::recording::{Recording, place::Place, read_error::ReadError, unit::TimeUnit, warning::Warning};

/// Intervals, s, that need no explanation: sampled, at 32 kHz at the most, or shot by shot.
const USUAL: std::ops::RangeInclusive<f64> = 2.5e-5..=2.0;
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
/// Nor, however unsteady, so many.
const TOO_MANY: usize = 1000;
/// So many samples last longer than this, s.
const BRIEF: f64 = 1.0;

/// What a gyroscope's times may be instead.
const SELDOM: &str = "; if they are right, leave the gyroscope out: one that is read fewer than five times a second is not taken";

/// Whether an interval, s, is one that a wrong unit would explain.
pub(crate) fn is_unusual(seconds: f64) -> bool {
    !USUAL.contains(&seconds)
}

/// Refuses times that are clearly in another unit, and notes those that are merely unusual.
pub(crate) fn check(recording: &mut Recording, from: Place) -> Result<(), ReadError> {
    let Some(found) = recording.median_interval() else { return Ok(()) };
    let unit = recording.manifest.units.t;
    let in_unit = |other: &TimeUnit| found * unit.per_si() / other.per_si();
    let fits = |other: &TimeUnit| *other != unit && SAMPLED.contains(&in_unit(other));
    let suggestion = TimeUnit::ALL.into_iter().find(fits);
    let sampled =
        recording.rows() >= TOO_MANY || (recording.rows() >= MANY && is_steady(&recording.time, found));
    // Nothing is integrated from a gyroscope that is read shot by shot.
    let slow = recording.gyr.is_some() && found > *SAMPLED.end();
    let odd = is_unusual(found) || slow || is_brief(&recording.time);
    if !(SHORTEST..=LONGEST).contains(&found) || (odd && sampled && suggestion.is_some()) {
        return Err(ReadError::IntervalImplausible {
            path: recording.path.clone(),
            from,
            unit,
            found,
            lasting: lasting(&recording.time),
            remedy: suggestion.map_or_else(
                || "correct the times, or t of [units] in the manifest".to_owned(),
                |other| {
                    // Nothing else is wrong with it: it may be true.
                    let seldom = slow && !is_unusual(found) && !is_brief(&recording.time);
                    format!(
                        "the times look like `{other}`: write t = \"{other}\" below [units] in the manifest, or --unit t={other}{}",
                        if seldom { SELDOM } else { "" }
                    )
                },
            ),
        });
    }
    if is_unusual(found) {
        recording.warnings.push(Warning::IntervalUnusual { path: recording.path.clone(), from, unit, found });
    }
    Ok(())
}

/// From the first row to the last, s.
fn lasting(time: &[f64]) -> f64 {
    time.first().zip(time.last()).map_or(0.0, |(first, last)| last - first)
}

fn is_brief(time: &[f64]) -> bool {
    time.len() >= MANY && lasting(time) < BRIEF
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
    use crate::recording::fixture::{Fixture, assert_says, csv};

    fn samples(rows: usize, time: impl Fn(usize) -> f64) -> String {
        (0..rows).fold("t,acc_x,acc_y,acc_z\n".to_owned(), |text, k| text + &format!("{},0,0,9.8\n", time(k)))
    }

    #[test]
    fn steady_times_that_another_unit_explains_are_refused_with_that_unit() {
        let message = csv(samples(200, |k| k as f64 * 10.0)).error();
        assert_says(
            &message,
            &["run.csv, from line 2 on, column `t`", "1e1 s", "`s`", "t = \"ms\"", "[units]"],
        );
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
    fn nanoseconds_called_anything_else_are_refused_however_unsteady() {
        // Stamped by an operating system: the interval varies by more than a tenth.
        let jitter = |k: usize| k as f64 * 1e7 + (k * 7919 % 13) as f64 * 4e5;
        for unit in ["s", "ms", "us"] {
            let fixture =
                Fixture::new("run.csv", format!("[units]\nt = \"{unit}\"\n").as_str(), samples(1200, jitter));
            assert_says(&fixture.error(), &["run.csv, from line 2 on, column `t`", "t = \"ns\""]);
        }
        let named = Fixture::new("run.csv", "[units]\nt = \"ns\"\n", samples(1200, jitter));
        assert!(named.warnings().is_empty() && (named.read().time[1199] - 11.99).abs() < 0.01);
    }

    #[test]
    fn a_thousand_rows_of_a_tenth_of_a_second_are_in_another_unit() {
        // Seconds at 10 Hz, called milliseconds: an interval of 1e-4 s is one that sensors have.
        let fixture = Fixture::new("run.csv", "[units]\nt = \"ms\"\n", samples(600, |k| k as f64 * 0.1));
        assert_says(&fixture.error(), &["0.060 s in all", "t = \"s\""]);
        assert!(csv(samples(600, |k| k as f64 * 0.01)).warnings().is_empty());
    }

    #[test]
    fn a_gyroscope_read_once_a_second_is_in_another_unit() {
        let rows =
            (0..200).fold("t,gyr_x,gyr_y,gyr_z\n".to_owned(), |text, k| text + &format!("{k},0,0,1\n"));
        assert_says(&csv(rows).error(), &["1e0 s", "t = \"ms\"", "leave the gyroscope out"]);
        assert!(csv(samples(200, |k| k as f64)).warnings().is_empty());
    }

    #[test]
    fn times_that_nothing_samples_at_are_refused() {
        assert_says(
            &csv(samples(3, |k| k as f64 * 1e-300)).error(),
            &["run.csv, from line 2 on, column `t`", "1e-300 s", "correct"],
        );
    }
}

//! The drift watch on simulated units: how often it raises an alarm without cause, how soon it finds what is there, and what it makes of
//! disturbances and of bad input. Prints the tables of `imucal-host/docs/devices.md`:
//! `cargo test -p imucal-core --test watch -- --nocapture --test-threads 1`.

mod bad_input;
mod disturbances;
mod false_alarms;
mod slow;
mod steps;
mod summary;
mod unit;

use imucal_core::watch::{Shift, Statistic, Watch};
use unit::{Grade, Unit};

/// Seconds of a day.
const DAY: u32 = 86_400;
/// Seconds in which the watch comes to know a unit before a test disturbs it.
const SETTLED: u32 = 600;

/// A unit in one place, and its watch, after [`SETTLED`].
fn settled(grade: Grade, seed: u64) -> (Unit, Watch) {
    let mut unit = Unit::new(grade, 0.0, seed);
    let mut watch = Watch::new(&grade.record(), unit.settings);
    rest(&mut unit, &mut watch, SETTLED);
    (unit, watch)
}

/// Lets a unit lie for some seconds.
fn rest(unit: &mut Unit, watch: &mut Watch, seconds: u32) {
    (0..seconds).for_each(|_| {
        watch.push(&unit.look());
    });
}

/// The first shift that there is now.
fn first_shift(watch: &Watch) -> Option<(Statistic, Shift)> {
    let summary = watch.summary();
    Statistic::ALL.into_iter().find_map(|statistic| Some((statistic, summary.statistic(statistic).shift?)))
}

/// Alarms of all statistics so far.
fn alarms(watch: &Watch) -> u32 {
    watch.summary().statistics.iter().map(|statistic| u32::from(statistic.alarms)).sum()
}

/// The value below which a share of the sorted values lies.
fn quantile<T: Copy>(sorted: &[T], share: f64) -> T {
    sorted[((sorted.len() - 1) as f64 * share).round() as usize]
}

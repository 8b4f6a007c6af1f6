//! Healthy units for months.

use imucal_core::watch::{Watch, WatchSettings};
use rand::RngExt;

use crate::{
    DAY, alarms,
    unit::{GRADES, Grade, Unit},
};

/// Units of each kind, and days for which each is watched.
const UNITS: u64 = 4;
const DAYS: u32 = 30;

/// How a unit spends its days.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Life {
    /// It lies in one place.
    Still,
    /// Rests of 10 s to 10 min in other attitudes and places, and between them twice as long under way.
    Carried,
    /// Ten seconds of rest and ten of motion, for ever between the same two attitudes.
    Alternating,
}

/// Days of a healthy unit; alarms, and days of rest that were watched.
fn live(grade: Grade, life: Life, days: u32, seed: u64, settings: impl Fn(&mut WatchSettings)) -> (u32, f64) {
    let place = if life == Life::Carried { 0.05 } else { 0.0 };
    let mut unit = Unit::new(grade, place, seed);
    settings(&mut unit.settings);
    let mut watch = Watch::new(&grade.record(), unit.settings);
    let poses = [unit.pose(), {
        unit.turn(place);
        unit.pose()
    }];
    let (mut left, mut rests) = (0, 0);
    while unit.time < days * DAY {
        if left == 0 && life == Life::Carried {
            let draw: f32 = unit.rng.random();
            left = (10.0 * 60f32.powf(draw)) as u32;
            unit.time += 2 * left;
            unit.turn(place);
        } else if left == 0 && life == Life::Alternating {
            left = 10;
            unit.time += 10;
            rests += 1;
            unit.take(&poses[rests % 2]);
        }
        left = left.saturating_sub(u32::from(life != Life::Still));
        watch.push(&unit.look());
    }
    (alarms(&watch), f64::from(watch.summary().watched) / f64::from(DAY))
}

/// The largest count that a Poisson variable of a mean does not exceed in 99.9 of 100 cases.
fn most_of_poisson(mean: f64) -> u32 {
    let (mut term, mut sum, mut count) = ((-mean).exp(), 0.0, 0);
    loop {
        sum += term;
        if sum > 0.999 {
            return count;
        }
        count += 1;
        term *= mean / f64::from(count);
    }
}

#[test]
fn healthy_units_raise_no_more_alarms_than_the_stated_rate() {
    println!(
        "\nfalse alarms of healthy units, {UNITS} of each kind for {DAYS} days; stated: one in 100 days of rest"
    );
    let mut all = (0, 0.0, 0.0);
    for grade in GRADES {
        for (life, words) in [
            (Life::Still, "lies in one place"),
            (Life::Carried, "is carried about"),
            (Life::Alternating, "between two attitudes"),
        ] {
            let lives = (0..UNITS).map(|seed| live(grade, life, DAYS, 1000 + seed, |_| {}));
            let (count, rest) =
                lives.fold((0, 0.0), |(count, days), (more, rest)| (count + more, days + rest));
            println!("  {:<11} {words:<22} {rest:>6.0} days of rest  {count:>3} alarms", grade.name);
            let rate = f64::from(WatchSettings::default().false_alarms);
            assert!(count <= most_of_poisson(rate * rest), "{} {life:?}: {count} in {rest} days", grade.name);
            all = (all.0 + count, all.1 + rest, all.2 + f64::from(UNITS as u32 * DAYS));
        }
    }
    let (count, rest, days) = all;
    println!(
        "  all {rest:.0} days of rest in {days:.0}: {count} alarms, one in {:.0} days",
        days / f64::from(count.max(1))
    );
    assert!(f64::from(count) <= days / 30.0, "more than one alarm in 30 days: {count}");
}

#[test]
fn a_rate_that_is_higher_gives_more_alarms_and_not_more_than_it_states() {
    // Often enough to be counted, so that a chart that never raises an alarm does not pass.
    let rate = 20.0;
    let lives = (0..4).map(|seed| live(GRADES[0], Life::Still, 5, 50 + seed, |set| set.false_alarms = rate));
    let count: u32 = lives.map(|(count, _)| count).sum();
    println!("\nat a stated rate of {rate} a day: {count} alarms in 20 days");
    assert!(count > 20, "{count}");
    assert!(count <= most_of_poisson(f64::from(rate) * 20.0), "{count}");
}

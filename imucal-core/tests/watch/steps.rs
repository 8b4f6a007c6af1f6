//! Steps of a bias: how soon they are found, and what is said of them.

use imucal_core::{
    record::Sensor,
    watch::{Compared, TriadState, Watch},
};
use nalgebra::Vector3;

use crate::{
    alarms, first_shift, quantile, rest, settled,
    unit::{GRADES, Grade, Unit},
};

/// Units of each row.
const SEEDS: u64 = 200;
/// Within so many seconds of rest a step must be found.
const SOON: u32 = 60;
/// How far the stated beginning may be from the true one in 90 of 100 cases, s.
const TOLERANCE: i64 = 10;

/// Five standard errors: of the record's bias and of what the sensor does in a run, together.
fn five_errors(grade: &Grade, sensor: usize) -> f32 {
    5.0 * grade.bias[sensor].hypot(grade.instability[sensor])
}

#[test]
fn a_step_of_five_standard_errors_at_rest_is_found_in_a_minute_with_its_time_and_size() {
    println!(
        "\na step of five standard errors while the unit lies still, {SEEDS} units of each kind; seconds of rest"
    );
    println!(
        "  {:<16} {:>6} {:>6} {:>6} {:>7} {:>15} {:>20}",
        "", "median", "95 %", "most", "found", "since, 90 %", "size, 90 %"
    );
    for grade in GRADES {
        for (sensor, kind) in Sensor::ALL.into_iter().enumerate() {
            let (mut delays, mut since, mut sizes) = (vec![], vec![], vec![]);
            let (mut covered, mut of_itself) = (0, 0);
            for seed in 0..SEEDS {
                let (mut unit, mut watch) = settled(grade, 5000 + seed);
                let step = five_errors(&grade, sensor);
                unit.shift[sensor] = unit.direction(sensor) * step;
                let began = i64::from(unit.time);
                let found = (1..=SOON).find(|_| watch.push(&unit.look()));
                delays.push(found.unwrap_or(u32::MAX));
                // What is said once ten more seconds were seen.
                rest(&mut unit, &mut watch, 10);
                let Some((statistic, shift)) = first_shift(&watch) else { continue };
                assert_eq!((statistic.sensor(), watch.summary().state(kind)), (kind, TriadState::Moved));
                of_itself += u32::from(shift.compared == Compared::WithItself);
                since.push(i64::from(shift.since) - began);
                sizes.push(shift.by / step);
                covered += u32::from((shift.by - step).abs() <= 2.0 * shift.error);
            }
            delays.sort_unstable();
            since.sort_unstable();
            sizes.sort_by(f32::total_cmp);
            let soon = delays.iter().filter(|delay| **delay <= SOON).count();
            let ends = (quantile(&since, 0.05), quantile(&since, 0.95));
            println!(
                "  {:<12} {} {:>6} {:>6} {:>6} {:>3}/{SEEDS} {:>6} to {:>4} s {:>11.2} to {:.2}",
                grade.name,
                kind.symbol(),
                quantile(&delays, 0.5),
                quantile(&delays, 0.95),
                quantile(&delays, 1.0),
                soon,
                ends.0,
                ends.1,
                quantile(&sizes, 0.05),
                quantile(&sizes, 0.95)
            );
            assert!(soon as u64 * 20 >= SEEDS * 19, "{} {kind:?}: {soon}", grade.name);
            assert!(ends.0 >= -TOLERANCE && ends.1 <= TOLERANCE, "{ends:?}");
            assert!(u64::from(covered) * 10 >= SEEDS * 9, "{covered} sizes within twice their error");
            // The record chart may be first where the unit was near its limit.
            assert!(u64::from(of_itself) * 10 >= SEEDS * 9, "{of_itself}");
        }
    }
}

/// How a step that nobody saw shows.
#[derive(Clone, Copy, Debug)]
enum Unseen {
    /// Five standard errors on each axis of the bias, whatever the attitude makes of them.
    OfBias,
    /// Five times what the record allows in each attitude: a scale that has changed.
    OfAllowance,
}

/// Seconds of rest until a step that happened on the way is found, in rests of ten seconds; `None`: not in ten minutes.
fn unseen(grade: Grade, sensor: usize, seed: u64, turns: bool, size: Unseen) -> Option<u32> {
    let mut unit = Unit::new(grade, 0.0, seed);
    let mut watch = Watch::new(&grade.record(), unit.settings);
    let pose = unit.pose();
    let put_down = |unit: &mut Unit, watch: &mut Watch, step: bool| {
        unit.time += 10;
        if turns {
            unit.turn(0.0)
        } else {
            unit.take(&pose)
        }
        if step {
            let bias = five_errors(&grade, sensor);
            unit.shift[sensor] = match size {
                Unseen::OfBias => Vector3::repeat(bias),
                Unseen::OfAllowance => unit.direction(sensor) * 5.0 * grade.allowed(sensor),
            };
        }
        (0..10).find(|_| watch.push(&unit.look())).map(|after| after + 1)
    };
    for _ in 0..60 {
        put_down(&mut unit, &mut watch, false);
    }
    if alarms(&watch) > 0 {
        return None;
    }
    (0..60).find_map(|rests| Some(10 * rests + put_down(&mut unit, &mut watch, true)?))
}

#[test]
fn a_step_on_the_way_is_found_where_the_rests_that_follow_show_it() {
    println!("\na step while under way, and rests of 10 s; units in which it is found within so much rest");
    println!("  {:<58} {:>8} {:>8} {:>8}", "", "60 s", "600 s", "median");
    for grade in GRADES {
        for (sensor, kind) in Sensor::ALL.into_iter().enumerate() {
            for (size, turns, words) in [
                (Unseen::OfBias, false, "5 errors of the bias, same attitude"),
                (Unseen::OfBias, true, "5 errors of the bias, other attitudes"),
                (Unseen::OfAllowance, true, "5 of what is allowed, other attitudes"),
            ] {
                let delays = (0..SEEDS).map(|seed| unseen(grade, sensor, 9000 + seed, turns, size));
                let mut delays: Vec<u32> = delays.map(|delay| delay.unwrap_or(u32::MAX)).collect();
                delays.sort_unstable();
                let within = |most: u32| delays.iter().filter(|delay| **delay <= most).count();
                let median = match quantile(&delays, 0.5) {
                    u32::MAX => "–".to_owned(),
                    seconds => format!("{seconds} s"),
                };
                let (minute, ten) = (within(60), within(600));
                println!(
                    "  {:<12} {}, {words:<40} {minute:>4}/{SEEDS} {ten:>4}/{SEEDS} {median:>8}",
                    grade.name,
                    kind.symbol()
                );
                match (kind, size) {
                    (Sensor::Gyroscope, _) => assert!(ten as u64 * 20 >= SEEDS * 19, "{ten}"),
                    (_, Unseen::OfAllowance) => assert!(minute as u64 * 20 >= SEEDS * 19, "{minute}"),
                    // Less than the record allows from pose to pose: nothing is promised.
                    (_, Unseen::OfBias) => {}
                }
            }
        }
    }
}

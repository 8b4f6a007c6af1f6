//! Slow changes: a ramp, and a swing of temperature.

use imucal_core::{
    record::Sensor,
    watch::{TriadState, Watch},
};

use crate::{
    DAY, alarms, first_shift, quantile,
    unit::{GRADES, Unit},
};

const SEEDS: u64 = 20;

#[test]
fn a_ramp_is_found_before_it_is_many_times_what_the_record_allows() {
    println!(
        "\na ramp of what the record allows in a day, unit still; how far it is when it is found, in standard errors of that"
    );
    for grade in GRADES {
        for (sensor, kind) in Sensor::ALL.into_iter().enumerate() {
            let mut sizes: Vec<f32> = (0..SEEDS)
                .map(|seed| {
                    let mut unit = Unit::new(grade, 0.0, 300 + seed);
                    let mut watch = Watch::new(&grade.record(), unit.settings);
                    let along = unit.direction(sensor) * grade.allowed(sensor);
                    while unit.time < 20 * DAY && alarms(&watch) == 0 {
                        unit.shift[sensor] = along * (unit.time as f32 / DAY as f32);
                        watch.push(&unit.look());
                    }
                    let (statistic, _) = first_shift(&watch).expect("a ramp that is never found");
                    assert_eq!(statistic.sensor(), kind);
                    unit.time as f32 / DAY as f32
                })
                .collect();
            sizes.sort_by(f32::total_cmp);
            let [low, middle, high] = [0.05, 0.5, 0.95].map(|share| quantile(&sizes, share));
            println!("  {:<12} {}  {low:.1} to {high:.1}, half by {middle:.1}", grade.name, kind.symbol());
            assert!(high < 10.0, "{high}");
        }
    }
}

#[test]
fn seconds_outside_the_record_s_temperatures_are_counted_and_not_judged() {
    let grade = GRADES[1];
    let mut unit = Unit::new(grade, 0.0, 7);
    unit.settings.span = Some([15.0, 35.0]);
    let mut watch = Watch::new(&grade.record(), unit.settings);
    // Day and night outdoors; a gyroscope that the cold moves by far more than its record allows.
    while unit.time < 3 * DAY {
        let phase = unit.time as f32 / DAY as f32 * std::f32::consts::TAU;
        unit.temperature = 20.0 - 25.0 * phase.sin();
        unit.shift[1].x = if unit.temperature < 15.0 { 1e-4 * (15.0 - unit.temperature) } else { 0.0 };
        watch.push(&unit.look());
    }
    let summary = watch.summary();
    assert_eq!(summary.watched + summary.outside, 3 * DAY);
    assert!(summary.outside > DAY, "{}", summary.outside);
    assert!(Sensor::ALL.into_iter().all(|sensor| summary.state(sensor) == TriadState::Quiet), "{summary:?}");
    let seen = summary.temperature.expect("a thermometer");
    assert!(seen.least < -4.0 && seen.most > 44.0 && seen.changes > DAY, "{seen:?}");
}

#[test]
fn what_the_temperature_moves_within_the_record_s_span_is_found_with_its_temperature() {
    let grade = GRADES[0];
    let mut unit = Unit::new(grade, 0.0, 8);
    let mut watch = Watch::new(&grade.record(), unit.settings);
    while unit.time < DAY {
        unit.temperature = 20.0 + 20.0 * (unit.time as f32 / DAY as f32);
        unit.shift[1].z = 5e-5 * (unit.temperature - 20.0);
        watch.push(&unit.look());
    }
    let shift = watch.summary().shifts(Sensor::Gyroscope).next().expect("1e-3 rad/s").1;
    assert!(
        shift.temperature.is_some_and(|temperature| temperature > 25.0 && temperature < 42.0),
        "{shift:?}"
    );
}

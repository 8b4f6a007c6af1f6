//! What no healthy unit sends: no rest, no numbers, a clock that jumps, sensors that are stuck.

use imucal_core::{
    record::{CalibrationRecord, Sensor},
    watch::{
        CalibratedSample, GRAVITY_ANYWHERE, Look, LookObserver, Mean, Statistic, TriadState, Watch,
        WatchSettings,
    },
};
use nalgebra::Vector3;
use proptest::prelude::*;

use crate::{
    DAY, alarms, first_shift, rest, settled,
    unit::{GRADES, Unit},
};

#[test]
fn a_watch_that_has_seen_no_rest_says_so_and_not_that_all_is_well() {
    let summary = Watch::new(&GRADES[0].record(), WatchSettings::default()).summary();
    assert_eq!((summary.watched, summary.rests), (0, 0));
    for sensor in Sensor::ALL {
        assert_eq!(summary.state(sensor), TriadState::Unseen);
    }
}

#[test]
fn a_triad_that_the_record_lacks_is_unseen_and_the_others_are_watched() {
    let record = CalibrationRecord { gyr: None, ..GRADES[0].record() };
    let mut unit = Unit::new(GRADES[0], 0.0, 1);
    let mut watch = Watch::new(&record, unit.settings);
    rest(&mut unit, &mut watch, 600);
    let states = Sensor::ALL.map(|sensor| watch.summary().state(sensor));
    assert_eq!(states, [TriadState::Quiet, TriadState::Unseen, TriadState::Quiet]);
}

#[test]
fn a_move_counts_from_the_first_second_that_is_judged() {
    // Put down in another pose while a triad has no value, or at a temperature outside of the span.
    let missed = |look: Look| Look { mag: None, ..look };
    let warm = |look: Look| Look { temperature: 41.0, ..look };
    let (mut found, units) = ([0u32; 3], 20u64);
    let ways: [&dyn Fn(Look) -> Look; 3] = [&|look| look, &missed, &warm];
    for seed in 0..units {
        for (way, found) in ways.iter().zip(&mut found) {
            let mut unit = Unit::new(GRADES[0], 0.0, seed);
            let settings =
                WatchSettings { place: 0.05, span: Some([15.0, 40.0]), dip: None, ..unit.settings };
            let mut watch = Watch::new(&GRADES[0].record(), settings);
            rest(&mut unit, &mut watch, 600);
            unit.turn(0.01);
            let first = unit.look();
            watch.push(&way(first));
            rest(&mut unit, &mut watch, 30);
            *found += u32::from(alarms(&watch) > 0);
        }
    }
    assert_eq!(found, [0; 3], "alarms of {units} units");
}

#[test]
fn gravity_of_another_place_is_no_shift_where_the_place_is_not_known() {
    let watched = |gravity_error| {
        let mut unit = Unit::new(GRADES[0], 0.0, 3);
        let settings =
            WatchSettings { gravity: unit.settings.gravity + 0.02, gravity_error, ..unit.settings };
        let mut watch = Watch::new(&GRADES[0].record(), settings);
        for _ in 0..20 {
            rest(&mut unit, &mut watch, 30);
            unit.turn(0.0);
        }
        watch.summary().state(Sensor::Accelerometer)
    };
    assert_eq!(watched(GRAVITY_ANYWHERE), TriadState::Quiet);
    assert_eq!(watched(0.0), TriadState::Moved);
}

#[test]
fn a_sensor_that_is_stuck_is_said_to_be_and_nothing_is_judged_by_it() {
    let (mut unit, mut watch) = settled(GRADES[0], 4);
    for _ in 0..2000 {
        let mut look = unit.look();
        look.gyr = Some(Mean { value: Vector3::new(0.01, 0.0, 0.0), variance: Vector3::zeros() });
        watch.push(&look);
    }
    let summary = watch.summary();
    assert!(summary.stuck[1] > 1900, "{:?}", summary.stuck);
    assert!(summary.statistic(Statistic::RateX).looks < 700);
    assert_eq!(summary.state(Sensor::Accelerometer), TriadState::Quiet);
    assert_ne!(summary.state(Sensor::Gyroscope), TriadState::Quiet);
}

#[test]
fn a_thermometer_that_is_stuck_hides_nothing_and_is_seen() {
    let (mut unit, mut watch) = settled(GRADES[0], 5);
    unit.shift[1].x = 3e-3;
    rest(&mut unit, &mut watch, 3600);
    let summary = watch.summary();
    assert_eq!(summary.state(Sensor::Gyroscope), TriadState::Moved);
    assert_eq!(summary.temperature.expect("readings").changes, 0);
}

#[test]
fn a_clock_that_is_set_back_or_jumps_ahead_raises_no_alarm() {
    let (mut unit, mut watch) = settled(GRADES[0], 6);
    for jump in 0..40u32 {
        unit.time = if jump % 2 == 0 { unit.time / 2 } else { unit.time + 40 * DAY };
        rest(&mut unit, &mut watch, 300);
    }
    assert_eq!((first_shift(&watch), watch.summary().clock_jumps), (None, 20));
}

#[test]
fn after_a_start_the_minutes_before_expect_nothing_and_the_findings_stay() {
    let (mut unit, mut watch) = settled(GRADES[1], 9);
    watch.restart();
    // The bias at the start differs from that of the run before, within what the record allows.
    unit.shift[1] = Vector3::repeat(1.5e-4);
    rest(&mut unit, &mut watch, 600);
    assert_eq!(alarms(&watch), 0);
    unit.shift[1] = Vector3::repeat(6e-3);
    rest(&mut unit, &mut watch, 60);
    let found = first_shift(&watch);
    watch.restart();
    assert!(found.is_some() && found == first_shift(&watch));
}

#[test]
fn a_watch_can_be_kept_and_gone_on_with() {
    let (mut unit, mut watch) = settled(GRADES[0], 10);
    let mut kept = watch.clone();
    unit.shift[0] = unit.direction(0) * 0.01;
    for _ in 0..200 {
        let look = unit.look();
        assert_eq!(watch.push(&look), kept.push(&look));
    }
    assert_eq!(watch.summary(), kept.summary());
}

/// Samples at 50 Hz.
fn samples(count: u64) -> impl Iterator<Item = CalibratedSample> {
    (0..count).map(|k| CalibratedSample {
        time: k * 20_000,
        acc: Vector3::new(0.0, 0.0, 9.81 + (k % 7) as f32 * 1e-3),
        gyr: Some(Vector3::zeros()),
        mag: (k % 5 == 0).then(|| Vector3::new(20.0, 0.0, 44.0)),
        temperature: 25.0,
    })
}

#[test]
fn a_second_counts_once_the_next_was_still_too() {
    let mut observer = LookObserver::default();
    let looks: Vec<_> = samples(500)
        .filter_map(|sample| observer.push(&sample, !(200..250).contains(&(sample.time / 20_000))))
        .collect();
    // Seconds 0 and 1, since 2 and 3 precede a motion in part; then 5 to 7: the second before the end waits for its next.
    let times: Vec<_> = looks.iter().map(|look| (look.time, look.moved)).collect();
    assert_eq!(times, [(0, true), (1, false), (5, true), (6, false), (7, false)]);
    assert!(looks[0].mag.is_some_and(|mag| (mag.value - Vector3::new(20.0, 0.0, 44.0)).norm() < 1e-4));
    assert!((looks[0].temperature - 25.0).abs() < 1e-5);
}

#[test]
fn a_gap_and_a_clock_set_back_begin_another_rest() {
    let mut observer = LookObserver::default();
    let gap = |sample: CalibratedSample| CalibratedSample {
        time: if sample.time < 3_000_000 { sample.time } else { sample.time + 5_000_000 },
        ..sample
    };
    let moved = samples(400).filter_map(|sample| observer.push(&gap(sample), true)).filter(|look| look.moved);
    assert_eq!(moved.count(), 2);
    let back = samples(200).filter_map(|sample| observer.push(&sample, true)).filter(|look| look.moved);
    assert_eq!(back.count(), 1);
}

#[test]
fn what_came_back_is_not_found_again_from_what_it_showed_before() {
    let (mut unit, mut watch) = settled(GRADES[0], 11);
    // A few seconds in which every sensor gives zero, and one rate is wild; they have no noise, so that they count at once.
    let mean = Mean { value: Vector3::zeros(), variance: Vector3::zeros() };
    let zero = Look { time: 0, acc: mean, gyr: Some(mean), mag: Some(mean), temperature: 0.0, moved: false };
    let rate = |y| Look { gyr: Some(Mean { value: Vector3::new(0.0, y, 0.0), ..mean }), ..zero };
    for look in [zero, zero, rate(-4.195_399_3e36), rate(-0.004_330_285_4), zero, zero] {
        watch.push(&look);
    }
    watch.restart();
    assert!(first_shift(&watch).is_some());
    rest(&mut unit, &mut watch, 600);
    assert_eq!((first_shift(&watch), alarms(&watch)), (None, 1));
    rest(&mut unit, &mut watch, 3600);
    assert_eq!((first_shift(&watch), alarms(&watch)), (None, 1));
}

proptest! {
    #[test]
    fn whatever_is_pushed_the_sums_stay_finite_and_a_healthy_unit_recovers(
        wild in prop::collection::vec((any::<[f32; 9]>(), any::<[f32; 2]>(), any::<u32>(), any::<bool>()), 1..40),
    ) {
        let (mut unit, mut watch) = settled(GRADES[0], 11);
        for (values, [variance, temperature], time, moved) in wild {
            let [a, b, c, d, e, f, g, h, i] = values;
            let mean = |value| Mean { value, variance: Vector3::repeat(variance) };
            let (gyr, mag) = (Some(mean(Vector3::new(d, e, f))), Some(mean(Vector3::new(g, h, i))));
            let acc = mean(Vector3::new(a, b, c));
            watch.push(&Look { time, acc, gyr, mag, temperature, moved });
        }
        for statistic in watch.summary().statistics {
            for figure in [statistic.step, statistic.record].concat() {
                prop_assert!(figure.is_finite(), "{statistic:?}");
            }
        }
        watch.restart();
        rest(&mut unit, &mut watch, 600);
        let before = alarms(&watch);
        rest(&mut unit, &mut watch, 3600);
        prop_assert_eq!(alarms(&watch), before);
    }
}

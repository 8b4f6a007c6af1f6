//! What comes and goes: a magnet, a knock; and a drift that one sensor has and another shows.

use imucal_core::{
    record::Sensor,
    watch::{Statistic, TriadState, Watch},
};
use nalgebra::Vector3;

use crate::{
    first_shift, quantile, rest, settled,
    unit::{GRADES, Unit},
};

const SEEDS: u64 = 40;

#[test]
fn a_magnet_that_passes_is_a_disturbance_and_no_drift_of_the_magnetometer() {
    let (mut back, mut seen) = (0, 0);
    for seed in 0..SEEDS {
        let (mut unit, mut watch) = settled(GRADES[0], 40 + seed);
        let began = unit.time;
        // It comes within half a minute, stays for two, and goes.
        for second in 0..180i16 {
            let near = f32::from(second.min(180 - second).min(30)) / 30.0;
            unit.shift[2] = Vector3::new(3.0, -2.0, 4.0) * near;
            watch.push(&unit.look());
        }
        seen += u32::from(watch.summary().statistic(Statistic::Field).alarms > 0);
        unit.shift[2] = Vector3::zeros();
        rest(&mut unit, &mut watch, 600);
        let summary = watch.summary();
        let spell = summary.statistic(Statistic::Field).spell;
        back += u32::from(summary.state(Sensor::Magnetometer) == TriadState::Quiet && spell.is_some());
        assert_eq!(summary.state(Sensor::Gyroscope), TriadState::Quiet);
        if let Some(spell) = spell {
            assert!(
                spell.from.abs_diff(began) < 60 && spell.to.abs_diff(began + 180) < 60,
                "{began} {spell:?}"
            );
        }
    }
    println!(
        "\na magnet near for three minutes: seen in {seen} of {SEEDS} units, reported as over in {back}"
    );
    assert!(u64::from(seen) == SEEDS && u64::from(back) * 20 >= SEEDS * 19, "{seen} {back}");
}

#[test]
fn a_magnet_that_stays_is_said_to_have_moved_the_magnetometer_alone() {
    for seed in 0..SEEDS {
        let (mut unit, mut watch) = settled(GRADES[1], 80 + seed);
        unit.shift[2] = Vector3::new(3.0, -2.0, 4.0);
        rest(&mut unit, &mut watch, 3600);
        let summary = watch.summary();
        assert_eq!(summary.state(Sensor::Magnetometer), TriadState::Moved);
        assert_eq!(summary.state(Sensor::Accelerometer), TriadState::Quiet);
        assert_eq!(summary.state(Sensor::Gyroscope), TriadState::Quiet);
    }
}

/// Puts a unit whose shift is `carried` down in so many attitudes one after another.
fn carry_about(unit: &mut Unit, watch: &mut Watch, poses: u32, carried: Vector3<f32>) {
    unit.shift[2] = carried;
    for _ in 0..poses {
        unit.turn(0.0);
        rest(unit, watch, 20);
    }
}

#[test]
fn a_magnet_that_goes_while_the_unit_is_carried_is_over_once_the_poses_after_it_show_it() {
    let (mut seen, mut over, mut kept, mut poses) = (0_u32, 0_u32, 0, Vec::new());
    for seed in 0..SEEDS {
        let (mut unit, mut watch) = settled(GRADES[0], 160 + seed);
        let magnet = Vector3::new(15.0, -10.0, 20.0);
        unit.shift[2] = magnet;
        rest(&mut unit, &mut watch, 60);
        if watch.summary().state(Sensor::Magnetometer) != TriadState::Moved {
            // Across the field and the vertical: neither length nor dip shows it.
            continue;
        }
        seen += 1;
        // Where it stays on the unit, the poses excuse nothing.
        let (mut marked, mut watched) = (unit.clone(), watch.clone());
        carry_about(&mut marked, &mut watched, 30, magnet);
        kept += u32::from(watched.summary().state(Sensor::Magnetometer) == TriadState::Moved);

        let went = unit.time;
        let taken = (1..=30).find(|_| {
            carry_about(&mut unit, &mut watch, 1, Vector3::zeros());
            watch.summary().state(Sensor::Magnetometer) == TriadState::Quiet
        });
        let Some(taken) = taken else { continue };
        (over, _) = (over + 1, poses.push(taken));
        let summary = watch.summary();
        let ends = [Statistic::Field, Statistic::Dip].map(|statistic| summary.statistic(statistic).spell);
        assert!(ends.into_iter().flatten().all(|spell| spell.to >= went), "{went} {ends:?}");
    }
    poses.sort_unstable();
    let (half, most) = (quantile(&poses, 0.5), poses.last().unwrap());
    println!(
        "\na magnet that goes while the unit is carried: over in {over} of {seen} units, in the median after {half} poses, \
         at most after {most}\na magnet that stays on the unit: over in {} of {seen} after 30 poses",
        seen - kept
    );
    assert!(u64::from(seen) * 4 >= SEEDS * 3, "{seen}");
    assert!(over * 20 >= seen * 19 && kept == seen, "{seen} {over} {kept}");
}

#[test]
fn a_second_that_is_wild_raises_no_alarm() {
    let (mut unit, mut watch) = settled(GRADES[0], 3);
    for _ in 0..50 {
        unit.shift = [Vector3::repeat(0.3), Vector3::repeat(0.02), Vector3::repeat(40.0)];
        rest(&mut unit, &mut watch, 1);
        unit.shift = [Vector3::zeros(); 3];
        rest(&mut unit, &mut watch, 120);
    }
    assert_eq!(first_shift(&watch), None);
}

#[test]
fn an_accelerometer_that_moves_does_not_accuse_the_magnetometer_of_a_dip() {
    for seed in 0..SEEDS {
        let (mut unit, mut watch) = settled(GRADES[0], 120 + seed);
        // A third of a metre per second squared tilts what is seen of the vertical by two degrees.
        unit.shift[0] = Vector3::repeat(0.3);
        rest(&mut unit, &mut watch, 600);
        let summary = watch.summary();
        if summary.statistic(Statistic::Force).shift.is_none() {
            // Nearly across gravity: the length hardly shows it.
            continue;
        }
        assert_eq!(summary.state(Sensor::Accelerometer), TriadState::Moved);
        assert_eq!(summary.state(Sensor::Magnetometer), TriadState::Quiet, "{summary:?}");
    }
}

use super::*;
use crate::simulator::truth::Motion;

fn quiet(kind: RobotKind) -> RobotScene {
    RobotScene { kind, duration: 60.0, noise: false, counts: false, ..RobotScene::default() }
}

fn values(recording: &Recording, kind: SensorKind) -> &[Vector3<f64>] {
    &recording.sensor(kind).unwrap().values
}

#[test]
fn an_ideal_stream_at_rest_is_gravity_the_field_and_earth_s_rotation() {
    for kind in RobotKind::ALL {
        let scene = quiet(kind);
        let simulated = scene.simulated("sim.csv").unwrap();
        let values = simulated.simulated.unwrap();
        let first = |column: &Option<Vec<Vector3<f64>>>| column.as_ref().unwrap()[..200].to_vec();
        for ((f, w), b) in first(&values.acc).iter().zip(first(&values.gyr)).zip(first(&values.mag)) {
            // A wheeled one stands as the ground does.
            assert!((f.norm() - scene.place.gravity).abs() < 1e-12 && f.z < -9.7, "{kind:?}");
            assert_eq!(f, &first(&values.acc)[0]);
            assert!((w.norm() - scene.place.earth_rate_n().norm()).abs() < 1e-15, "{kind:?}");
            assert!((b.norm() - scene.place.field_n.norm()).abs() < 1e-12, "{kind:?}");
        }
    }
}

#[test]
fn without_noise_a_recording_is_the_ideal_stream_on_another_clock_and_mount() {
    for kind in RobotKind::ALL {
        let scene = RobotScene {
            mounting: Vector3::new(0.02, -0.01, 0.015),
            clock_offset: 0.035,
            clock_rate_error: 2e-4,
            real_rate: 100.0,
            ..quiet(kind)
        };
        let real = scene.real("real.csv").unwrap();
        let (motion, unit) = (scene.planned().unwrap(), scene.unit_under_test());
        for (row, time) in real.time.iter().enumerate() {
            let truth = motion.truth((time + 0.035) / (1.0 + 2e-4), &|_| ());
            for (of, ideal) in SensorKind::ALL.into_iter().zip([truth.f_t, truth.w_it_t, truth.b_t]) {
                let turned = rotation::exp(&-scene.mounting) * ideal;
                let expected = unit.triad(of).triad.predict(&turned).unwrap();
                assert!((values(&real, of)[row] - expected).norm() < 1e-10, "{kind:?} {time}");
            }
        }
    }
}

#[test]
fn another_motion_changes_its_stretches_and_not_a_bit_outside_of_them() {
    for kind in RobotKind::ALL {
        for what in MismatchKind::ALL {
            let same = RobotScene { duration: 150.0, clock_offset: -0.02, ..quiet(kind) };
            let scene = RobotScene { mismatch: Some((what, 1.0)), ..same.clone() };
            let stretches = scene.moved().unwrap().mismatch.stretches;
            assert!(!stretches.is_empty(), "{kind:?} {what:?}");
            assert_eq!(scene.simulated("sim.csv").unwrap(), same.simulated("sim.csv").unwrap());
            let (with, without) = (scene.real("real.csv").unwrap(), same.real("real.csv").unwrap());
            let mut changed = 0;
            for (row, time) in with.time.iter().enumerate() {
                let shown = scene.shown(*time);
                let inside = stretches.iter().any(|s| s.span.0 < shown && shown < s.span.1);
                for of in SensorKind::ALL {
                    let alike = values(&with, of)[row] == values(&without, of)[row];
                    assert!(inside || alike, "{kind:?} {what:?} {time}");
                    changed += usize::from(!alike);
                }
            }
            assert!(changed > 10, "{kind:?} {what:?} {changed}");
        }
    }
}

#[test]
fn of_another_motion_too_the_rate_is_that_at_which_the_field_turns() {
    let h = 1e-5;
    for kind in RobotKind::ALL {
        let scene = RobotScene { mismatch: Some((MismatchKind::Slip, 1.0)), duration: 150.0, ..quiet(kind) };
        let motion = scene.moved().unwrap();
        for stretch in &motion.mismatch.stretches {
            for k in 1..50 {
                let t = stretch.span.0 + 0.02 * f64::from(k) * (stretch.span.1 - stretch.span.0);
                let at = |t| motion.truth(t, &|_| ());
                let (before, here, after) = (at(t - h), at(t), at(t + h));
                let numeric = (after.b_t - before.b_t) / (2.0 * h);
                assert!((numeric + here.w_pt_t.cross(&here.b_t)).norm() < 1e-5, "{kind:?} {t}");
            }
        }
    }
}

#[test]
fn a_seed_gives_one_pair() {
    let scene = RobotScene { duration: 40.0, dropped: 0.02, ..RobotScene::default() };
    assert_eq!(scene.record("pair").unwrap(), scene.record("pair").unwrap());
    let other = RobotScene { seed: 2, ..scene.clone() };
    assert_ne!(scene.record("pair").unwrap(), other.record("pair").unwrap());
}

#[test]
fn another_recording_of_a_unit_moves_and_scatters_otherwise() {
    let scene = RobotScene { duration: 40.0, seed: 7, ..RobotScene::default() };
    let again = scene.again();
    assert_eq!(again.unit_under_test(), scene.unit_under_test());
    assert_eq!(again.again().unit_under_test(), scene.unit_under_test());
    assert_ne!(again.record("pair").unwrap(), scene.record("pair").unwrap());
}

#[test]
fn lost_rows_are_not_there_and_the_others_are_what_they_were() {
    let whole = RobotScene { duration: 50.0, ..RobotScene::default() };
    let holed = RobotScene { dropped: 0.05, ..whole.clone() };
    let (whole, holed) = (whole.real("real.csv").unwrap(), holed.real("real.csv").unwrap());
    let lost = whole.rows() - holed.rows();
    assert!((350..650).contains(&lost), "{lost}");
    let mut at = 0;
    for (row, time) in holed.time.iter().enumerate() {
        while whole.time[at] < *time {
            at += 1;
        }
        assert_eq!(whole.time[at], *time);
        for of in SensorKind::ALL {
            assert_eq!(values(&holed, of)[row], values(&whole, of)[at]);
        }
    }
}

#[test]
fn what_cannot_be_simulated_is_refused() {
    let scene = RobotScene::default();
    let refused = |scene: RobotScene| scene.record("pair").unwrap_err();
    assert!(matches!(refused(RobotScene { sim_rate: 3.0, ..scene.clone() }), SimulationError::Rate { .. }));
    let short = RobotScene { duration: 10.0, ..scene.clone() };
    assert!(matches!(refused(short), SimulationError::TooShort { .. }));
    assert!(matches!(refused(RobotScene { duration: 1e5, ..scene }), SimulationError::TooLong { .. }));
}

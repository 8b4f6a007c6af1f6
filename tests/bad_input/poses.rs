//! A reference's attitudes and positions that hold something else than they should: each is refused, or reported and put right.

use std::sync::OnceLock;

use imucal_host::{
    diagnosis::{Diagnosis, Options, Verdict, diagnose},
    recording::{
        Recording,
        manifest::{Rig, RigKind},
    },
    simulator::{
        Motion,
        robot::{RobotKind, RobotScene},
    },
};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// A flying robot that a tracker follows, attitude and position, with a noise of its own.
fn tracked() -> &'static Recording {
    static TRACKED: OnceLock<Recording> = OnceLock::new();
    TRACKED.get_or_init(|| {
        let scene =
            RobotScene { kind: RobotKind::Flying, duration: 60.0, real_rate: 100.0, ..RobotScene::default() };
        let mut recording = scene.real("flight.csv").expect("a scene");
        let motion = scene.moved().expect("a scene");
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut tremble = |size: f64| {
            let normal = Normal::new(0.0, size).expect("a size");
            Vector3::from_fn(|_, _| normal.sample(&mut random))
        };
        let truth: Vec<_> = recording.time.iter().map(|time| motion.truth(*time, &|_| ())).collect();
        let attitude = |c: &Matrix3<f64>, by: Vector3<f64>| {
            let q = UnitQuaternion::from_matrix(c) * UnitQuaternion::from_scaled_axis(by);
            [q.w, q.i, q.j, q.k]
        };
        recording.reference =
            Some(truth.iter().map(|row| attitude(&(row.c_p_n * row.c_t_p), tremble(2e-4))).collect());
        // The way, by integration of what an ideal accelerometer senses.
        let (mut speed, mut place) = (Vector3::zeros(), Vector3::zeros());
        let gravity = Vector3::z() * scene.place.gravity;
        let positions = truth.iter().map(|row| {
            speed += (row.c_p_n * row.c_t_p * row.f_t + gravity) * 0.01;
            place += speed * 0.01;
            <[f64; 3]>::from(place + tremble(2e-4))
        });
        recording.position = Some(positions.collect());
        recording.manifest.rig = Some(Rig { kind: RigKind::Optical, axes: None });
        recording
    })
}

fn diagnosed(spoil: impl Fn(&mut Recording)) -> Diagnosis {
    let mut recording = tracked().clone();
    spoil(&mut recording);
    diagnose(&recording, &Options::default(), &|_| ())
}

/// Quaternions, one after the other.
fn each(recording: &mut Recording, change: impl Fn(Quaternion<f64>) -> Quaternion<f64>) {
    for row in recording.reference.iter_mut().flatten() {
        let q = change(Quaternion::new(row[0], row[1], row[2], row[3]));
        *row = [q.w, q.i, q.j, q.k];
    }
}

/// Attitudes and positions in another frame.
fn turned(recording: &mut Recording, turn: &UnitQuaternion<f64>) {
    each(recording, |q| turn.quaternion() * q);
    recording.position.iter_mut().flatten().for_each(|p| *p = (turn * Vector3::from(*p)).into());
}

fn names(diagnosis: &Diagnosis) -> Vec<&str> {
    diagnosis.causes.iter().map(|cause| cause.effect.as_str()).collect()
}

#[track_caller]
fn assert_reported(diagnosis: &Diagnosis, words: &[&str]) {
    let has_all = |remark: &String| words.iter().all(|word| remark.contains(word));
    assert!(diagnosis.remarks.iter().any(has_all), "{words:?} in {:?}", diagnosis.remarks);
}

#[test]
fn the_pose_that_the_others_are_made_of_is_good() {
    let diagnosis = diagnosed(|_| ());
    let of_reference = |id: &&str| id.starts_with("ref.");
    assert!(!names(&diagnosis).iter().any(of_reference), "{:?} {:?}", names(&diagnosis), diagnosis.remarks);
    assert_ne!(diagnosis.verdict, Verdict::NotTestable, "{:?}", diagnosis.remarks);
}

#[test]
fn a_frame_with_z_or_y_up_is_turned() {
    let plain = diagnosed(|_| ());
    for (axis, angle, words) in [
        (Vector3::x_axis(), std::f64::consts::PI, "+z up"),
        (Vector3::x_axis(), std::f64::consts::FRAC_PI_2, "y up"),
    ] {
        let turn = UnitQuaternion::from_axis_angle(&axis, angle);
        let diagnosis = diagnosed(|recording| turned(recording, &turn));
        assert_reported(&diagnosis, &[words, "where z down was expected"]);
        assert_eq!(names(&diagnosis), names(&plain));
    }
}

#[test]
fn inverse_and_reordered_quaternions_are_refused() {
    let inverse = diagnosed(|recording| each(recording, |q| q.conjugate()));
    let last = diagnosed(|recording| each(recording, |q| Quaternion::new(q.i, q.j, q.k, q.w)));
    for (diagnosis, words) in [(inverse, "inverse"), (last, "in the order x, y, z, w")] {
        assert_eq!(diagnosis.verdict, Verdict::NotTestable, "{:?}", names(&diagnosis));
        assert_reported(&diagnosis, &["the reference attitudes are", words]);
    }
}

#[test]
fn positions_in_another_unit_are_refused_and_jumps_and_steps_reported() {
    let position = |change: fn(usize, f64) -> f64| {
        diagnosed(|recording| {
            for (row, p) in recording.position.iter_mut().flatten().enumerate() {
                *p = p.map(|value| change(row, value));
            }
        })
    };
    let millimetres = position(|_, value| 1e3 * value);
    assert_eq!(millimetres.verdict, Verdict::NotTestable);
    assert_reported(&millimetres, &["looks like millimetres", "write ref_p* in metres"]);
    assert_reported(
        &position(|row, value| if row > 3000 { value + 0.4 } else { value }),
        &["jumps 1 times", "30.01 s"],
    );
    assert_reported(&position(|_, value| (100.0 * value).round() / 100.0), &["steps of 10.0 mm"]);
}

#[test]
fn a_reference_that_is_slower_than_the_rows_is_filled_in() {
    let diagnosis = diagnosed(|recording| {
        for row in (0..recording.rows()).filter(|row| row % 3 != 0) {
            recording.reference.iter_mut().for_each(|rows| rows[row] = [f64::NAN; 4]);
            recording.position.iter_mut().for_each(|rows| rows[row] = [f64::NAN; 3]);
        }
    });
    assert_reported(&diagnosis, &["33 attitudes a second", "are interpolated"]);
    assert_ne!(diagnosis.verdict, Verdict::NotTestable);
}

#[test]
fn a_reference_that_trembles_more_than_it_says_is_named() {
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let normal = Normal::new(0.0, 1.0).expect("a size");
    let noise: Vec<Vector3<f64>> =
        (0..tracked().rows()).map(|_| Vector3::from_fn(|_, _| normal.sample(&mut random))).collect();
    let attitude = diagnosed(|recording| {
        for (row, by) in recording.reference.iter_mut().flatten().zip(&noise) {
            let q = UnitQuaternion::from_quaternion(Quaternion::new(row[0], row[1], row[2], row[3]))
                * UnitQuaternion::from_scaled_axis(by * 0.004);
            *row = [q.w, q.i, q.j, q.k];
        }
    });
    let position = diagnosed(|recording| {
        for (row, by) in recording.position.iter_mut().flatten().zip(&noise) {
            *row = (Vector3::from(*row) + by * 0.01).into();
        }
    });
    for (diagnosis, id, truth) in
        [(attitude, "ref.attitude_noise", 0.004), (position, "ref.position_noise", 0.01)]
    {
        let cause = diagnosis.causes.iter().find(|cause| cause.effect == id);
        let cause = cause.unwrap_or_else(|| panic!("{id} is not among {:?}", names(&diagnosis)));
        let sigma = cause.parameters[0].value.expect("known");
        assert!((sigma / truth - 1.0).abs() < 0.05, "{id}: {sigma}");
        assert!(diagnosis.verdict != Verdict::None && diagnosis.verdict != Verdict::NotTestable);
    }
}

#[test]
fn a_mount_that_slips_is_named_with_its_turn_and_instant() {
    let turn = Vector3::new(0.02, -0.03, 0.015);
    let diagnosis = diagnosed(|recording| {
        let slip = UnitQuaternion::from_scaled_axis(turn);
        for row in recording.reference.iter_mut().flatten().skip(2500) {
            let q = UnitQuaternion::from_quaternion(Quaternion::new(row[0], row[1], row[2], row[3])) * slip;
            *row = [q.w, q.i, q.j, q.k];
        }
    });
    let cause = diagnosis.causes.iter().find(|cause| cause.effect == "ref.mount_slip");
    let cause = cause.unwrap_or_else(|| panic!("{:?} {:?}", names(&diagnosis), diagnosis.remarks));
    let value = |at: usize| cause.parameters[at].value.expect("known");
    // The reference slips one way, the sensor stands the other way against it.
    for axis in 0..3 {
        assert!((value(axis) + turn[axis]).abs() < 3e-3, "{axis}: {}", value(axis));
    }
    assert!((value(3) - 25.0).abs() < 0.2, "{}", value(3));
}

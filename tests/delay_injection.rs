//! A delay that is put between the sensor and its reference is reported with its sign and size, from 2 ms to 50 ms, along a
//! real optical reference and with a robot's simulator.

use imucal_host::{
    diagnosis::{Diagnosis, Options, diagnose},
    observe::motion,
    recording::{Recording, Stream},
    simulator::robot::{RobotKind, RobotScene},
};
use imucal_tests::data;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion};
use rayon::prelude::*;

/// s.
const DELAYS: [f64; 4] = [-0.05, -0.002, 0.005, 0.02];

/// The clock's offset and its standard error, s; `None` where it is not named.
fn offset(diagnosis: &Diagnosis) -> Option<(f64, f64)> {
    let cause = diagnosis.causes.iter().find(|cause| cause.effect == "clk.time_offset")?;
    let amount = cause.parameters.first()?;
    amount.value.zip(amount.std_error)
}

/// Within three standard errors, and within a tenth or 0.2 ms.
#[track_caller]
fn assert_reported(diagnosis: &Diagnosis, delay: f64, error_of_zero: f64) {
    let (found, error) =
        offset(diagnosis).unwrap_or_else(|| panic!("{delay}: not named, {:?}", diagnosis.remarks));
    let apart = (found - delay).abs();
    println!("{:6.1} ms: {:8.3} ± {:.3} ms", 1e3 * delay, 1e3 * found, 1e3 * error);
    assert!(apart < 3.0 * error.hypot(error_of_zero), "{delay}: {found} ± {error}");
    assert!(apart < f64::max(0.1 * delay.abs(), 2e-4), "{delay}: {found}");
}

/// With the reference's row of t showing what was at t − `delay`.
fn late(recording: &Recording, delay: f64) -> Recording {
    let attitudes = motion::of_reference(recording.reference.as_ref().expect("attitudes"));
    let quaternion = |attitude: &Option<Matrix3<f64>>| {
        let none = Quaternion::new(f64::NAN, f64::NAN, f64::NAN, f64::NAN);
        let q = attitude.map_or(none, |c| *UnitQuaternion::from_matrix(&c).quaternion());
        [q.w, q.i, q.j, q.k]
    };
    let later = motion::later(&recording.time, &attitudes, delay);
    Recording { reference: Some(later.iter().map(quaternion).collect()), ..recording.clone() }
}

#[test]
fn a_delay_of_an_optical_reference_is_reported() {
    let Some(path) = data::real("broad-02-rotation.csv.gz") else { return };
    let mut recording = Recording::read(&path).expect("a good recording");
    recording.position = None;
    let diagnosed = |recording: &Recording| diagnose(recording, &Options::default(), &|_| ());
    // The cameras have a delay of their own, which is taken out first.
    let (own, error) = offset(&diagnosed(&recording)).expect("the cameras' own delay is named");
    DELAYS.par_iter().for_each(|delay| {
        assert_reported(&diagnosed(&late(&recording, delay - own)), *delay, error);
    });
}

#[test]
fn a_delay_of_a_simulator_s_stream_is_reported() {
    let scene =
        RobotScene { kind: RobotKind::Wheeled, duration: 60.0, real_rate: 100.0, ..RobotScene::default() };
    let pair = scene.record("drive").expect("a scene");
    DELAYS.par_iter().for_each(|delay| {
        let mut stream = Stream::of_pair(&pair.simulated, &pair.real).expect("a stream");
        // The row of t then shows the stream of t + delay.
        stream.time.iter_mut().for_each(|time| *time += delay);
        let options = Options { stream: Some(stream), ..Options::default() };
        assert_reported(&diagnose(&pair.real, &options, &|_| ()), *delay, 0.0);
    });
}

//! Sessions in which the sensor warms and cools.

use imucal_core::{
    link::{CaptureOutcome, Reply, Request},
    record,
    session::axes::Axes,
};

use crate::{
    bench::{Bench, BenchMemory, Counting, SERIAL},
    capture::{fault, finish, outcomes, send, session_of, state_of, task, tumble},
    nor::Nor,
};

#[test]
fn a_session_that_warms_and_cools_ends_in_the_terms_that_it_gives_elsewhere() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    let mut samples = tumble(36);
    let rows = samples.len();
    for (row, sample) in samples.iter_mut().enumerate() {
        // Warm and cold three times, so that each direction is seen at several temperatures.
        let warmer = 18.0 * (3.0 * std::f32::consts::PI * row as f32 / rows as f32).sin().abs();
        sample.temperature = 20.0 + warmer;
        sample.raw[0] = sample.raw[0].map(|[x, y, z]| [x + 4e-3 * warmer, y - 3e-3 * warmer, z]);
    }
    state_of(&mut bench, &Request::StartCapture(task()));
    send(&mut bench, &samples);
    assert_eq!(bench.ask(&finish(), outcomes)[0], CaptureOutcome::Adopted);
    let store = Request::Store { replace: false };
    assert_eq!(bench.ask(&store, fault), None);
    let there = bench.ask(&Request::GetRecord, |reply| match reply {
        Reply::Record(bytes) => record::decode(bytes).expect("whole"),
        other => panic!("{other:?}"),
    });
    let session = session_of(&samples);
    let units = task().sensors[0].units(record::Sensor::Accelerometer);
    let none = None::<&record::TriadRecord>;
    let here = session.better_at_temperatures(record::Sensor::Accelerometer, &units, none, &Axes::Own);
    assert_eq!(there.acc, Some(here.expect("accepted")));
    let [x, y, z] = there.acc.and_then(|acc| acc.temperature).expect("terms").bias_slope;
    assert!((x - 4e-3).abs() < 1e-3 && (y + 3e-3).abs() < 1e-3 && z.abs() < 1e-3, "{x} {y} {z}");
}

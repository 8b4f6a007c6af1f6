//! Sessions next to a record in other axes than the sensor's own.

use firmware_example::RECORD;
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
fn a_session_is_turned_into_the_axes_of_a_record_that_a_rig_has_made() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    let samples = tumble(14);
    let session = session_of(&samples);
    let units = task().sensors[0].units(record::Sensor::Accelerometer);
    let own = session
        .better(record::Sensor::Accelerometer, &units, None::<&record::TriadRecord>, &Axes::Own)
        .expect("accepted");
    // The table's axes: a quarter turn about z. It is less sure than the session.
    let [x, y, z] = own.gain;
    let mut rig = record::TriadRecord { gain: [y.map(|entry| -entry), x, z], ..own };
    rig.quality.gain_std = [[1e-2; 3]; 3];
    let mut held = record::decode(RECORD).expect("whole");
    held.sensor.serial = SERIAL.try_into().expect("short");
    held.acc = Some(rig.clone());
    let mut buffer = [0; record::MAX_LEN];
    let bytes = record::encode(&held, &mut buffer).expect("plausible");
    assert_eq!(bench.ask(&Request::PutRecord { record: bytes, replace: true }, fault), None);

    state_of(&mut bench, &Request::StartCapture(task()));
    send(&mut bench, &samples);
    assert_eq!(bench.ask(&finish(), outcomes)[0], CaptureOutcome::Adopted);
    assert_eq!(bench.ask(&Request::Store { replace: true }, fault), None);
    let there = bench.ask(&Request::GetRecord, |reply| match reply {
        Reply::Record(bytes) => record::decode(bytes).expect("whole").acc,
        other => panic!("{other:?}"),
    });
    let axes = session.axes(&units, Some(&rig));
    let here = session.better(record::Sensor::Accelerometer, &units, Some(&rig), &axes).expect("surer");
    assert_eq!(there.as_ref(), Some(&here));
    let off = here.gain.as_flattened().iter().zip(rig.gain.as_flattened()).map(|(a, b)| (a - b).abs());
    assert!(off.fold(0.0, f32::max) < 1e-5, "{here:?}");
}

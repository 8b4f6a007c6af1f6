//! A session, the drift watch and the bias of the day: raw samples in, without observations of the host.

use std::collections::VecDeque;

use firmware_example::{
    RECORD,
    board::Sample,
    scene::{Noise, spiral},
};
use imucal_core::{
    link::{
        CaptureOutcome, CaptureSensor, CaptureState, CaptureTask, Fault, RawSample, RecordState, Reply,
        Request, SAMPLES,
    },
    record::{self, Date, RawUnit},
    session::{Session, axes::Axes},
    watch,
};
use nalgebra::Vector3;

use crate::{
    bench::{Bench, BenchMemory, Counting, Queued, SERIAL},
    nor::Nor,
};

/// An accelerometer alone, done at 1 %; its raw values are nominal m/s².
pub(super) fn task() -> CaptureTask {
    let absent = CaptureSensor {
        target: 0.0,
        full_scale: f32::INFINITY,
        unit_in: RawUnit::MetrePerSecondSquared,
        offset: 0.0,
        per_unit: 1.0,
    };
    let [acc, gyr, mag] = [RawUnit::MetrePerSecondSquared, RawUnit::RadianPerSecond, RawUnit::MicroTesla]
        .map(|unit_in| CaptureSensor { unit_in, ..absent });
    CaptureTask {
        gravity: 9.80665,
        field: None,
        field_down: None,
        hold: 2.0,
        sensors: [CaptureSensor { target: 0.01, ..acc }, gyr, mag],
    }
}

/// Three seconds of rest in each of some directions, and a second of motion from one to the next; 50 samples a second of an
/// accelerometer whose scale is 2 % off and whose bias is 0.1 m/s².
pub(super) fn tumble(poses: usize) -> Vec<RawSample> {
    let mut noise = Noise(7);
    let mut samples = Vec::new();
    let (mut row, mut last) = (0u64, spiral(0, poses));
    for pose in 0..poses {
        let next = spiral(pose, poses);
        for step in 0..200 {
            let share = (step as f32 / 50.0).min(1.0);
            let up = (last * (1.0 - share) + next * share).normalize();
            let shake = if share < 1.0 { 1.0 } else { 0.01 };
            let force = up * 9.80665 + noise.vector(shake);
            let raw = force * 1.02 + Vector3::new(0.1, -0.1, 0.1);
            samples.push(RawSample {
                time: row * 20_000,
                raw: [Some(raw.into()), None, None],
                temperature: 25.0,
            });
            row += 1;
        }
        last = next;
    }
    samples
}

fn state(reply: &Reply<'_>) -> CaptureState {
    match reply {
        Reply::Capture(state) => *state,
        other => panic!("{other:?}"),
    }
}

pub(super) fn fault(reply: &Reply<'_>) -> Option<Fault> {
    match reply {
        Reply::Fault(fault) => Some(*fault),
        _ => None,
    }
}

fn batch(index: u16, samples: &[RawSample]) -> Request<'static> {
    Request::Samples { index, samples: samples.iter().copied().collect() }
}

/// Sends them all; the last state.
pub(super) fn send(bench: &mut Bench<'_>, samples: &[RawSample]) -> CaptureState {
    let mut last = None;
    for (batch_of, index) in samples.chunks(SAMPLES).zip((0..).step_by(SAMPLES)) {
        last = Some(bench.ask(&batch(index, batch_of), state));
    }
    last.expect("samples")
}

pub(super) fn finish() -> Request<'static> {
    Request::FinishCapture { date: Date::from_days(20_000) }
}

pub(super) fn outcomes(reply: &Reply<'_>) -> [CaptureOutcome; 3] {
    match reply {
        Reply::Captured(outcomes) => *outcomes,
        other => panic!("{other:?}"),
    }
}

/// The same session without a device.
pub(super) fn session_of(samples: &[RawSample]) -> Session<38, 4, 64> {
    let mut session = Session::new(task().settings().expect("possible"));
    for sample in samples {
        task().push(&mut session, sample);
        session.work();
    }
    session.finish();
    while session.work() {}
    session
}

#[test]
fn raw_samples_end_in_the_record_that_the_same_session_gives_elsewhere() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    let samples = tumble(14);
    assert_eq!(state_of(&mut bench, &Request::StartCapture(task())).samples, 0);
    let last = send(&mut bench, &samples);
    assert_eq!((last.samples as usize, last.guide.rests > 11), (samples.len(), true), "{last:?}");
    assert!(last.guide.accepted[0] && last.guide.coverage > 0.5, "{last:?}");
    assert_eq!(
        bench.ask(&finish(), outcomes),
        [CaptureOutcome::Adopted, CaptureOutcome::TooLittle, CaptureOutcome::TooLittle]
    );
    assert_eq!(bench.ask(&finish(), outcomes)[0], CaptureOutcome::Adopted, "the answer may have been lost");
    assert_eq!(bench.ask(&Request::Capture, fault), Some(Fault::NotReady), "the session has ended");
    let store = Request::Store { replace: false };
    assert_eq!(bench.ask(&store, |reply| format!("{reply:?}")), "Stored { sequence: 1 }");

    let session = session_of(&samples);
    let units = task().sensors[0].units(record::Sensor::Accelerometer);
    let here = session
        .better(record::Sensor::Accelerometer, &units, None::<&record::TriadRecord>, &Axes::Own)
        .expect("accepted");
    let there = bench.ask(&Request::GetRecord, |reply| match reply {
        Reply::Record(bytes) => record::decode(bytes).expect("whole"),
        other => panic!("{other:?}"),
    });
    assert_eq!(there.acc, Some(here));
}

pub(super) fn state_of(bench: &mut Bench<'_>, request: &Request<'_>) -> CaptureState {
    bench.ask(request, state)
}

#[test]
fn a_session_that_is_less_sure_than_the_record_in_use_changes_nothing() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    state_of(&mut bench, &Request::StartCapture(task()));
    send(&mut bench, &tumble(20));
    assert_eq!(bench.ask(&finish(), outcomes)[0], CaptureOutcome::Adopted);
    state_of(&mut bench, &Request::StartCapture(task()));
    send(&mut bench, &tumble(11));
    let second = bench.ask(&finish(), outcomes)[0];
    assert!(matches!(second, CaptureOutcome::Surer { stored, new } if new > stored), "{second:?}");
}

#[test]
fn a_session_leaves_a_record_whose_terms_it_does_not_fit() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    let put = Request::PutRecord { record: firmware_example::RECORD_2, replace: false };
    assert_eq!(bench.ask(&put, fault), None);
    state_of(&mut bench, &Request::StartCapture(task()));
    send(&mut bench, &tumble(20));
    assert_eq!(bench.ask(&finish(), outcomes)[0], CaptureOutcome::HigherOrder);
}

#[test]
fn too_few_poses_are_refused_and_nothing_is_in_use() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    state_of(&mut bench, &Request::StartCapture(task()));
    send(&mut bench, &tumble(4));
    let outcome = bench.ask(&finish(), outcomes)[0];
    assert!(matches!(outcome, CaptureOutcome::TooLittle | CaptureOutcome::Refused(_)), "{outcome:?}");
    assert_eq!(bench.ask(&Request::Store { replace: false }, fault), Some(Fault::NoRecord));
}

#[test]
fn samples_that_come_twice_or_too_late_are_not_taken() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    let samples = tumble(2);
    state_of(&mut bench, &Request::StartCapture(task()));
    assert_eq!(bench.ask(&batch(0, &samples[..SAMPLES]), state).samples, 8);
    let again = bench.ask(&batch(0, &samples[..SAMPLES]), fault);
    assert_eq!(again, Some(Fault::OutOfSequence { expected: 8 }));
    let late = bench.ask(&batch(16, &samples[16..24]), fault);
    assert_eq!(late, Some(Fault::OutOfSequence { expected: 8 }));
    assert_eq!(state_of(&mut bench, &Request::Capture).samples, 8);
}

#[test]
fn a_power_cut_in_the_middle_of_a_session_is_seen_by_the_host_and_leaves_the_record() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    let put = Request::PutRecord { record: RECORD, replace: false };
    assert_eq!(bench.ask(&put, fault), None);
    let counts = |unit: CaptureSensor| CaptureSensor { unit_in: RawUnit::Counts, per_unit: 400.0, ..unit };
    let task = CaptureTask { sensors: task().sensors.map(counts), ..task() };
    state_of(&mut bench, &Request::StartCapture(task));
    let samples = tumble(3);
    send(&mut bench, &samples);
    let nor = bench.off();

    let mut bench = Bench::new(nor, SERIAL, Counting::default(), &mut memory);
    assert_eq!(bench.ask(&Request::Capture, fault), Some(Fault::NotReady));
    assert_eq!(bench.ask(&finish(), fault), Some(Fault::NotReady));
    // The next samples are not taken for a part of it either: they would begin at 600.
    let next = bench.ask(&batch(600, &samples[..SAMPLES]), fault);
    assert_eq!(next, Some(Fault::OutOfSequence { expected: 0 }));
    let status = bench.ask(&Request::Status, |reply| match reply {
        Reply::Status(status) => status.record,
        other => panic!("{other:?}"),
    });
    assert_eq!(status, RecordState::InUse);
}

#[test]
fn a_session_of_figures_that_cannot_be_is_malformed() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    let good = task();
    let with = |change: &dyn Fn(&mut CaptureTask)| {
        let mut task = good;
        change(&mut task);
        Request::StartCapture(task)
    };
    for bad in [
        with(&|task| task.gravity = 0.0),
        with(&|task| task.gravity = f32::NAN),
        with(&|task| task.field = Some(-1.0)),
        with(&|task| task.hold = f32::INFINITY),
        with(&|task| task.hold = 61.0),
        with(&|task| task.sensors[1].per_unit = 0.0),
        with(&|task| task.sensors[0].target = -1.0),
        with(&|task| task.sensors[2].full_scale = 0.0),
        with(&|task| task.sensors[2].offset = f32::NAN),
    ] {
        assert_eq!(bench.ask(&bad, fault), Some(Fault::Malformed), "{bad:?}");
    }
    assert_eq!(bench.ask(&Request::Capture, fault), Some(Fault::NotReady));
    bench.ask(&Request::StartCapture(good), state);
    bench.ask(&Request::AbortCapture, |reply| assert_eq!(*reply, Reply::Done));
    assert_eq!(bench.ask(&Request::Capture, fault), Some(Fault::NotReady));
}

#[test]
fn the_record_before_the_last_one_can_be_gone_back_to() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    let restore = |of| Request::RestorePrevious { of };
    assert_eq!(bench.ask(&restore(0), fault), Some(Fault::NoRecord));
    assert_eq!(bench.ask(&Request::PutRecord { record: RECORD, replace: false }, fault), None);
    assert_eq!(bench.ask(&restore(1), fault), Some(Fault::NoRecord));
    let mut later = record::decode(RECORD).expect("golden");
    later.acc.as_mut().expect("one").bias[0] += 1.0;
    let mut page = [0; record::MAX_LEN];
    let later = record::encode(&later, &mut page).expect("room").to_vec();
    assert_eq!(bench.ask(&Request::PutRecord { record: &later, replace: false }, fault), None);
    let stored = |bench: &mut Bench<'_>| {
        bench.ask(&Request::GetRecord, |reply| match reply {
            Reply::Record(bytes) => bytes.to_vec(),
            other => panic!("{other:?}"),
        })
    };
    assert_eq!(stored(&mut bench), later);
    // There and back, and over a power cycle.
    bench.ask(&restore(2), |reply| assert_eq!(*reply, Reply::Stored { sequence: 3 }));
    // The same again, as after a lost answer.
    bench.ask(&restore(2), |reply| assert_eq!(*reply, Reply::Stored { sequence: 3 }));
    assert_eq!(stored(&mut bench), RECORD);
    let mut bench = Bench::new(bench.off(), SERIAL, Counting::default(), &mut memory);
    bench.ask(&restore(3), |reply| assert_eq!(*reply, Reply::Stored { sequence: 4 }));
    assert_eq!(stored(&mut bench), later);
}

/// The golden record with a gyroscope: 16.4 counts a °/s, whose bias is known to a count.
fn with_gyroscope() -> Vec<u8> {
    let mut record = record::decode(RECORD).expect("golden");
    let mut gyr = record.acc.clone().expect("one");
    let scale = 1.0 / (16.4 * 57.29578);
    gyr.gain = [[scale, 0.0, 0.0], [0.0, scale, 0.0], [0.0, 0.0, scale]];
    (gyr.bias, gyr.unit_out, gyr.temperature) = ([12.0, -7.0, 3.0], RawUnit::RadianPerSecond, None);
    (gyr.quality.gain_std, gyr.quality.bias_std) = ([[0.0; 3]; 3], [1.0; 3]);
    record.gyr = Some(gyr);
    let mut page = [0; record::MAX_LEN];
    record::encode(&record, &mut page).expect("room").to_vec()
}

/// Five seconds of rest of that unit, 50 a second, whose gyroscope is off by so many counts.
fn rest(off: f32) -> VecDeque<Sample> {
    let record = record::decode(&with_gyroscope()).expect("whole");
    let (acc, gyr) = (record.acc.expect("one"), record.gyr.expect("one"));
    let per_g = acc.triad::<f32>().gain.try_inverse().expect("regular") * Vector3::new(0.0, 0.0, 9.81);
    let mut noise = Noise(3);
    (0..250)
        .map(|row| {
            let force = Vector3::from(acc.bias) + per_g + noise.vector(1.0);
            let rate = Vector3::from(gyr.bias) + Vector3::repeat(off) + noise.vector(1.0);
            let time = Some(row * 20_000);
            Sample { raw: [Some(force.into()), Some(rate.into()), None], temperature: f32::NAN, time }
        })
        .collect()
}

#[test]
fn a_gyroscope_that_lies_still_after_the_start_loses_its_bias_of_the_day() {
    let mut memory = BenchMemory::new();
    for (off, is_taken) in [(10.0, true), (0.0, false), (1_000.0, false)] {
        let sensors = Queued::default();
        let mut bench = Bench::new(Nor::new(2), SERIAL, sensors.clone(), &mut memory);
        assert_eq!(bench.ask(&Request::PutRecord { record: &with_gyroscope(), replace: false }, fault), None);
        sensors.0.borrow_mut().extend(rest(off));
        bench.replies(|_, _| ());
        let taken = bench.ask(&Request::BiasOfTheDay, |reply| match reply {
            Reply::BiasOfTheDay(bias) => *bias,
            other => panic!("{other:?}"),
        });
        assert_eq!(taken.is_some(), is_taken, "{off} counts: {taken:?}");

        // From then on a stream has none of it.
        bench.ask(&Request::Stream { every: 1 }, |reply| assert_eq!(*reply, Reply::Done));
        sensors.0.borrow_mut().extend(rest(off).into_iter().take(1));
        let rates = bench.replies(|_, reply| match reply {
            Reply::Sample { values: [_, Some(rate), _], .. } => Vector3::from(*rate).norm(),
            other => panic!("{other:?}"),
        });
        let noise = 4.0 / (16.4 * 57.29578);
        assert_eq!(rates[0] < noise, off < 100.0, "{off} counts: {rates:?}, noise {noise}");
    }
}

#[test]
fn a_gyroscope_that_moves_after_its_first_rest_is_left_to_the_watch() {
    let mut memory = BenchMemory::new();
    let sensors = Queued::default();
    let mut bench = Bench::new(Nor::new(2), SERIAL, sensors.clone(), &mut memory);
    assert_eq!(bench.ask(&Request::PutRecord { record: &with_gyroscope(), replace: false }, fault), None);
    for off in [0.0, 10.0] {
        sensors.0.borrow_mut().extend(rest(off));
        bench.replies(|_, _| ());
        bench.ask(&Request::BiasOfTheDay, |reply| assert_eq!(*reply, Reply::BiasOfTheDay(None)));
    }
}

#[test]
fn a_unit_with_a_record_is_watched_and_its_summary_names_it() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    assert_eq!(bench.ask(&Request::Watch, fault), Some(Fault::NotReady));
    assert_eq!(bench.ask(&Request::PutRecord { record: &with_gyroscope(), replace: false }, fault), None);
    let samples: Vec<RawSample> = rest(0.0)
        .into_iter()
        .map(|sample| RawSample { time: sample.time.expect("one"), raw: sample.raw, temperature: 25.0 })
        .collect();
    for (batch_of, index) in samples.chunks(SAMPLES).zip((0..).step_by(SAMPLES)) {
        bench.ask(&batch(index, batch_of), |reply| assert_eq!(*reply, Reply::Done));
    }
    let summary = bench.ask(&Request::Watch, |reply| match reply {
        Reply::Watch(bytes) => watch::decode(bytes).expect("whole"),
        other => panic!("{other:?}"),
    });
    assert_eq!(summary.sensor.serial, SERIAL);
    assert!(summary.watched >= 2 && summary.rests == 1, "{summary:?}");
    // Of another record another watch.
    assert_eq!(bench.ask(&Request::PutRecord { record: &with_gyroscope(), replace: false }, fault), None);
    assert_eq!(bench.ask(&Request::Watch, fault), Some(Fault::NotReady));
}

#[test]
fn the_board_s_own_sensors_bring_a_session_its_samples_while_they_are_streamed() {
    let mut memory = BenchMemory::new();
    let sensors = Queued::default();
    let mut bench = Bench::new(Nor::new(2), SERIAL, sensors.clone(), &mut memory);
    bench.ask(&Request::StartCapture(task()), state);
    let samples = tumble(14);
    let own = |sample: &RawSample| Sample { raw: sample.raw, temperature: 25.0, time: Some(sample.time) };
    bench.ask(&Request::Stream { every: 100 }, |reply| assert_eq!(*reply, Reply::Done));
    sensors.0.borrow_mut().extend(samples.iter().map(own));
    assert_eq!(bench.replies(|_, reply| assert!(matches!(reply, Reply::Sample { .. }))).len(), 28);
    let far = bench.ask(&Request::Capture, state);
    assert_eq!((far.samples as usize, far.guide.accepted[0]), (samples.len(), true), "{far:?}");
    assert_eq!(bench.ask(&finish(), outcomes)[0], CaptureOutcome::Adopted);
}

#[test]
fn time_stamps_that_jitter_and_a_thermometer_that_jumps_leave_a_session_its_result() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    let mut noise = Noise(11);
    let mut samples = tumble(14);
    for (row, sample) in samples.iter_mut().enumerate() {
        sample.time = (sample.time as f64 + 4_000.0 * (1.0 + f64::from(noise.vector(1.0).x))) as u64;
        sample.temperature = [25.0, -300.0, f32::INFINITY, f32::NAN][row % 4];
    }
    state_of(&mut bench, &Request::StartCapture(task()));
    let last = send(&mut bench, &samples);
    assert!(last.guide.accepted[0] && last.guide.rests > 11, "{last:?}");
    assert_eq!(bench.ask(&finish(), outcomes)[0], CaptureOutcome::Adopted);
}

#[test]
fn flash_that_takes_nothing_is_a_fault_and_the_session_s_result_stays_in_use() {
    let mut memory = BenchMemory::new();
    let mut nor = Nor::new(2);
    nor.left = Some(0);
    let mut bench = Bench::new(nor, SERIAL, Counting::default(), &mut memory);
    state_of(&mut bench, &Request::StartCapture(task()));
    send(&mut bench, &tumble(14));
    assert_eq!(bench.ask(&finish(), outcomes)[0], CaptureOutcome::Adopted);
    assert_eq!(bench.ask(&Request::Store { replace: false }, fault), Some(Fault::Flash));
    let unsaved = bench.ask(&Request::Status, |reply| match reply {
        Reply::Status(status) => status.unsaved,
        other => panic!("{other:?}"),
    });
    assert!(unsaved);
}

//! What a host may do with a co-processor, in peace.

use firmware_example::{RECORD, RECORD_2, drill, scene::Noise, storage::layout::SLOT};
use imucal_core::{
    corrector::{Corrector, FullCorrector},
    link::{BATCH, Fault, FitModel, FitTask, Observation, RecordState, Reply, Request, Values},
    model::{norm::NormModel, parameterisation::UPPER_TRIANGULAR},
    observation::ShellPoint,
    record::{self, CalibrationRecord, Date, Defect, Figures, FirstOrder, HigherOrder, RawUnit, Sensor},
    solver::LevenbergMarquardt,
    triad::Triad,
};
use nalgebra::Vector3;

use crate::{
    bench::{Bench, BenchMemory, Counting, LAST_RESET, SERIAL},
    nor::Nor,
};

fn put(record: &[u8]) -> Request<'_> {
    Request::PutRecord { record, replace: false }
}

fn fault(reply: &Reply<'_>) -> Option<Fault> {
    match reply {
        Reply::Fault(fault) => Some(*fault),
        _ => None,
    }
}

fn state(bench: &mut Bench<'_>) -> RecordState {
    bench.ask(&Request::Status, |reply| match reply {
        Reply::Status(status) => status.record,
        other => panic!("{other:?}"),
    })
}

/// The record that the images carry, with its header or its serial changed and the checksum computed again.
fn altered(change: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
    let mut bytes = RECORD.to_vec();
    change(&mut bytes);
    let end = bytes.len() - 4;
    let checksum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&bytes[..end]);
    bytes[end..].copy_from_slice(&checksum.to_le_bytes());
    bytes
}

fn newer() -> Vec<u8> {
    altered(|bytes| bytes[4] = record::VERSION.0 + 1)
}

fn of_another() -> Vec<u8> {
    altered(|bytes| {
        let at = bytes.windows(8).position(|window| window == SERIAL.as_bytes()).expect("its serial");
        bytes[at + 7] = b'8';
    })
}

#[test]
fn a_record_is_stored_used_given_back_and_there_after_a_power_cycle() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    assert_eq!(state(&mut bench), RecordState::Empty);
    let raw = Values::from_slice(&[[33_000.0, 32_000.0, 31_000.0]]).expect("room");
    let correct = Request::Correct { sensor: Sensor::Accelerometer, temperature: 31.0, raw: raw.clone() };
    assert_eq!(bench.ask(&correct, fault), Some(Fault::NoRecord));
    assert_eq!(bench.ask(&put(RECORD), |reply| format!("{reply:?}")), "Stored { sequence: 1 }");
    let nor = bench.off();

    let mut bench = Bench::new(nor, SERIAL, Counting::default(), &mut memory);
    assert_eq!(state(&mut bench), RecordState::InUse);
    assert!(
        bench.ask(&Request::GetRecord, |reply| matches!(reply, Reply::Record(bytes) if *bytes == RECORD))
    );
    let record = record::decode(RECORD).expect("it is golden");
    let corrector = Corrector::<f32>::from(record.acc.as_ref().expect("it has one"));
    let expected =
        Values::from_slice(&[corrector.apply_at(&Vector3::from(raw[0]), 31.0).into()]).expect("room");
    assert!(bench.ask(&correct, |reply| *reply == Reply::Corrected(expected.clone())));
}

#[test]
fn a_record_of_higher_order_is_used_with_all_its_terms() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    assert_eq!(bench.ask(&put(RECORD_2), |reply| format!("{reply:?}")), "Stored { sequence: 1 }");
    let nor = bench.off();
    let mut bench = Bench::new(nor, SERIAL, Counting::default(), &mut memory);
    // It names no serial, so that it is used and nobody can know whose it is.
    assert_eq!(state(&mut bench), RecordState::Unconfirmed);
    assert_eq!(get(&mut bench), RECORD_2);
    let record = record::decode_as::<HigherOrder>(RECORD_2).expect("it is golden");
    let triad = record.acc.as_ref().expect("it has one");
    assert!(triad.order.nonlinearity.is_some() && triad.order.curvature.is_some());
    let raw = Values::from_slice(&[[36_000.0, 30_000.0, 31_000.0]]).expect("room");
    let all = FullCorrector::<f32>::try_from(triad).expect("gentle terms");
    let value = all.apply_at(&Vector3::from(raw[0]), 31.0);
    let linear = Corrector::<f32>::from(&triad.clone().with_order(FirstOrder));
    assert_ne!(value, linear.apply_at(&Vector3::from(raw[0]), 31.0), "the terms make a difference");
    let expected = Values::from_slice(&[value.into()]).expect("room");
    let correct = Request::Correct { sensor: Sensor::Accelerometer, temperature: 31.0, raw };
    assert!(bench.ask(&correct, |reply| *reply == Reply::Corrected(expected.clone())));
}

#[test]
fn a_foreign_newer_or_damaged_record_is_refused_and_changes_nothing() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    assert_eq!(bench.ask(&put(RECORD), fault), None);
    assert_eq!(bench.ask(&put(&of_another()), fault), Some(Fault::OtherSensor));
    assert_eq!(bench.ask(&put(&newer()), fault), Some(Fault::NewerFormat));
    let mut damaged = RECORD.to_vec();
    damaged[40] ^= 4;
    assert_eq!(bench.ask(&put(&damaged), fault), Some(Fault::BadRecord));
    assert_eq!(state(&mut bench), RecordState::InUse);
    assert!(
        bench.ask(&Request::GetRecord, |reply| matches!(reply, Reply::Record(bytes) if *bytes == RECORD))
    );
}

#[test]
fn a_stored_record_of_another_sensor_is_kept_unused() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), "00300018", Counting::default(), &mut memory);
    assert_eq!(bench.ask(&put(&of_another()), fault), None);
    let nor = bench.off();
    // The flash has moved to another board.
    let mut bench = Bench::new(nor, SERIAL, Counting::default(), &mut memory);
    assert_eq!(state(&mut bench), RecordState::OtherSensor);
    assert_eq!(bench.ask(&put(RECORD), fault), Some(Fault::Occupied));
    let kept = of_another();
    assert!(bench.ask(&Request::GetRecord, |reply| matches!(reply, Reply::Record(bytes) if *bytes == kept)));
    assert_eq!(bench.ask(&Request::PutRecord { record: RECORD, replace: true }, fault), None);
    assert_eq!(state(&mut bench), RecordState::InUse);
}

/// The record that the images carry, changed.
fn with(change: impl Fn(&mut CalibrationRecord)) -> CalibrationRecord {
    let mut record = record::decode(RECORD).expect("golden");
    change(&mut record);
    record
}

fn get(bench: &mut Bench<'_>) -> Vec<u8> {
    bench.ask(&Request::GetRecord, |reply| match reply {
        Reply::Record(bytes) => bytes.to_vec(),
        other => panic!("{other:?}"),
    })
}

#[test]
fn an_implausible_record_is_refused_with_its_figure() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    assert_eq!(bench.ask(&put(RECORD), fault), None);
    // The coverage of the accelerometer, behind the rest of its figures: no encoder writes that.
    let coverage = record::decode(RECORD).expect("golden").acc.expect("it has one").quality.coverage;
    let spoiled = altered(|bytes| {
        let at = bytes.windows(4).position(|window| window == coverage.to_le_bytes()).expect("its coverage");
        bytes[at..at + 4].copy_from_slice(&1.5f32.to_le_bytes());
    });
    let sensor = Sensor::Accelerometer;
    let defect = Defect::OutOfRange { sensor, figures: Figures::Coverage, value: 1.5, least: 0.0, most: 1.0 };
    assert_eq!(bench.ask(&put(&spoiled), fault), Some(Fault::Implausible(defect)));
    assert_eq!((state(&mut bench), get(&mut bench)), (RecordState::InUse, RECORD.to_vec()));
}

#[test]
fn a_record_for_another_unit_than_the_board_s_is_refused_and_not_used() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    assert_eq!(bench.ask(&put(RECORD), fault), None);
    // The flash has moved to a board whose accelerometer puts out SI.
    let si = RawUnit::MetrePerSecondSquared;
    let board = Counting { units: [Some(si), None, None], ..Counting::default() };
    let mut bench = Bench::new(bench.off(), SERIAL, board, &mut memory);
    assert_eq!(state(&mut bench), RecordState::Unusable);
    let other = Fault::OtherUnit { sensor: Sensor::Accelerometer, expected: si };
    assert_eq!(bench.ask(&put(RECORD), fault), Some(other));
    // Nor is a fit to samples in counts begun; one to its own unit is.
    let counts = FitTask { unit_in: RawUnit::Counts, ..drill::task(FitModel::T9) };
    assert_eq!(bench.ask(&Request::StartFit(counts), fault), Some(other));
    assert_eq!(bench.ask(&Request::StartFit(drill::task(FitModel::T9)), fault), None);
}

#[test]
fn a_fit_that_no_sensor_can_have_is_not_adopted_and_the_calibration_stays() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    assert_eq!(bench.ask(&put(RECORD), fault), None);
    let raw = Values::from_slice(&[[33_000.0, 32_000.0, 31_000.0]]).expect("room");
    let correct = Request::Correct { sensor: Sensor::Accelerometer, temperature: 31.0, raw };
    let before = bench.ask(&correct, |reply| format!("{reply:?}"));
    for per_unit in [1e-42, 1e-9, 1e30] {
        let task = FitTask { per_unit, ..drill::task(FitModel::T9) };
        assert_eq!(bench.ask(&Request::StartFit(task), fault), None);
        feed(&mut bench, &rests(40));
        assert_eq!(bench.ask(&Request::StepFit { slices: u16::MAX }, fault), None);
        // Judged again after a lost answer, it is refused again.
        for _ in 0..2 {
            let refused = bench.ask(&Request::FinishFit { date: Date::from_days(1) }, fault);
            assert!(matches!(refused, Some(Fault::Implausible(_))), "{per_unit}: {refused:?}");
        }
        assert_eq!(bench.ask(&correct, |reply| format!("{reply:?}")), before);
    }
    assert!(bench.ask(&Request::Status, |reply| matches!(reply, Reply::Status(status) if !status.unsaved)));
}

#[test]
fn a_fit_of_one_triad_leaves_the_terms_of_the_others() {
    let mut memory = BenchMemory::new();
    let unknown = with(|record| record.sensor.serial.clear());
    let mut buffer = [0; record::MAX_LEN];
    let bytes = record::encode(&unknown, &mut buffer).expect("room").to_vec();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    assert_eq!(bench.ask(&put(&bytes), fault), None);
    assert_eq!(bench.ask(&Request::StartFit(drill::task(FitModel::E9)), fault), None);
    drill::observe(FitModel::E9, 40, &mut Noise(1), |observation| {
        let index = bench.device.fit().expect("begun").observations;
        let observations = heapless::Vec::from_slice(&[observation]).expect("one");
        assert_eq!(bench.ask(&Request::Feed { index, observations }, fault), None);
    });
    assert_eq!(bench.ask(&Request::StepFit { slices: u16::MAX }, fault), None);
    assert_eq!(bench.ask(&Request::FinishFit { date: Date::from_days(20_100) }, fault), None);
    assert_eq!(bench.ask(&Request::Store { replace: false }, fault), None);
    let stored = record::decode(&get(&mut bench)).expect("a record");
    assert!(stored.acc.as_ref().expect("kept").temperature.is_some());
    assert_eq!(stored.acc, unknown.acc);
    let of = |sensor| (stored.serial_of(sensor), stored.date_of(sensor));
    assert_eq!(of(Sensor::Accelerometer), ("", unknown.date));
    assert_eq!(of(Sensor::Magnetometer), (SERIAL, Date::from_days(20_100)));
}

#[test]
fn nothing_is_stored_where_nothing_is_in_use() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    assert_eq!(bench.ask(&Request::Store { replace: true }, fault), Some(Fault::NoRecord));
    let nor = bench.off();
    assert_eq!(nor.operations, 0);
    // Nor in the place of a record that cannot be used.
    let mut bench = Bench::new(nor, "00300018", Counting::default(), &mut memory);
    assert_eq!(bench.ask(&put(&of_another()), fault), None);
    let mut bench = Bench::new(bench.off(), SERIAL, Counting::default(), &mut memory);
    assert_eq!(bench.ask(&Request::Store { replace: true }, fault), Some(Fault::NoRecord));
    assert_eq!(get(&mut bench), of_another());
}

#[test]
fn a_damaged_record_is_reported_with_or_without_an_older_one() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    assert_eq!(bench.ask(&put(RECORD), fault), None);
    let mut one = bench.off();
    let mut bench = Bench::new(one.clone(), SERIAL, Counting::default(), &mut memory);
    let later = with(|record| record.date = Date::from_days(30_000));
    let mut buffer = [0; record::MAX_LEN];
    assert_eq!(bench.ask(&put(record::encode(&later, &mut buffer).expect("room")), fault), None);
    let mut two = bench.off();
    one.bytes[64 + 100] ^= 1;
    two.bytes[64 + SLOT + 100] ^= 1;

    let mut bench = Bench::new(two, SERIAL, Counting::default(), &mut memory);
    assert_eq!((state(&mut bench), get(&mut bench)), (RecordState::Previous, RECORD.to_vec()));
    assert_eq!(bench.ask(&put(RECORD), |reply| format!("{reply:?}")), "Stored { sequence: 3 }");
    assert_eq!(state(&mut bench), RecordState::InUse);
    let mut bench = Bench::new(one, SERIAL, Counting::default(), &mut memory);
    assert_eq!(state(&mut bench), RecordState::Lost);
    assert_eq!(bench.ask(&Request::GetRecord, fault), Some(Fault::NoRecord));
}

fn rests(count: usize) -> Vec<ShellPoint<f32>> {
    let mut points = Vec::new();
    drill::observe(FitModel::T9, count, &mut Noise(1), |observation| match observation {
        Observation::Point(value, _) => points.push(ShellPoint::new(Vector3::from(value))),
        other => panic!("{other:?}"),
    });
    points
}

fn feed(bench: &mut Bench<'_>, points: &[ShellPoint<f32>]) {
    let observations: Vec<_> =
        points.iter().map(|point| Observation::Point(point.value.into(), point.excess)).collect();
    for (index, batch) in observations.chunks(BATCH).enumerate() {
        let observations = heapless::Vec::from_slice(batch).expect("a batch");
        let index = (index * BATCH) as u16;
        assert_eq!(bench.ask(&Request::Feed { index, observations: observations.clone() }, fault), None);
        // Sent again, as after a lost answer.
        let expected = index + batch.len() as u16;
        let again = bench.ask(&Request::Feed { index, observations }, fault);
        assert_eq!(again, Some(Fault::OutOfSequence { expected }));
    }
}

#[test]
fn a_fit_on_board_is_the_core_s_and_samples_are_corrected_meanwhile() {
    let mut memory = BenchMemory::new();
    let points = rests(40);
    let mut alone = LevenbergMarquardt::new(UPPER_TRIANGULAR.theta(&Triad::identity()), Default::default());
    alone.run(&NormModel { points: &points, norm: 9.80665, form: UPPER_TRIANGULAR });

    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    assert_eq!(bench.ask(&put(RECORD), fault), None);
    assert_eq!(bench.ask(&Request::StartFit(drill::task(FitModel::T9)), fault), None);
    feed(&mut bench, &points);
    assert_eq!(bench.ask(&Request::FinishFit { date: Date::from_days(1) }, fault), Some(Fault::NotReady));
    let step = bench.send(&Request::StepFit { slices: u16::MAX });
    let busy = bench.send(&Request::Store { replace: false });
    let raw = Values::from_slice(&[[1.0; 3]]).expect("room");
    let corrected = bench.send(&Request::Correct { sensor: Sensor::Accelerometer, temperature: 20.0, raw });
    let order = bench.replies(|id, reply| (id, fault(reply)));
    assert_eq!(order, [(busy, Some(Fault::Busy)), (corrected, None), (step, None)]);

    let report = bench.ask(&Request::FinishFit { date: Date::from_days(20_000) }, |reply| match reply {
        Reply::Report(report) => report.clone(),
        other => panic!("{other:?}"),
    });
    assert_eq!(report.refusal, None);
    assert_eq!(&report.theta[..], alone.theta().as_slice());
    let covariance = alone.covariance().expect("redundant");
    let upper: Vec<f32> =
        (0..9).flat_map(|k| covariance.column(k).iter().take(k + 1).copied().collect::<Vec<_>>()).collect();
    assert_eq!(&report.covariance[..], &upper[..]);

    // In use at once, in flash when asked for, with what else the record before held.
    assert_eq!(bench.ask(&Request::Store { replace: false }, fault), None);
    let stored = bench.ask(&Request::GetRecord, |reply| match reply {
        Reply::Record(bytes) => record::decode(bytes).expect("a record"),
        other => panic!("{other:?}"),
    });
    assert_eq!((stored.sensor.serial.as_str(), stored.date), (SERIAL, Date::from_days(20_000)));
    assert_eq!(stored.mag, record::decode(RECORD).expect("golden").mag);
    let acc = stored.acc.expect("fitted");
    assert_eq!(acc.triad::<f32>(), UPPER_TRIANGULAR.triad(alone.theta()));
    assert_eq!((acc.model.as_str(), acc.quality.observations), ("T9", 40));
}

#[test]
fn too_few_rests_are_refused_on_board_and_the_calibration_stays() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    assert_eq!(bench.ask(&put(RECORD), fault), None);
    assert_eq!(bench.ask(&Request::StartFit(drill::task(FitModel::T9)), fault), None);
    feed(&mut bench, &rests(9));
    assert_eq!(bench.ask(&Request::StepFit { slices: u16::MAX }, fault), None);
    let reason = bench.ask(&Request::FinishFit { date: Date::from_days(1) }, |reply| match reply {
        Reply::Report(report) => report.refusal.map(|refusal| refusal.reason()),
        other => panic!("{other:?}"),
    });
    assert_eq!(reason, Some("too-few-observations"));
    let unsaved =
        bench.ask(&Request::Status, |reply| matches!(reply, Reply::Status(status) if status.unsaved));
    assert!(!unsaved);
}

#[test]
fn a_stream_sends_every_so_many_samples_under_the_id_that_asked_for_it() {
    let mut memory = BenchMemory::new();
    let mut bench =
        Bench::new(Nor::new(2), SERIAL, Counting { on: true, ..Counting::default() }, &mut memory);
    bench.send(&put(RECORD));
    let stream = bench.send(&Request::Stream { every: 3 });
    for _ in 0..400 {
        bench.device.poll();
    }
    let bytes: Vec<u8> = bench.wire.to_host.borrow_mut().drain(..).collect();
    let mut receiver = imucal_core::link::Receiver::default();
    let mut numbers = Vec::new();
    for byte in bytes {
        let Some(frame) = receiver.push(byte) else { continue };
        let frame = imucal_core::link::split(frame.expect("intact")).expect("intact");
        if let Ok(Reply::Sample { number, values }) = frame.read() {
            assert_eq!((frame.header.id, frame.header.session), (stream, bench.session));
            assert!(values[2].is_none());
            numbers.push(number);
        }
    }
    // Where another answer went, a sample is left out.
    let whole = numbers.windows(2).all(|pair| (pair[1] - pair[0]) % 3 == 0);
    assert!(numbers.len() > 120 && whole, "{numbers:?}");
}

#[test]
fn a_device_says_how_its_last_run_ended() {
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(2), SERIAL, Counting::default(), &mut memory);
    assert!(bench.ask(&Request::LastReset, |reply| *reply == Reply::LastReset(LAST_RESET)));
}

//! A link that damages, loses, repeats and reorders frames.

use std::collections::HashSet;

use firmware_example::{RECORD, drill};
use imucal_core::{
    link::{BATCH, Fault, FitModel, MAX_FRAME, Observation, RecordState, Reply, Request, Values},
    record::{self, Date, Sensor},
};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::{
    bench::{Bench, BenchMemory, Counting, SERIAL, framed},
    nor::Nor,
};

/// Records that differ in their date.
pub fn records(count: u32) -> Vec<Vec<u8>> {
    let golden = record::decode(RECORD).expect("golden");
    let of = |day| {
        let mut page = [0; record::MAX_LEN];
        let dated = record::CalibrationRecord { date: Date::from_days(day), ..golden.clone() };
        record::encode(&dated, &mut page).expect("room").to_vec()
    };
    (1..=count).map(of).collect()
}

fn request<'a>(rng: &mut ChaCha8Rng, records: &'a [Vec<u8>]) -> Request<'a> {
    match rng.random_range(0..12) {
        0 => Request::Identify { nonce: rng.random() },
        1 => Request::Status,
        2 => Request::GetRecord,
        3 => {
            Request::PutRecord { record: &records[rng.random_range(0..records.len())], replace: rng.random() }
        }
        4 | 5 => {
            let raw = (0..rng.random_range(0..48)).map(|_| [rng.random(), rng.random(), f32::NAN]).collect();
            Request::Correct { sensor: Sensor::Accelerometer, temperature: 20.0, raw }
        }
        6 => Request::StartFit(drill::task(FitModel::ALL[rng.random_range(0..4)])),
        7 | 8 => {
            let any = |rng: &mut ChaCha8Rng| [(); 3].map(|()| rng.random_range(-10.0..10.0));
            let observations = (0..rng.random_range(0..=BATCH))
                .map(|_| match rng.random_range(0..4) {
                    0 => Observation::Pose(any(rng), any(rng), any(rng)),
                    1 => Observation::Turn(any(rng), any(rng)),
                    2 => Observation::Block(any(rng), any(rng), any(rng), 0.1),
                    _ => Observation::Point(any(rng), 0.0),
                })
                .collect();
            Request::Feed { index: rng.random_range(0..40), observations }
        }
        9 => Request::StepFit { slices: rng.random_range(0..20) },
        10 => Request::FinishFit { date: Date::from_days(5) },
        _ => [Request::AbortFit, Request::Stream { every: 0 }, Request::Store { replace: false }]
            [rng.random_range(0..3)]
        .clone(),
    }
}

#[test]
fn frames_over_a_bad_link_store_no_wrong_record_and_hang_nothing() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let records = records(20);
    let mut memory = BenchMemory::new();
    let mut bench = Bench::new(Nor::new(3), SERIAL, Counting::default(), &mut memory);
    let (mut asked, mut waiting): (HashSet<u32>, Vec<Vec<u8>>) = (HashSet::new(), Vec::new());
    let (mut delivered, mut whole, mut answered, mut unread) = (0u32, 0u32, 0u32, 0u32);
    // Ids between are left to the checks.
    for id in (1..=100_000u32).map(|count| 2 * count) {
        asked.insert(id);
        waiting.push(framed(bench.session, id, &request(&mut rng, &records)));
        while waiting.len() > rng.random_range(0..4) {
            let at = if rng.random_bool(0.9) { 0 } else { rng.random_range(0..waiting.len()) };
            let mut frame = waiting.remove(at);
            if rng.random_bool(0.1) {
                continue; // lost
            }
            if rng.random_bool(0.05) {
                waiting.push(frame.clone()); // comes again
            }
            let intact = !rng.random_bool(0.1);
            if !intact {
                damage(&mut rng, &mut frame);
            }
            delivered += 1;
            whole += u32::from(intact);
            bench.wire.to_device.borrow_mut().extend(frame);
            let faults = bench
                .replies(|id, reply| (id, matches!(reply, Reply::Fault(Fault::Damaged | Fault::Oversized))));
            for (id, is_unread) in faults {
                assert!(id == 0 || asked.contains(&id), "answered what nobody asked: {id}");
                assert!(id != 0 || is_unread || !intact);
                answered += 1;
                unread += u32::from(id == 0);
            }
        }
        if id % 1_000 == 0 {
            check_stored(&mut bench, &records, id + 1);
        }
    }
    println!(
        "{delivered} frames came, {whole} of them whole; {answered} answers, {unread} of them to what could not be read"
    );
    assert!(answered >= whole * 9 / 10 && unread > 1_000);
    assert!(bench.ask_from(
        200_002,
        &Request::Status,
        |reply| matches!(reply, Reply::Status(status) if status.corrected > 0)
    ));
}

/// What is stored is one of the records sent, or one that was fitted here: always whole, always this unit's.
fn check_stored(bench: &mut Bench<'_>, records: &[Vec<u8>], id: u32) {
    // A damaged frame may have lost the zero at its end.
    bench.wire.to_device.borrow_mut().push_back(0);
    bench.replies(|_, _| ());
    let stored = bench.ask_from(id, &Request::GetRecord, |reply| match reply {
        Reply::Record(bytes) => Some(bytes.to_vec()),
        _ => None,
    });
    if let Some(bytes) = stored {
        let stored = record::decode(&bytes).expect("whole");
        assert_eq!(stored.sensor.serial, SERIAL);
        assert!(records.contains(&bytes) || stored.date == Date::from_days(5), "a record that nobody sent");
    }
}

/// Bits flipped, bytes left out, put in, or a tail cut off.
fn damage(rng: &mut ChaCha8Rng, frame: &mut Vec<u8>) {
    let at = rng.random_range(0..frame.len());
    match rng.random_range(0..5) {
        0 => frame[at] ^= 1 << rng.random_range(0..8),
        1 => drop(frame.remove(at)),
        2 => frame.insert(at, rng.random()),
        3 => frame.truncate(at),
        _ => {
            let mut noise = vec![0; rng.random_range(0..2 * MAX_FRAME)];
            rng.fill_bytes(&mut noise);
            frame.splice(at..at, noise);
        }
    }
    if frame.is_empty() {
        frame.push(0xAA);
    }
}

#[test]
fn the_state_of_a_record_is_reported_whatever_the_flash_holds() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut memory = BenchMemory::new();
    let mut nor = Nor::new(2);
    rng.fill_bytes(&mut nor.bytes);
    let mut bench = Bench::new(nor, SERIAL, Counting::default(), &mut memory);
    let state = bench.ask(&Request::Status, |reply| match reply {
        Reply::Status(status) => status.record,
        other => panic!("{other:?}"),
    });
    assert_eq!(state, RecordState::Empty);
    let raw = Values::new();
    assert!(bench.ask(&Request::Correct { sensor: Sensor::Magnetometer, temperature: 1.0, raw }, |reply| {
        matches!(reply, Reply::Corrected(_))
    }));
}

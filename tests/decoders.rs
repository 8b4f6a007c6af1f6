//! The decoders of frames and records, fed with damaged ones by a seed: the fuzzer's questions where there is no
//! fuzzer. `tests/run` also fuzzes, where there is one.

use firmware_example::{RECORD, drill, scene::Noise};
use imucal_core::{
    link::{BATCH, FitModel, Header, MAX_FRAME, Origin, Reply, Request, Values, encode},
    record::{Date, Sensor},
};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[path = "fuzz/bodies.rs"]
mod bodies;

/// Runs of each.
const RUNS: u32 = 1_000_000;

/// Bits flipped, bytes changed to what a length or a tag may be, put in and left out, pieces moved, and a cut tail.
fn damaged(rng: &mut ChaCha8Rng, whole: &[u8]) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    for _ in 0..rng.random_range(0..4) {
        let at = rng.random_range(0..bytes.len().max(1)).min(bytes.len().saturating_sub(1));
        if bytes.is_empty() {
            break;
        }
        match rng.random_range(0..7) {
            0 => bytes[at] ^= 1 << rng.random_range(0..8),
            1 => bytes[at] = [0, 1, 0x7F, 0x80, 0xFF][rng.random_range(0..5)],
            2 => bytes[at] = rng.random(),
            3 => drop(bytes.remove(at)),
            4 => bytes.insert(at, rng.random()),
            5 => {
                let piece = bytes[at..(at + rng.random_range(1..16)).min(bytes.len())].to_vec();
                let to = rng.random_range(0..=bytes.len());
                bytes.splice(to..to, piece);
            }
            _ => bytes.truncate(at),
        }
    }
    bytes
}

/// Messages of every kind that has a body, as they stand in a frame, and their frames.
fn messages() -> Vec<Vec<u8>> {
    let mut observations = heapless::Vec::new();
    for model in [FitModel::T9, FitModel::I14, FitModel::K12] {
        drill::observe(model, 4, &mut Noise(1), |observation| {
            let _full = observations.push(observation);
        });
    }
    assert_eq!(observations.len(), BATCH);
    let raw = Values::from_slice(&[[1.0, -2.0, f32::NAN]; 5]).expect("room");
    let requests = [
        Request::Identify { nonce: 1 << 63 },
        Request::PutRecord { record: RECORD, replace: true },
        Request::Correct { sensor: Sensor::Gyroscope, temperature: 25.0, raw: raw.clone() },
        Request::StartFit(drill::task(FitModel::K12)),
        Request::Feed { index: 300, observations },
        Request::FinishFit { date: Date::from_days(20_000) },
    ];
    let replies = [Reply::Record(RECORD), Reply::Corrected(raw), Reply::Stored { sequence: 70_000 }];
    let mut buffer = [0; MAX_FRAME];
    let asked = Header { id: 9, origin: Origin::Host, session: 0x0102_0304 };
    let answered = Header { origin: Origin::Device, ..asked };
    let mut framed: Vec<Vec<u8>> = requests
        .iter()
        .map(|each| encode(&asked, each, None, &mut buffer).expect("it fits").to_vec())
        .collect();
    framed.extend(
        replies.iter().map(|each| encode(&answered, each, None, &mut buffer).expect("it fits").to_vec()),
    );
    let plain: Vec<Vec<u8>> = framed
        .iter()
        .map(|frame| {
            let mut receiver = imucal_core::link::Receiver::default();
            let whole =
                frame.iter().find_map(|byte| receiver.push(*byte).map(|f| f.expect("whole").to_vec()));
            let whole = whole.expect("a frame");
            // Behind the header, before the checksum.
            whole[10..whole.len() - 4].to_vec()
        })
        .collect();
    [framed, plain].concat()
}

#[test]
fn a_million_damaged_frames_and_messages_are_read_or_refused() {
    let (mut rng, messages, mut read) = (ChaCha8Rng::seed_from_u64(1), messages(), 0);
    for _ in 0..RUNS {
        let whole = &messages[rng.random_range(0..messages.len())];
        read += bodies::frames(&damaged(&mut rng, whole));
    }
    println!("{RUNS} runs, {read} messages read");
    assert!(read > RUNS / 10 && read < RUNS, "{read}");
}

#[test]
fn a_million_damaged_records_and_payloads_are_read_or_refused() {
    let (mut rng, mut read) = (ChaCha8Rng::seed_from_u64(2), 0);
    // Between header and checksum.
    let payload = &RECORD[8..RECORD.len() - 4];
    for _ in 0..RUNS {
        let whole = if rng.random_bool(0.2) { RECORD } else { payload };
        read += bodies::records(&damaged(&mut rng, whole));
    }
    println!("{RUNS} runs, {read} records read");
    // Damage that makes a figure no sensor has is refused as well.
    assert!(read > RUNS / 25 && read < RUNS, "{read}");
}

#[test]
fn a_million_lots_of_noise_are_refused_or_read() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut noise = [0; 96];
    for _ in 0..RUNS {
        let length = rng.random_range(0..=noise.len());
        rng.fill_bytes(&mut noise[..length]);
        bodies::frames(&noise[..length]);
        bodies::records(&noise[..length]);
    }
}

//! The record in flash: cut anywhere, worn evenly.

use firmware_example::storage::{SLOT, Slots, StorageError};
use imucal_core::record::MAX_LEN;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::nor::Nor;

/// Bits of a torn word that a cut lets in.
const TORN: [u32; 4] = [0, 0x0000_FFFF, 0xFFFF_FFFE, 0xA5C3_0FF0];

fn store(nor: &mut Nor, bytes: &[u8]) -> Result<u32, StorageError> {
    let mut slots = Slots::open(nor)?;
    let mut writing = slots.begin(bytes)?;
    loop {
        if let Some(sequence) = slots.step(&mut writing)? {
            return Ok(sequence);
        }
    }
}

fn stored(nor: &mut Nor) -> Vec<u8> {
    let mut buffer = [0; SLOT];
    Slots::open(nor).expect("it opens").read(&mut buffer).expect("it reads").to_vec()
}

fn record(rng: &mut ChaCha8Rng) -> Vec<u8> {
    let length = if rng.random_bool(0.1) { MAX_LEN } else { rng.random_range(1..=MAX_LEN) };
    // Many ones: words that a torn write leaves as if they were whole.
    (0..length).map(|_| if rng.random_bool(0.3) { 0xFF } else { rng.random() }).collect()
}

#[test]
fn a_cut_at_any_operation_and_inside_any_word_leaves_the_old_record_or_the_new() {
    let mut cuts = 0u32;
    for seed in 0..200 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut nor = Nor::new(rng.random_range(2..=4));
        let mut old = Vec::new();
        for _ in 0..rng.random_range(0..15) {
            old = record(&mut rng);
            store(&mut nor, &old).expect("nothing cuts");
        }
        let new = record(&mut rng);
        let mut whole = nor.clone();
        whole.operations = 0;
        store(&mut whole, &new).expect("nothing cuts");
        for cut in 0..whole.operations {
            let mut nor = Nor { left: Some(cut), torn: TORN[rng.random_range(0..TORN.len())], ..nor.clone() };
            assert!(matches!(store(&mut nor, &new), Err(StorageError::Flash(_))), "seed {seed}, cut {cut}");
            nor.left = None;
            let found = stored(&mut nor);
            assert!(found == old || found == new, "seed {seed}, cut {cut}: neither old nor new");
            // And what was cut does not stand in the way of the next update.
            let next = record(&mut rng);
            store(&mut nor, &next).expect("nothing cuts");
            assert_eq!(stored(&mut nor), next, "seed {seed}, cut {cut}");
            cuts += 1;
        }
    }
    println!("{cuts} cuts");
    assert!(cuts > 15_000);
}

#[test]
fn one_cut_after_another_never_loses_the_record() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut nor = Nor::new(2);
    store(&mut nor, b"first").expect("nothing cuts");
    let mut old = b"first".to_vec();
    for round in 0..5_000 {
        let new = record(&mut rng);
        nor.left = Some(rng.random_range(0..200));
        nor.torn = rng.random();
        let done = store(&mut nor, &new);
        nor.left = None;
        let found = stored(&mut nor);
        assert!(found == new || (done.is_err() && found == old), "round {round}");
        old = found;
    }
}

#[test]
fn ten_thousand_updates_wear_all_pages_within_a_factor_of_two() {
    for pages in [2, 3, 5] {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut nor = Nor::new(pages);
        for number in 1..=10_000 {
            assert_eq!(store(&mut nor, &record(&mut rng)), Ok(number));
        }
        let (least, most) =
            (nor.erases.iter().min().expect("pages"), nor.erases.iter().max().expect("pages"));
        println!("{pages} pages: {least} to {most} erases each for 10 000 updates");
        assert!(*most <= 2 * *least && *most <= 10_000 / 6 / pages as u32 + 1, "{:?}", nor.erases);
    }
}

#[test]
fn noise_in_the_flash_is_no_record_and_one_page_is_too_few() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut nor = Nor::new(2);
    nor.bytes.iter_mut().for_each(|byte| *byte = rng.random());
    assert_eq!(stored(&mut nor), []);
    store(&mut nor, b"after noise").expect("it stores");
    assert_eq!(stored(&mut nor), b"after noise");
    assert_eq!(store(&mut nor, &[0; MAX_LEN + 1]), Err(StorageError::TooLong));
    assert!(matches!(Slots::open(&mut Nor::new(1)), Err(StorageError::Unsuited)));
}

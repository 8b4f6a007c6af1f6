//! The record in flash: cut anywhere, worn evenly.

use firmware_example::storage::{Slots, StorageError, layout};
use imucal_core::record::MAX_LEN;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::nor::{Nor, PAGE};

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
    let mut buffer = [0; MAX_LEN];
    Slots::open(nor).expect("it opens").read(&mut buffer).expect("it reads").to_vec()
}

fn record(rng: &mut ChaCha8Rng) -> Vec<u8> {
    let length = if rng.random_bool(0.1) { MAX_LEN } else { rng.random_range(1..=MAX_LEN) };
    // Many ones: words that a torn write leaves as if they were whole.
    (0..length).map(|_| if rng.random_bool(0.3) { 0xFF } else { rng.random() }).collect()
}

/// A record as long as there were in the days of layout 1.
fn first_record(rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = record(rng);
    bytes.truncate(578);
    bytes
}

/// Flash as the firmware of layout 1 left it, by its drawing: slots of 640 B, each with its number, its length twice, the
/// record and the CRC-32 of all before; one block after the other, and no head.
fn first_layout(pages: usize, records: &[Vec<u8>]) -> Nor {
    let mut nor = Nor::new(pages);
    let (slot, crc) = (640, crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC));
    for (index, record) in records.iter().enumerate() {
        let page = index / (PAGE / slot) % pages * PAGE;
        let at = page + index % (PAGE / slot) * slot;
        if at == page {
            nor.bytes[page..page + PAGE].fill(0xFF);
        }
        let (sequence, length) = (index as u32 + 1, record.len() as u16);
        let header = [&sequence.to_le_bytes()[..], &length.to_le_bytes(), &(!length).to_le_bytes()].concat();
        let checked = [&header[..], record].concat();
        let whole = [&checked[..], &crc.checksum(&checked).to_le_bytes()].concat();
        nor.bytes[at..at + whole.len()].copy_from_slice(&whole);
    }
    nor
}

#[test]
fn a_power_cut_at_any_word_leaves_the_old_record_or_the_new() {
    let mut cuts = 0u32;
    for seed in 0..200 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut nor = Nor::new(rng.random_range(2..=4));
        let mut old = Vec::new();
        // Every other one was left by the firmware of layout 1.
        if seed % 2 == 1 {
            let records: Vec<_> = (0..rng.random_range(1..15)).map(|_| first_record(&mut rng)).collect();
            nor = first_layout(nor.erases.len(), &records);
            old = records.last().expect("one").clone();
        }
        for _ in 0..rng.random_range(0..15 * (1 - seed % 2) + 3) {
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
fn a_record_that_was_cut_off_before_its_seal_is_sealed_when_it_is_stored_again() {
    let mut nor = Nor::new(2);
    store(&mut nor, b"first").expect("nothing cuts");
    let cut_at = |cut: u32| {
        let mut nor = Nor { left: Some(cut), torn: 0, ..nor.clone() };
        assert!(store(&mut nor, b"second").is_err());
        nor.left = None;
        nor
    };
    let is_whole = |cut: &u32| stored(&mut cut_at(*cut)) == b"second";
    let mut nor = cut_at((0..1_000).find(is_whole).expect("the seal comes last"));
    store(&mut nor, b"second").expect("nothing cuts");
    let again = nor.clone();
    store(&mut nor, b"second").expect("nothing cuts");
    assert!(nor.bytes == again.bytes, "it is stored");
    // A bit flips: the device knows which record it has lost.
    let at = nor.bytes.windows(6).position(|bytes| bytes == b"second").expect("it is there");
    nor.bytes[at] ^= 1;
    assert_eq!(stored(&mut nor), b"first");
    assert_eq!(Slots::open(&mut nor).expect("it opens").lost(), Some(2));
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
        assert!(*most <= 2 * *least && *most <= 10_000 / 4 / pages as u32 + 1, "{:?}", nor.erases);
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

#[test]
fn flash_of_the_first_layout_is_read_and_taken_over_without_a_loss() {
    for (pages, count) in [(2, 1), (2, 6), (2, 7), (3, 12), (4, 30)] {
        let mut rng = ChaCha8Rng::seed_from_u64(count);
        let records: Vec<_> = (0..count).map(|_| first_record(&mut rng)).collect();
        let mut nor = first_layout(pages, &records);
        let before = nor.bytes.clone();
        assert_eq!(&stored(&mut nor), records.last().expect("one"));
        assert_eq!(nor.bytes, before, "reading writes nothing");
        for number in 1..=20 {
            let new = record(&mut rng);
            assert_eq!(store(&mut nor, &new), Ok(count as u32 + number), "the numbers go on");
            assert_eq!(stored(&mut nor), new, "{pages} pages, {count} records, then {number}");
        }
    }
}

/// Flash of one record, by the drawings of `layout` and `storage` without their code.
fn second_layout(record: &[u8]) -> Vec<u8> {
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let mut bytes = vec![0xFF; 2 * PAGE];
    let mut put = |at: usize, checked: &[u8]| {
        bytes[at..at + checked.len()].copy_from_slice(checked);
        let end = at + checked.len();
        bytes[end..end + 4].copy_from_slice(&crc.checksum(checked).to_le_bytes());
    };
    // Slots of 960 B, four of them; the first record of the block is 1.
    put(0, &[b'I', b'M', b'U', b'S', 2, 0xFF, 0xC0, 0x03, 4, 0, 0xFF, 0xFF, 1, 0, 0, 0]);
    let length = record.len() as u8;
    put(64, &[&[1, 0, 0, 0, length, 0, !length, 0xFF], record].concat());
    let seal = 64 + 960 - 64;
    bytes[seal..seal + 8].copy_from_slice(&[1, 0, 0, 0, 0xFE, 0xFF, 0xFF, 0xFF]);
    bytes
}

#[test]
fn flash_is_written_as_the_drawing_of_the_layout_has_it() {
    let mut nor = Nor::new(2);
    store(&mut nor, b"a record").expect("nothing cuts");
    assert!(nor.bytes == second_layout(b"a record"));
    assert_eq!(layout::VERSION, 2, "a layout that changes has a version and a drawing of its own");
}

#[test]
fn blank_flash_is_not_written_by_a_start_nor_erased_by_the_first_record() {
    let mut nor = Nor::new(2);
    assert_eq!(stored(&mut nor), []);
    assert_eq!(nor.operations, 0);
    store(&mut nor, b"first").expect("nothing cuts");
    assert_eq!(nor.erases, [0, 0]);
}

#[test]
fn a_record_that_is_stored_already_is_not_written_again() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let old = first_record(&mut rng);
    for mut nor in [Nor::new(2), first_layout(2, &[vec![1; 9], old.clone()])] {
        let sequence = store(&mut nor, &old).expect("nothing cuts");
        let (bytes, operations) = (nor.bytes.clone(), nor.operations);
        for _ in 0..10 {
            assert_eq!(store(&mut nor, &old), Ok(sequence));
        }
        assert!(nor.bytes == bytes && nor.operations == operations);
        assert_eq!(store(&mut nor, b"another"), Ok(sequence + 1));
    }
}

#[test]
fn a_bit_that_rots_in_the_newest_record_is_reported_wherever_it_is() {
    let (old, new) = (vec![0xA5; 300], vec![0x5A; 300]);
    let mut whole = Nor::new(2);
    store(&mut whole, &old).expect("nothing cuts");
    store(&mut whole, &new).expect("nothing cuts");
    let slot = 64 + layout::SLOT;
    for at in slot..slot + 8 + 300 + 4 {
        for bit in [0, 3, 7] {
            let mut nor = whole.clone();
            nor.bytes[at] ^= 1 << bit;
            let slots = Slots::open(&mut nor).expect("it opens");
            assert_eq!(slots.newest().map(|newest| newest.sequence), Some(1), "byte {at}");
            assert_eq!(slots.lost(), Some(2), "byte {at}");
            assert_eq!(stored(&mut nor), old);
            // The next record has a number of its own, and nothing is lost any more. The same record too is written.
            assert_eq!(store(&mut nor, &old), Ok(3), "byte {at}");
            assert_eq!(Slots::open(&mut nor).expect("it opens").lost(), None);
        }
    }
    // Of layout 1, where the header is whole.
    let mut nor = first_layout(2, &[old.clone(), new]);
    nor.bytes[640 + 100] ^= 1;
    let slots = Slots::open(&mut nor).expect("it opens");
    assert_eq!((slots.newest().map(|newest| newest.sequence), slots.lost()), (Some(1), Some(2)));
    // The only one.
    let mut nor = Nor::new(2);
    store(&mut nor, &old).expect("nothing cuts");
    nor.bytes[200] ^= 0x10;
    let slots = Slots::open(&mut nor).expect("it opens");
    assert!(slots.newest().is_none() && slots.lost() == Some(1));
}

#[test]
fn a_record_cut_off_while_it_is_written_is_not_called_lost() {
    let mut nor = Nor::new(2);
    store(&mut nor, &[1; 300]).expect("nothing cuts");
    for cut in 0..90 {
        let mut nor = Nor { left: Some(cut), torn: 0xA5C3_0FF0, ..nor.clone() };
        if store(&mut nor, &[2; 300]).is_ok() {
            continue;
        }
        nor.left = None;
        let slots = Slots::open(&mut nor).expect("it opens");
        let newest = slots.newest().map(|newest| newest.sequence);
        assert!(slots.lost().is_none(), "cut {cut}: {newest:?}, {:?}", slots.lost());
    }
}

#[test]
fn what_an_erase_that_was_cut_leaves_of_a_block_is_not_called_lost() {
    let mut rng = ChaCha8Rng::seed_from_u64(29);
    let mut full = Nor::new(2);
    for _ in 0..5 {
        store(&mut full, &record(&mut rng)).expect("nothing cuts");
    }
    let newest = |nor: &mut Nor| Slots::open(nor).expect("it opens").newest().map(|newest| newest.sequence);
    assert_eq!(newest(&mut full), Some(5));
    // The first block, whose records have been replaced, has lost some of its zeros.
    for share in [0.002, 0.01, 0.05, 0.3, 0.9] {
        for _ in 0..400 {
            let mut nor = full.clone();
            for byte in &mut nor.bytes[..PAGE] {
                *byte |= (0..8).filter(|_| rng.random_bool(share)).fold(0, |bits, bit| bits | 1 << bit);
            }
            let lost = Slots::open(&mut nor).expect("it opens").lost();
            assert_eq!((newest(&mut nor), lost), (Some(5), None), "{share}");
            assert_eq!(store(&mut nor, b"next"), Ok(6));
        }
    }
}

#[test]
fn a_block_of_a_newer_layout_is_known_to_be_newer_and_kept() {
    let mut nor = Nor::new(2);
    store(&mut nor, b"before the update").expect("nothing cuts");
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let mut head = vec![b'I', b'M', b'U', b'S', 3, 0xFF, 0x00, 0x08, 1, 0, 0xFF, 0xFF, 2, 0, 0, 0];
    head.extend(crc.checksum(&head).to_le_bytes());
    nor.bytes[PAGE..PAGE + head.len()].copy_from_slice(&head);
    let before = nor.bytes.clone();
    assert!(Slots::open(&mut nor).expect("it opens").is_newer());
    assert_eq!(nor.bytes, before);
    // Replaced: the number goes on behind it.
    assert_eq!(store(&mut nor, b"after the downgrade"), Ok(3));
    assert!(!Slots::open(&mut nor).expect("it opens").is_newer());
    assert_eq!(stored(&mut nor), b"after the downgrade");
}

#[test]
fn the_record_before_the_last_one_is_kept_whole_through_every_block_and_power_cycle() {
    let mut rng = ChaCha8Rng::seed_from_u64(19);
    let mut nor = Nor::new(3);
    let mut before: Option<Vec<u8>> = None;
    for _ in 0..40 {
        let now = record(&mut rng);
        store(&mut nor, &now).expect("it is stored");
        let mut buffer = [0; MAX_LEN];
        let mut slots = Slots::open(&mut nor).expect("it opens");
        let previous = slots.read_previous(&mut buffer).expect("it reads").to_vec();
        assert_eq!(previous, before.unwrap_or_default());
        before = Some(now);
    }
}

#[test]
fn a_cut_while_a_record_is_stored_loses_neither_the_last_one_nor_the_one_before() {
    let mut rng = ChaCha8Rng::seed_from_u64(20);
    let records: Vec<Vec<u8>> = (0..12).map(|_| record(&mut rng)).collect();
    let mut nor = Nor::new(2);
    for (index, now) in records.iter().enumerate() {
        // The power goes after each operation of the next record in turn; what counts is as before.
        for cut in 0.. {
            let mut torn = nor.clone();
            let mut slots = Slots::open(&mut torn).expect("it opens");
            let mut writing = slots.begin(now).expect("room");
            let stored = (0..=cut).any(|_| slots.step(&mut writing).expect("flash").is_some());
            let mut slots = Slots::open(&mut torn).expect("it opens");
            let (mut buffer, mut other) = ([0; MAX_LEN], [0; MAX_LEN]);
            let newest = slots.read(&mut buffer).expect("it reads").to_vec();
            let previous = slots.read_previous(&mut other).expect("it reads").to_vec();
            let kept = |at: usize| index.checked_sub(at).map(|at| records[at].clone()).unwrap_or_default();
            // A whole record without its seal may count already.
            let (was, is) = ((kept(1), kept(2)), (now.clone(), kept(1)));
            let seen = (newest, previous);
            assert!(seen == is || !stored && seen == was, "record {index}, cut after {cut} operations");
            if stored {
                nor = torn;
                break;
            }
        }
    }
}

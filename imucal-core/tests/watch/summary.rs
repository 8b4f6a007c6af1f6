//! The summary's bytes.

use crc::{CRC_32_ISO_HDLC, Crc};
use imucal_core::{
    record::{Date, SensorIdentity},
    watch::{
        Compared, MAX_LEN, Shift, Spell, StatisticSummary, SummaryError, TemperatureSeen, Watch,
        WatchSummary, decode, encode,
    },
};
use proptest::prelude::*;

use crate::{rest, settled, unit::GRADES};

const CRC_32: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

fn bytes(summary: &WatchSummary) -> Vec<u8> {
    encode(summary, &mut [0; MAX_LEN]).expect("room for it").to_vec()
}

/// Every field at its longest.
fn longest() -> WatchSummary {
    let shift = Shift {
        since: u32::MAX,
        found: u32::MAX,
        by: 1.0,
        error: 1.0,
        temperature: Some(1.0),
        compared: Compared::WithRecord,
    };
    let statistic = StatisticSummary {
        looks: u32::MAX,
        mean: 1.0,
        spread: 1.0,
        noise: 1.0,
        allowed: 1.0,
        step: [1.0; 2],
        record: [1.0; 2],
        latest: 1.0,
        alarms: u16::MAX,
        returns: u16::MAX,
        shift: Some(shift),
        spell: Some(Spell { from: u32::MAX, to: u32::MAX, by: 1.0 }),
    };
    let text = "x".repeat(32);
    WatchSummary {
        sensor: SensorIdentity { name: text.parse().unwrap(), serial: text.parse().unwrap() },
        date: Date::from_days(u32::MAX),
        false_alarms: 1.0,
        started: u32::MAX,
        ended: u32::MAX,
        watched: u32::MAX,
        rests: u32::MAX,
        rejected: u32::MAX,
        outside: u32::MAX,
        clock_jumps: u32::MAX,
        stuck: [u32::MAX; 3],
        temperature: Some(TemperatureSeen { least: 1.0, most: 1.0, changes: u32::MAX }),
        statistics: [statistic; 6],
    }
}

#[test]
fn a_summary_is_read_as_it_was_written() {
    let (mut unit, mut watch) = settled(GRADES[0], 1);
    unit.shift[1].x = 2e-3;
    rest(&mut unit, &mut watch, 100);
    let summary = watch.summary();
    let written = bytes(&summary);
    println!(
        "\nthe summary of a watch with one finding: {} bytes; its state {} bytes",
        written.len(),
        size_of::<Watch>()
    );
    assert_eq!(decode(&written), Ok(summary));
    assert!(written.len() < 512);
}

#[test]
fn the_longest_summary_has_room_and_no_byte_more() {
    assert_eq!(bytes(&longest()).len(), MAX_LEN);
    let short = encode(&longest(), &mut [0; MAX_LEN - 1]).err();
    assert_eq!(short, Some(SummaryError::Short { have: MAX_LEN - 1, need: MAX_LEN }));
}

#[test]
fn fields_that_a_newer_minor_appends_are_stepped_over() {
    let mut newer = bytes(&longest());
    newer.truncate(newer.len() - 4);
    newer.extend([1, 2, 3]);
    let length = (newer.len() - 8) as u16;
    newer[5] = 1;
    newer[6..8].copy_from_slice(&length.to_le_bytes());
    let of_minor = |minor: u8, mut bytes: Vec<u8>| {
        bytes[5] = minor;
        let checksum = CRC_32.checksum(&bytes);
        bytes.extend(checksum.to_le_bytes());
        decode(&bytes)
    };
    assert_eq!(of_minor(1, newer.clone()), Ok(longest()));
    assert_eq!(of_minor(0, newer), Err(SummaryError::Malformed));
}

proptest! {
    #[test]
    fn a_damaged_summary_is_refused(at in 0usize..300, with in 1u8..) {
        let (_, watch) = settled(GRADES[0], 2);
        let mut damaged = bytes(&watch.summary());
        let at = at % damaged.len();
        damaged[at] ^= with;
        prop_assert!(decode(&damaged).is_err());
    }

    #[test]
    fn any_bytes_are_a_summary_or_an_error(any in prop::collection::vec(any::<u8>(), 0..600), framed in any::<bool>()) {
        let mut any = any;
        if framed && any.len() >= 8 {
            any[..6].copy_from_slice(b"IMUW\x01\x00");
        }
        let _ = decode(&any).map(|summary| bytes(&summary));
    }
}

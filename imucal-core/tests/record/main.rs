//! The record's format, from outside: its bytes, its versions, and what becomes of damaged ones.
//!
//! The golden bytes were assembled in [`golden`] from the layout drawing in `imucal_core::record`, not by the encoder. Each version keeps its file for ever; `cargo test -p imucal-core --test record -- --ignored`
//! writes that of a new one, and refuses to touch one that exists.

mod golden;
mod properties;

use golden::{
    GOLDEN, GOLDEN_1_1, GOLDEN_1_2, GOLDEN_2_0, by_hand, by_hand_1_1, by_hand_1_2, by_hand_2_0, framed,
    golden_payload, golden_payload_1_1, golden_payload_1_2, golden_payload_2_0, golden_record,
    golden_record_1_1, golden_record_1_2, golden_record_2_0, raised,
};
use imucal_core::record::{
    CalibrationRecord, Date, DecodeError, Defect, EncodeError, Figures, FirstOrder, FitQuality, HigherOrder,
    MAX_LEN, Match, Order, Provenance, RawUnit, Sensor, SensorIdentity, TriadRecord, VERSION, decode,
    decode_as, decode_into, encode,
};

#[test]
#[ignore = "writes the golden bytes of a new version"]
fn write_golden_bytes() {
    use std::io::Write;
    for (version, bytes) in [("1.2", by_hand_1_2()), ("2.0", by_hand_2_0())] {
        let path = format!("{}/tests/golden/record-{version}.bin", env!("CARGO_MANIFEST_DIR"));
        let mut file =
            std::fs::File::create_new(path).expect("golden bytes exist and are never written again");
        file.write_all(&bytes).unwrap();
    }
}

#[test]
fn the_golden_bytes_are_those_of_the_layout_drawing() {
    assert_eq!(GOLDEN, by_hand());
    assert_eq!(GOLDEN_1_1, by_hand_1_1());
    assert_eq!(GOLDEN_1_2, by_hand_1_2());
    assert_eq!(GOLDEN_2_0, by_hand_2_0());
}

#[test]
fn the_golden_bytes_are_read_and_written_unchanged() {
    assert_eq!(decode(GOLDEN), Ok(golden_record()));
    assert_eq!(encode(&golden_record(), &mut [0; MAX_LEN]), Ok(GOLDEN));
    assert_eq!(decode(GOLDEN_1_1), Ok(golden_record_1_1()));
    assert_eq!(encode(&golden_record_1_1(), &mut [0; MAX_LEN]), Ok(GOLDEN_1_1));
}

#[test]
fn a_reader_of_higher_order_reads_every_version_and_writes_each_unchanged() {
    let all = [
        (GOLDEN, raised(golden_record())),
        (GOLDEN_1_1, raised(golden_record_1_1())),
        (GOLDEN_1_2, golden_record_1_2()),
        (GOLDEN_2_0, golden_record_2_0()),
    ];
    for (bytes, record) in all {
        assert_eq!(decode_as::<HigherOrder>(bytes).as_ref(), Ok(&record));
        assert_eq!(encode(&record, &mut [0; HigherOrder::MAX_LEN]), Ok(bytes));
    }
}

#[test]
fn a_record_is_read_over_another_and_keeps_nothing_of_it() {
    let mut record = golden_record_2_0();
    for (bytes, expected) in [(GOLDEN, raised(golden_record())), (GOLDEN_2_0, golden_record_2_0())] {
        assert_eq!(decode_into(bytes, &mut record), Ok(()));
        assert_eq!(record, expected);
    }
    let bare = CalibrationRecord::<HigherOrder>::empty(SensorIdentity::default(), Date::from_days(3));
    let mut page = [0; HigherOrder::MAX_LEN];
    assert_eq!(decode_into(encode(&bare, &mut page).unwrap(), &mut record), Ok(()));
    assert_eq!(record, bare);
}

/// Without its higher terms a record would correct otherwise, so a reader of first order takes none of it.
#[test]
fn a_reader_of_first_order_refuses_terms_that_change_a_value_and_skips_what_changes_none() {
    assert_eq!(decode(GOLDEN_1_2), Ok(golden_record_1_1()));
    assert_eq!(decode(GOLDEN_2_0), Err(DecodeError::UnsupportedVersion { found: 2, supported: 1 }));
    let mut curved = golden_record_2_0();
    for triad in [&mut curved.acc, &mut curved.mag] {
        triad.as_mut().unwrap().order.nonlinearity = None;
    }
    let mut page = [0; HigherOrder::MAX_LEN];
    let bytes = encode(&curved, &mut page).unwrap();
    assert_eq!(decode(bytes), Err(DecodeError::UnsupportedVersion { found: 2, supported: 1 }));
}

#[test]
fn every_truncation_says_how_much_is_missing() {
    for have in 0..GOLDEN.len() {
        let need = if have < 8 { 12 } else { GOLDEN.len() };
        assert_eq!(decode(&GOLDEN[..have]), Err(DecodeError::Truncated { have, need }));
    }
}

#[test]
fn every_single_bit_flip_is_found() {
    for bit in 0..GOLDEN.len() * 8 {
        let mut bytes = GOLDEN.to_vec();
        bytes[bit / 8] ^= 1 << (bit % 8);
        let refusal = decode(&bytes).unwrap_err();
        match bit / 8 {
            0..4 => assert_eq!(refusal, DecodeError::BadMagic),
            4 => assert!(matches!(refusal, DecodeError::UnsupportedVersion { supported: 1, .. })),
            6..8 => assert!(matches!(refusal, DecodeError::Truncated { .. } | DecodeError::BadCrc { .. })),
            _ => assert!(matches!(refusal, DecodeError::BadCrc { .. }), "bit {bit}: {refusal}"),
        }
    }
}

#[test]
fn what_follows_the_record_is_not_looked_at() {
    let mut page = GOLDEN.to_vec();
    page.resize(2048, 0xFF);
    assert_eq!(decode(&page), Ok(golden_record()));
}

#[test]
fn foreign_bytes_are_no_record() {
    for foreign in
        [&[0xFF; 600][..], &[0; 600], b"# time,acc_x,acc_y,acc_z", b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0"]
    {
        assert_eq!(decode(foreign), Err(DecodeError::BadMagic));
    }
}

#[test]
fn another_major_is_refused_even_if_intact() {
    for found in [0, 2, 255] {
        let refusal = DecodeError::UnsupportedVersion { found, supported: 1 };
        assert_eq!(decode(&framed(found, 0, golden_payload())), Err(refusal));
    }
    for found in [0, 3, 255] {
        let refusal = DecodeError::UnsupportedVersion { found, supported: 2 };
        assert_eq!(decode_as::<HigherOrder>(&framed(found, 0, golden_payload())), Err(refusal));
    }
    assert_eq!((FirstOrder::VERSION, HigherOrder::VERSION), ((1, 1), VERSION));
}

#[test]
fn a_newer_minor_with_appended_fields_is_read() {
    let mut payload = golden_payload_1_1().to_vec();
    payload.extend([1, 2, 3, 4, 5]);
    payload.resize(3000, 0x55);
    for minor in [2, 3, 255] {
        assert_eq!(decode(&framed(1, minor, &payload)), Ok(golden_record_1_1()));
        assert_eq!(decode(&framed(1, minor, golden_payload_1_1())), Ok(golden_record_1_1()));
    }
    let all = [
        (1, 2, golden_payload_1_2(), golden_record_1_2()),
        (2, 0, golden_payload_2_0(), golden_record_2_0()),
    ];
    for (major, minor, payload, record) in all {
        let payload = [payload, &[0x55; 2000]].concat();
        for minor in [minor + 1, 255] {
            assert_eq!(decode_as::<HigherOrder>(&framed(major, minor, &payload)).as_ref(), Ok(&record));
        }
    }
}

#[test]
fn bytes_after_the_last_field_of_a_minor_are_a_faulty_writer() {
    for (minor, payload) in [(0, golden_payload()), (1, golden_payload_1_1())] {
        let payload = [payload, &[0]].concat();
        assert_eq!(decode(&framed(1, minor, &payload)), Err(DecodeError::Malformed));
    }
    // What minor 1 appends is missing.
    assert_eq!(decode(&framed(1, 1, golden_payload())), Err(DecodeError::Malformed));

    let of_higher = |major, minor, payload: &[u8]| decode_as::<HigherOrder>(&framed(major, minor, payload));
    let whole = [
        (1, 0, golden_payload()),
        (1, 1, golden_payload_1_1()),
        (1, 2, golden_payload_1_2()),
        (2, 0, golden_payload_2_0()),
    ];
    for (major, minor, payload) in whole {
        assert!(of_higher(major, minor, payload).is_ok());
        assert_eq!(of_higher(major, minor, &[payload, &[0]].concat()), Err(DecodeError::Malformed));
        let short = &payload[..payload.len() - 1];
        assert_eq!(of_higher(major, minor, short), Err(DecodeError::Malformed));
    }
}

#[test]
fn a_part_of_a_triad_that_is_not_there_is_a_faulty_writer() {
    let mut payload = golden_payload_1_2().to_vec();
    // Accelerometer, gyroscope, magnetometer: what the first has becomes the second's, which the record lacks.
    let from = golden_payload_1_1().len();
    payload[from..].rotate_right(1);
    assert_eq!(payload[from..from + 2], [0, 1]);
    assert_eq!(decode_as::<HigherOrder>(&framed(1, 2, &payload)), Err(DecodeError::Malformed));
}

#[test]
fn an_unknown_unit_is_malformed() {
    let unit_in = 9 + 1 + 8 + 1 + 3 + 1 + 48;
    let mut payload = golden_payload().to_vec();
    assert_eq!(payload[unit_in], 3);
    payload[unit_in] = RawUnit::ALL.len() as u8;
    assert_eq!(decode(&framed(1, 0, &payload)), Err(DecodeError::Malformed));
}

/// Refused by the encoder, and by the decoder when a faulty writer let it pass.
fn refused_both_ways(
    spoil: impl FnOnce(&mut TriadRecord),
    payload_at: usize,
    figures: &[f32],
    defect: Defect,
) {
    let mut record = golden_record();
    spoil(record.acc.as_mut().unwrap());
    assert_eq!(encode(&record, &mut [0; MAX_LEN]), Err(EncodeError::Unusable(defect)));

    let mut payload = golden_payload().to_vec();
    for (slot, figure) in payload[payload_at..].chunks_exact_mut(4).zip(figures) {
        slot.copy_from_slice(&figure.to_le_bytes());
    }
    assert_eq!(decode(&framed(1, 0, &payload)), Err(DecodeError::Unusable(defect)));
}

#[test]
fn figures_that_are_not_finite_are_refused_both_ways() {
    let sensor = Sensor::Accelerometer;
    let at = |figures| Defect::NotFinite { sensor, figures };
    let gain = 9 + 1 + 8 + 1 + 3 + 1;
    let temperature = gain + 48 + 2 + 3 + 1;
    refused_both_ways(|acc| acc.gain[0][0] = f32::NAN, gain, &[f32::NAN], at(Figures::Gain));
    refused_both_ways(|acc| acc.bias[0] = f32::INFINITY, gain + 36, &[f32::INFINITY], at(Figures::Bias));
    refused_both_ways(
        |acc| acc.temperature.as_mut().unwrap().reference = f32::NAN,
        temperature,
        &[f32::NAN],
        at(Figures::Reference),
    );
    refused_both_ways(
        |acc| acc.quality.gain_std[0][0] = f32::NEG_INFINITY,
        temperature + 28,
        &[f32::NEG_INFINITY],
        at(Figures::GainStd),
    );
}

#[test]
fn a_singular_gain_is_refused_both_ways() {
    let gain = 9 + 1 + 8 + 1 + 3 + 1;
    let defect = Defect::Singular { sensor: Sensor::Accelerometer };
    let flat = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0];
    refused_both_ways(
        |acc| acc.gain = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]],
        gain,
        &flat,
        defect,
    );
}

#[test]
fn figures_that_no_sensor_has_are_refused_both_ways() {
    let sensor = Sensor::Accelerometer;
    let gain = 9 + 1 + 8 + 1 + 3 + 1;
    let out = |figures, value, least, most| Defect::OutOfRange { sensor, figures, value, least, most };
    let zero = out(Figures::Gain, 0.0, 1e-9, 1e3);
    refused_both_ways(|acc| acc.gain = [[0.0; 3]; 3], gain, &[0.0; 9], zero);
    let rms = gain + 48 + 2 + 3 + 1 + 28 + 48;
    let negative = out(Figures::Rms, -1.0, 0.0, 100.0);
    refused_both_ways(|acc| acc.quality.rms = -1.0, rms, &[-1.0], negative);
    let coverage = rms + 4 + 1 + 4 + 3 + 4;
    let twice = out(Figures::Coverage, 2.0, 0.0, 1.0);
    refused_both_ways(|acc| acc.quality.coverage = 2.0, coverage, &[2.0], twice);
}

#[test]
fn a_kept_triad_keeps_its_provenance_but_for_date_and_serial() {
    let original = golden_record();
    let (unit, date) = (original.sensor.clone(), original.date);
    let gyr = original.acc.clone().unwrap();
    let kept = |serial: &str, days: u32| {
        let mut record = original.clone();
        let unit = SensorIdentity { serial: serial.parse().unwrap(), ..unit.clone() };
        record.adopt(Sensor::Gyroscope, &gyr, &unit, Date::from_days(days));
        record.provenance[0].clone()
    };
    let own = Some(Provenance { serial: unit.serial.clone(), date });
    assert_eq!(kept("00300017", 20_000), None);
    assert_eq!(kept("00300017", 20_001), own);
    assert_eq!(kept("00300018", 20_000), own);
}

#[test]
fn a_triad_that_is_adopted_leaves_the_others_as_they_were_made() {
    let mut record = golden_record();
    let unit = SensorIdentity { serial: "00300018".parse().unwrap(), ..record.sensor.clone() };
    let gyr = TriadRecord { unit_in: RawUnit::RadianPerSecond, ..record.mag.clone().unwrap() };
    record.adopt(Sensor::Gyroscope, &gyr, &unit, Date::from_days(20_100));
    let (before, day) = (golden_record(), Date::from_days(20_000));
    assert_eq!((&record.acc, &record.mag), (&before.acc, &before.mag));
    for sensor in [Sensor::Accelerometer, Sensor::Magnetometer] {
        assert_eq!((record.serial_of(sensor), record.date_of(sensor)), ("00300017", day));
    }
    let gyroscope = (record.serial_of(Sensor::Gyroscope), record.date_of(Sensor::Gyroscope));
    assert_eq!(gyroscope, ("00300018", Date::from_days(20_100)));
    // A triad of another unit makes the record another unit's.
    assert!(record.made_for("00300018").is_err() && record.made_for("00300017").is_err());

    // Calibrated over again, each on the same unit: nothing of its own is left.
    for sensor in [Sensor::Accelerometer, Sensor::Magnetometer] {
        let triad = record.triad(sensor).unwrap().clone();
        record.adopt(sensor, &triad, &unit, Date::from_days(20_100));
    }
    assert_eq!(record.provenance, [const { None }; 3]);
    assert_eq!(record.made_for("00300018"), Ok(Match::Confirmed));
}

#[test]
fn a_triad_of_unknown_origin_keeps_the_record_unconfirmed() {
    let record = golden_record_1_1();
    assert_eq!(record.made_for("00300017"), Ok(Match::Unknown));
    assert!(record.made_for("00300018").is_err());
}

/// No field could be longer.
fn longest_record() -> CalibrationRecord {
    let golden = golden_record();
    let triad = |unit_out| {
        Some(TriadRecord {
            model: "12345678".parse().unwrap(),
            quality: FitQuality {
                observations: u32::MAX,
                held_out_rms: Some(1.0),
                field_norm: Some(1.0),
                ..golden.acc.as_ref().unwrap().quality
            },
            unit_out,
            ..golden.acc.clone().unwrap()
        })
    };
    let provenance = Provenance { serial: "p".repeat(32).parse().unwrap(), date: Date::from_days(u32::MAX) };
    CalibrationRecord {
        sensor: SensorIdentity {
            name: "n".repeat(32).parse().unwrap(),
            serial: "s".repeat(32).parse().unwrap(),
        },
        date: Date::from_days(u32::MAX),
        acc: triad(RawUnit::MetrePerSecondSquared),
        gyr: triad(RawUnit::RadianPerSecond),
        mag: triad(RawUnit::MicroTesla),
        provenance: [const { None }; 3].map(|_: Option<Provenance>| Some(provenance.clone())),
    }
}

#[test]
fn max_len_is_the_length_of_the_longest_record() {
    let mut buffer = [0; MAX_LEN];
    assert_eq!(encode(&longest_record(), &mut buffer).unwrap().len(), MAX_LEN);
    assert_eq!(decode(&buffer), Ok(longest_record()));
}

#[test]
fn max_len_of_higher_order_is_the_length_of_the_longest_record_of_it() {
    let mut record = raised(longest_record());
    let order = golden_record_2_0().acc.unwrap().order;
    for (triad, unit) in [
        (&mut record.acc, RawUnit::MetrePerSecondSquared),
        (&mut record.gyr, RawUnit::RadianPerSecond),
        (&mut record.mag, RawUnit::MicroTesla),
    ] {
        let longest = triad.as_mut().unwrap();
        (longest.order, longest.unit_out) = (order, unit);
    }
    let mut buffer = [0; HigherOrder::MAX_LEN];
    assert_eq!(encode(&record, &mut buffer).unwrap().len(), HigherOrder::MAX_LEN);
    assert_eq!(decode_as(&buffer), Ok(record));
}

#[test]
fn a_buffer_too_small_is_refused_with_the_exact_need() {
    let need = GOLDEN.len();
    for have in 0..need {
        let refusal = EncodeError::BufferTooSmall { have, need };
        assert_eq!(encode(&golden_record(), &mut vec![0; have]), Err(refusal));
    }
    let need = GOLDEN_2_0.len();
    for have in 0..need {
        let refusal = EncodeError::BufferTooSmall { have, need };
        assert_eq!(encode(&golden_record_2_0(), &mut vec![0; have]), Err(refusal));
    }
}

//! What holds for every record and for any bytes.

use imucal_core::nonlinearity::NonlinearTerms;
use imucal_core::record::{
    CalibrationRecord, CurvatureRecord, Date, DecodeError, FirstOrder, FitQuality, HigherOrder, MAX_LEN,
    NonlinearRecord, Order, Provenance, RawUnit, SensorIdentity, TemperatureQuality, TriadRecord, decode,
    decode_as, encode,
};
use imucal_core::temperature::{TemperatureCurvature, TemperatureTerms};
use proptest::array::{uniform3, uniform9};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;

use super::golden::{GOLDEN_1_1, GOLDEN_2_0, framed, golden_payload_1_1, golden_payload_2_0, raised};

/// Any size within ±`most`.
fn figure(most: f32) -> impl Strategy<Value = f32> {
    let size = (-30.0f32..0.0).prop_map(|decade| 10f32.powf(decade));
    (size, any::<bool>()).prop_map(move |(size, minus)| if minus { -most * size } else { most * size })
}

fn positive(most: f32) -> impl Strategy<Value = f32> {
    figure(most).prop_map(f32::abs)
}

/// Any triad that can be: gains from counts with a dominant diagonal, every other figure within its limits.
fn triad(unit_out: RawUnit) -> impl Strategy<Value = TriadRecord> {
    let gain = (uniform9(-0.3f32..0.3), -6i32..2).prop_map(|(skew, decade)| {
        let entry = |i: usize| (skew[i] + if i.is_multiple_of(4) { 1.0 } else { 0.0 }) * 10f32.powi(decade);
        [[entry(0), entry(1), entry(2)], [entry(3), entry(4), entry(5)], [entry(6), entry(7), entry(8)]]
    });
    let temperature = (-40f32..125.0, uniform3(figure(1e5)), uniform3(figure(0.01))).prop_map(
        |(reference, bias_slope, scale_slope)| TemperatureTerms { reference, bias_slope, scale_slope },
    );
    let quality = (
        (
            uniform3(uniform3(positive(1e-7))),
            uniform3(positive(1e4)),
            positive(10.0),
            option::of(positive(10.0)),
        ),
        (any::<u32>(), any::<u8>(), 1f32..1e6, 0f32..=1.0, option::of(1e-3f32..1e6)),
    )
        .prop_map(
            |(
                (gain_std, bias_std, rms, held_out_rms),
                (observations, parameters, condition, coverage, field_norm),
            )| {
                FitQuality {
                    gain_std,
                    bias_std,
                    rms,
                    held_out_rms,
                    observations,
                    parameters,
                    condition,
                    coverage,
                    field_norm,
                }
            },
        );
    (gain, uniform3(figure(4e9)), "[A-Z0-9+]{0,8}", option::of(temperature), quality).prop_map(
        move |(gain, bias, model, temperature, quality)| TriadRecord {
            gain,
            bias,
            unit_in: RawUnit::Counts,
            unit_out,
            model: model.parse().unwrap(),
            temperature,
            quality,
            order: FirstOrder,
        },
    )
}

/// Any terms of higher order that a triad of counts can have, with temperature terms or without.
fn order(warm: bool) -> impl Strategy<Value = HigherOrder> {
    let curvature = |bias, scale| {
        (uniform3(bias), uniform3(scale)).prop_map(|(bias, scale)| TemperatureCurvature { bias, scale })
    };
    let warmth = ((-40f32..125.0, 0f32..100.0), uniform3(positive(1e5)), uniform3(positive(0.01))).prop_map(
        |((least, width), bias_slope_std, scale_slope_std)| TemperatureQuality {
            span: [least, least + width],
            bias_slope_std,
            scale_slope_std,
        },
    );
    let curvature = (
        curvature(figure(1e4).boxed(), figure(1e-4).boxed()),
        curvature(positive(1e4).boxed(), positive(1e-4).boxed()),
    )
        .prop_map(|(terms, std)| CurvatureRecord { terms, std });
    // Each of five terms of a row takes a sixth of the slope that is allowed.
    let terms = |entry: fn(f32) -> BoxedStrategy<f32>| {
        let share = || uniform3(entry(0.016));
        (share(), share(), uniform3(share()))
    };
    let nonlinearity = (1f32..1e5, terms(|most| figure(most).boxed()), terms(|most| positive(most).boxed()))
        .prop_map(|(range, terms, std)| {
            let over = |(quadratic, cubic, cross): ([f32; 3], [f32; 3], [[f32; 3]; 3])| {
                let first = |x: f32| x / (2.0 * range);
                NonlinearTerms {
                    quadratic: quadratic.map(first),
                    cubic: cubic.map(|x| x / (3.0 * range * range)),
                    cross: cross.map(|row| row.map(first)),
                }
            };
            NonlinearRecord { range, terms: over(terms), std: over(std) }
        });
    (option::of(warmth), option::of(curvature), option::of(nonlinearity)).prop_map(
        move |(warmth, curvature, nonlinearity)| HigherOrder {
            warmth: warmth.filter(|_| warm),
            curvature: curvature.filter(|_| warm),
            nonlinearity,
        },
    )
}

/// Any record of higher order.
fn higher() -> impl Strategy<Value = CalibrationRecord<HigherOrder>> {
    let orders = |record: &CalibrationRecord| {
        let warm = |triad: &Option<TriadRecord>| triad.as_ref().is_some_and(|t| t.temperature.is_some());
        (order(warm(&record.acc)), order(warm(&record.gyr)), order(warm(&record.mag)))
    };
    record().prop_flat_map(move |record| (orders(&record), Just(record))).prop_map(
        |((acc, gyr, mag), record)| {
            let mut record = raised(record);
            for (triad, order) in [(&mut record.acc, acc), (&mut record.gyr, gyr), (&mut record.mag, mag)] {
                if let Some(triad) = triad {
                    triad.order = order;
                }
            }
            record
        },
    )
}

fn provenance() -> impl Strategy<Value = Provenance> {
    ("[ -~]{0,32}", any::<u32>()).prop_map(|(serial, days)| Provenance {
        serial: serial.parse().unwrap(),
        date: Date::from_days(days),
    })
}

prop_compose! {
    fn record()(name in "[ -~]{0,32}|[µΩé]{0,16}", serial in "[ -~]{0,32}", days in any::<u32>(),
                acc in option::of(triad(RawUnit::MetrePerSecondSquared)),
                gyr in option::of(triad(RawUnit::RadianPerSecond)),
                mag in option::of(triad(RawUnit::MicroTesla)),
                provenance in uniform3(option::of(provenance()))) -> CalibrationRecord {
        let sensor = SensorIdentity { name: name.parse().unwrap(), serial: serial.parse().unwrap() };
        CalibrationRecord { sensor, date: Date::from_days(days), acc, gyr, mag, provenance }
    }
}

proptest! {
    #[test]
    fn every_usable_record_comes_back_as_it_was(record in record()) {
        let mut buffer = [0; MAX_LEN];
        let bytes = encode(&record, &mut buffer).unwrap();
        prop_assert_eq!(decode(bytes), Ok(record));
    }

    #[test]
    fn every_usable_record_of_higher_order_comes_back_as_it_was(record in higher()) {
        let mut buffer = [0; HigherOrder::MAX_LEN];
        let bytes = encode(&record, &mut buffer).unwrap();
        let changes = record.triads().any(|(_, t)| t.order.curvature.is_some() || t.order.nonlinearity.is_some());
        let refusal = DecodeError::UnsupportedVersion { found: 2, supported: 1 };
        prop_assert_eq!(decode(bytes).err(), changes.then_some(refusal));
        prop_assert_eq!(decode_as(bytes), Ok(record));
    }

    /// A record of first order has the same bytes, whatever the type that holds it.
    #[test]
    fn what_needs_nothing_newer_is_written_as_it_was(record in record()) {
        let (mut buffer, mut longer) = ([0; MAX_LEN], [0; HigherOrder::MAX_LEN]);
        let bytes = encode(&record, &mut buffer);
        let raised = raised(record.clone());
        prop_assert_eq!(encode(&raised, &mut longer), bytes);
    }

    #[test]
    fn a_damaged_payload_of_higher_order_never_panics(at in 0..GOLDEN_2_0.len() - 12, byte in any::<u8>(), cut in 0..GOLDEN_2_0.len()) {
        let mut payload = golden_payload_2_0().to_vec();
        payload[at] = byte;
        payload.truncate(cut);
        if let Ok(record) = decode_as::<HigherOrder>(&framed(2, 0, &payload)) {
            prop_assert!(encode(&record, &mut [0; HigherOrder::MAX_LEN]).is_ok());
        }
    }

    #[test]
    fn arbitrary_bytes_are_refused(bytes in vec(any::<u8>(), 0..1024)) {
        prop_assert!(decode(&bytes).is_err());
    }

    /// With magic, version and checksum in order, so that the payload is really parsed.
    #[test]
    fn an_arbitrary_payload_never_panics_and_what_is_read_can_be_written(payload in vec(any::<u8>(), 0..1024)) {
        if let Ok(record) = decode(&framed(1, 1, &payload)) {
            prop_assert!(encode(&record, &mut [0; MAX_LEN]).is_ok());
        }
        if let Ok(record) = decode_as::<HigherOrder>(&framed(2, 0, &payload)) {
            prop_assert!(encode(&record, &mut [0; HigherOrder::MAX_LEN]).is_ok());
        }
    }

    /// Nearly right payloads reach further into the parser than arbitrary ones.
    #[test]
    fn a_damaged_payload_with_a_valid_checksum_never_panics(at in 0..GOLDEN_1_1.len() - 12, byte in any::<u8>(), cut in 0..GOLDEN_1_1.len()) {
        let mut payload = golden_payload_1_1().to_vec();
        payload[at] = byte;
        payload.truncate(cut);
        if let Ok(record) = decode(&framed(1, 1, &payload)) {
            prop_assert!(encode(&record, &mut [0; MAX_LEN]).is_ok());
        }
    }
}

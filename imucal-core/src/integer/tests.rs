use super::*;
use crate::record::{FirstOrder, FitQuality, Sensor};
use crate::temperature::Warmth;
use nalgebra::Matrix3;
use proptest::array::uniform3;
use proptest::prelude::*;
use std::string::ToString;
use std::vec::Vec;

/// Sensors of 16 bits as they are built: ±16 g in m/s², ±2000 °/s in rad/s, ±4900 µT, and the q of the table above.
fn sensors() -> [(Triad<f32>, i8); 3] {
    let gain = Matrix3::new(1.02, -0.011, 0.006, -0.004, 0.985, 0.009, 0.013, 0.002, 1.013);
    [
        (9.80665f32 / 2048.0, [61.0, -130.5, 347.25], 22),
        (2000.0 / 32_768.0 * 0.017_453_293, [-12.0, 35.5, 11.0], 24),
        (0.15, [1800.0, -3100.0, 1250.0], 17),
    ]
    .map(|(scale, bias, fraction)| (Triad { gain: gain * scale, bias: Vector3::from(bias) }, fraction))
}

/// A triad of counts as wide as `record::plausibility` lets one be: columns of any direction that are not dependent, within a
/// factor of nine, at any scale.
fn triad() -> impl Strategy<Value = Triad<f64>> {
    let column = || (uniform3(-1f64..1.0), 1f64..9.0);
    let gain = ((column(), column(), column()), -9f64..3.0);
    let scaled = gain.prop_filter_map("dependent", |((a, b, c), scale)| {
        let [a, b, c] = [a, b, c].map(|(direction, length)| {
            Vector3::from(direction).normalize() * (length / 9.0 * libm::pow(10.0, scale))
        });
        let triad = Triad { gain: Matrix3::from_columns(&[a, b, c]), bias: Vector3::zeros() };
        (triad.is_finite() && !triad.is_singular()).then_some(triad)
    });
    (scaled, uniform3(-24_576f64..24_576.0))
        .prop_map(|(triad, bias)| Triad { bias: Vector3::from(bias), ..triad })
}

/// Terms up to the limits of `record::plausibility` for counts of 16 bits.
fn terms() -> impl Strategy<Value = TemperatureTerms<f64>> {
    (-100f64..250.0, uniform3(-245f64..245.0), uniform3(-0.01f64..0.01)).prop_map(
        |(reference, bias_slope, scale_slope)| TemperatureTerms { reference, bias_slope, scale_slope },
    )
}

/// Counts, of which the ends of the range are not rare.
fn counts() -> impl Strategy<Value = [i16; 3]> {
    uniform3(prop_oneof![4 => any::<i16>(), 1 => Just(i16::MIN), 1 => Just(i16::MAX), 1 => Just(0)])
}

/// Most that the parts of an axis can add up to, by magnitude: `Σ |gain| · (|counts| + |bias|)`, calibrated unit.
fn reach(triad: &Triad<f64>, terms: Option<&TemperatureTerms<f64>>) -> f64 {
    let (drift, growth) = terms.map_or(([0.0; 3], [0.0; 3]), |w| (w.bias_slope, w.scale_slope));
    let axis = |row: usize| {
        let sum =
            |j: usize| triad.gain[(row, j)].abs() * (32_768.0 + triad.bias[j].abs() + 256.0 * drift[j].abs());
        (0..3).map(sum).sum::<f64>() * (1.0 + 256.0 * growth[row].abs())
    };
    (0..3).map(axis).fold(0.0, f64::max)
}

fn wide(triad: &Triad<f32>) -> Triad<f64> {
    Triad { gain: triad.gain.map(f64::from), bias: triad.bias.map(f64::from) }
}

/// The gain, row by row.
fn by_row(triad: &Triad<f64>) -> [[f64; 3]; 3] {
    triad.gain.transpose().into()
}

fn correct(row: &Row, [x, y, z]: [i32; 3]) -> i32 {
    row.correct(x, y, z)
}

/// c of a row, and k with half a unit.
fn whole(row: &Row) -> ([i64; 3], i64) {
    let ([k, a, b, c], [rest, d, e, f]) = (row.high.map(i64::from), row.low.map(i64::from));
    ([(a, d), (b, e), (c, f)].map(|(high, low)| (high << LOW) + low), (k << LOW) + rest)
}

/// The largest error of a row over all counts, units of `out`: of each entry by all of its counts, of k, of the result.
fn largest_error(row: &Row, gain: [f64; 3], bias: [f64; 3], fraction: i8) -> f64 {
    let unit = power(i32::from(fraction) + LOW);
    let (c, k) = whole(row);
    let exact = gain.map(|entry| entry * unit);
    let axis = |j: usize| {
        let off = c[j] as f64 - exact[j];
        (i16::MIN..=i16::MAX).map(|count| (off * f64::from(count)).abs()).fold(0.0, f64::max)
    };
    let constant = -(0..3).map(|j| exact[j] * bias[j]).sum::<f64>();
    let half = f64::from(1 << (LOW - 1));
    // What rounds here, in double precision.
    let slack = exact.iter().map(|entry| entry.abs()).sum::<f64>() * 131_072.0 * 8.0 * f64::EPSILON;
    let below = (0..3).map(axis).sum::<f64>() + (k as f64 - half - constant).abs() + slack;
    below / (2.0 * half) + 0.5
}

/// Holds a row against the sum that it stands for, over all counts of each axis, with ends and middle of the others.
fn rows_are_their_sums(corrector: &IntegerCorrector) {
    for row in &corrector.rows {
        let (c, k) = whole(row);
        for axis in 0..3 {
            for [p, q] in [[-32_768, -32_768], [32_767, -32_768], [0, 0], [-32_768, 32_767], [32_767, 32_767]]
            {
                for count in i32::from(i16::MIN)..=i16::MAX.into() {
                    let mut raw = [count, p, q];
                    raw.rotate_right(axis);
                    let sum = k + (0..3).map(|j| c[j] * i64::from(raw[j])).sum::<i64>();
                    assert_eq!(i64::from(correct(row, raw)), sum >> LOW, "{row:?} {raw:?}");
                }
            }
        }
    }
}

#[test]
fn no_counts_whatever_leave_the_bound() {
    for (triad, usual) in sensors() {
        let finest = finest(&triad, None).unwrap();
        assert!(usual <= finest, "{usual} of {finest}");
        for fraction in [finest, usual, 9] {
            let corrector = IntegerCorrector::new(&triad, fraction).unwrap();
            rows_are_their_sums(&corrector);
            for (row, gain) in corrector.rows.iter().zip(by_row(&wide(&triad))) {
                let error = largest_error(row, gain, triad.bias.map(f64::from).into(), fraction);
                assert!(error <= BOUND, "{error} at {fraction}");
            }
        }
    }
}

#[test]
fn the_table_of_scales_holds() {
    let table = [(2.4e-7, 4.8e-7), (6.0e-8, 1.2e-7), (7.6e-6, 1.5e-5)];
    for ((triad, fraction), (unit, bound)) in sensors().into_iter().zip(table) {
        let corrector = IntegerCorrector::new(&triad, fraction).unwrap();
        let near = |a: f64, b: f64| (a / b - 1.0).abs() < 0.03;
        assert!(near(corrector.value([1, 0, 0]).x, unit) && near(corrector.bound(), bound), "{fraction}");
    }
}

#[test]
fn an_accelerometer_errs_a_tenth_of_what_single_precision_does() {
    let (triad, fraction) = sensors()[0];
    let (corrector, exact) = (IntegerCorrector::new(&triad, fraction).unwrap(), wide(&triad));
    let (mut integers, mut single) = (0f64, 0f64);
    for step in 0..200_000u32 {
        let raw = [7_919, 27_644_437, 2_097_593].map(|odd: u32| (step.wrapping_mul(odd) >> 3) as i16);
        let reference = exact.correct(&Vector3::from(raw.map(f64::from)));
        integers = integers.max((corrector.value(corrector.apply(raw)) - reference).amax());
        let by_single = triad.correct(&Vector3::from(raw.map(f32::from))).map(f64::from);
        single = single.max((by_single - reference).amax());
    }
    std::println!("largest error: {integers:.2e} m/s² in integers, {single:.2e} m/s² in f32");
    assert!(integers <= corrector.bound() && 10.0 * integers < single, "{integers:e} {single:e}");
}

proptest! {
    #[test]
    fn no_counts_of_any_triad_leave_the_bound_at_any_temperature(
        t in triad(), w in terms(), coarser in 0i8..20, change in -255.9f64..255.9,
    ) {
        let fraction = finest(&t, Some(&w)).unwrap() - coarser;
        let mut compensator = IntegerCompensator::new(&t, Some(&w), fraction).unwrap();
        let reading = (w.reference + change) as f32;
        for warmth in [Warmth::none(&t), w.at(&t, reading.into())] {
            for ((row, gain), factor) in compensator.corrector.rows.iter().zip(by_row(&t)).zip(&warmth.factor) {
                let gain = gain.map(|entry| entry * factor);
                let error = largest_error(row, gain, warmth.bias.into(), fraction);
                prop_assert!(error <= BOUND, "{}", error);
            }
            compensator.set_temperature(reading);
        }
    }

    #[test]
    fn integers_correct_as_the_reference_does_within_the_bound(
        t in triad(), w in prop::option::of(terms()), coarser in 0i8..20, change in -255.9f64..255.9,
        samples in prop::collection::vec(counts(), 1..200),
    ) {
        let fraction = finest(&t, w.as_ref()).unwrap() - coarser;
        let mut compensator = IntegerCompensator::new(&t, w.as_ref(), fraction).unwrap();
        let temperature = (w.map_or(0.0, |w| w.reference) + change) as f32;
        compensator.set_temperature(temperature);
        for raw in samples {
            let of = Vector3::from(raw.map(f64::from));
            let reference = w.map_or_else(|| t.correct(&of), |w| w.correct(&t, &of, temperature.into()));
            let error = (compensator.corrector().value(compensator.apply(raw)) - reference).amax();
            prop_assert!(error <= compensator.corrector().bound(), "{} of {}", error, compensator.corrector().bound());
        }
    }

    #[test]
    fn no_sum_of_any_triad_leaves_32_bits_at_any_temperature(
        t in triad(), w in terms(), coarser in 0i8..4, change in prop_oneof![Just(-255.9), -255.9..255.9, Just(255.9)],
    ) {
        let fraction = finest(&t, Some(&w)).unwrap() - coarser;
        let mut compensator = IntegerCompensator::new(&t, Some(&w), fraction).unwrap();
        compensator.set_temperature((w.reference + change) as f32);
        for row in compensator.corrector.rows {
            let most = |[k, a, b, c]: [i32; 4]| {
                let [k, a, b, c] = [k, a, b, c].map(|part| i64::from(part).abs());
                k + 32_768 * (a + b + c)
            };
            let low = most(row.low);
            prop_assert!(low <= i32::MAX.into());
            prop_assert!(most(row.high) + (low >> LOW) < i32::MAX.into(), "{:?}", row);
        }
    }

    #[test]
    fn every_plausible_record_of_signed_counts_fits_a_scale_and_no_finer(t in triad(), w in prop::option::of(terms())) {
        let record = record(t, w);
        prop_assume!(record.check(Sensor::Accelerometer).is_ok());
        let finest = finest(&record.triad::<f32>(), record.temperature.as_ref()).unwrap();
        prop_assert!(finest < i8::MAX);
        prop_assert!(IntegerCompensator::from_record(&record, finest).is_ok());
        let refused = IntegerCompensator::from_record(&record, finest + 1).unwrap_err();
        prop_assert_eq!(refused, IntegerRefusal::TooFine { fraction: finest + 1, finest });
        // Nor would a finer one be safe: by the interval of every count and reading, its parts may leave 32 bits.
        let most = reach(&record.triad(), record.temperature.map(|w| w.cast()).as_ref());
        prop_assert!(most * power(i32::from(finest) + 1) * (1.0 + power(-14)) >= power(31) * (1.0 - 1e-9));
    }

    #[test]
    fn whatever_the_figures_a_triad_is_refused_or_corrected_without_overflow(
        gain in uniform3(uniform3(any::<f64>())), bias in uniform3(any::<f64>()), fraction in any::<i8>(), raw in counts(),
    ) {
        let t = Triad { gain: Matrix3::from(gain), bias: Vector3::from(bias) };
        if let Ok(corrector) = IntegerCorrector::new(&t, fraction) {
            let error = (corrector.value(corrector.apply(raw)) - t.correct(&Vector3::from(raw.map(f64::from)))).amax();
            prop_assert!(error <= corrector.bound());
        }
    }

    #[test]
    fn a_compensator_has_the_integers_of_the_last_reading_alone(
        readings in prop::collection::vec(-40f32..85.0, 1..8), raw in counts(),
    ) {
        let (triad, fraction) = sensors()[0];
        let terms = TemperatureTerms { reference: 25.0, bias_slope: [0.5, -1.0, 0.25], scale_slope: [1e-4, -2e-4, 3e-4] };
        let new = || IntegerCompensator::new(&triad, Some(&terms), fraction).unwrap();
        let (mut following, mut fresh) = (new(), new());
        for reading in &readings {
            following.set_temperature(*reading);
        }
        fresh.set_temperature(*readings.last().unwrap());
        prop_assert_eq!(following.apply(raw), fresh.apply(raw));
        prop_assert_eq!(following, fresh);
    }
}

/// A record of counts in m/s².
fn record(triad: Triad<f64>, temperature: Option<TemperatureTerms<f64>>) -> TriadRecord {
    let single = |rows: [[f64; 3]; 3]| rows.map(|row| row.map(|entry| entry as f32));
    TriadRecord {
        gain: single(by_row(&triad)),
        bias: triad.bias.map(|bias| bias as f32).into(),
        unit_in: RawUnit::Counts,
        unit_out: RawUnit::MetrePerSecondSquared,
        model: "T9".parse().unwrap(),
        temperature: temperature.map(|terms| terms.cast()),
        quality: FitQuality {
            gain_std: [[0.0; 3]; 3],
            bias_std: [0.0; 3],
            rms: 0.0,
            held_out_rms: None,
            observations: 40,
            parameters: 9,
            condition: 1.0,
            coverage: 1.0,
            field_norm: None,
        },
        order: FirstOrder,
    }
}

#[test]
fn a_dead_thermometer_counts_as_the_reference() {
    let (triad, fraction) = sensors()[0];
    let terms = TemperatureTerms { reference: 25.0, bias_slope: [5.0; 3], scale_slope: [0.0; 3] };
    let mut compensator = IntegerCompensator::new(&triad, Some(&terms), fraction).unwrap();
    let cold = compensator.apply([1000; 3]);
    for dead in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -273.15, 281.5] {
        compensator.set_temperature(35.0);
        assert_ne!(compensator.apply([1000; 3]), cold);
        compensator.set_temperature(dead);
        assert_eq!(compensator.apply([1000; 3]), cold, "{dead}");
    }
}

#[test]
fn without_terms_the_temperature_changes_nothing() {
    let (triad, fraction) = sensors()[1];
    let mut compensator = IntegerCompensator::new(&triad, None, fraction).unwrap();
    compensator.set_temperature(60.0);
    let plain = IntegerCorrector::new(&triad, fraction).unwrap();
    assert_eq!(compensator.apply([100, -200, 300]), plain.apply([100, -200, 300]));
}

#[test]
fn ties_round_up_and_the_ends_of_the_range_are_exact() {
    let triad = Triad { gain: Matrix3::from_diagonal_element(0.5f64), bias: Vector3::zeros() };
    let corrector = IntegerCorrector::new(&triad, 0).unwrap();
    assert_eq!(corrector.apply([1, -1, 3]), [1, 0, 2]);
    assert_eq!(corrector.apply([i16::MIN, i16::MAX, 0]), [-16_384, 16_384, 0]);
    assert_eq!(corrector.value([-16_384, 1, i32::MAX]), Vector3::new(-16_384.0, 1.0, 2_147_483_647.0));
}

#[test]
fn each_refusal_names_its_figures() {
    let with = |gain: f64, bias: f64| Triad {
        gain: Matrix3::from_diagonal_element(gain),
        bias: Vector3::new(0.0, bias, 0.0),
    };
    let refused = |triad: Triad<f64>, fraction| IntegerCorrector::new(&triad, fraction).unwrap_err();
    let texts: Vec<_> = [
        refused(with(f64::NAN, 0.0), 0),
        refused(with(1.0, 32_500.0), 0),
        refused(with(1.0, 0.0), 16),
        refused(with(1e60, 0.0), -128),
    ]
    .map(|refusal| refusal.to_string())
    .into();
    let expected = [
        "a figure of the triad is not finite",
        "the bias of axis 1 is 32500.0 counts, expected -24576 to 24576",
        "16 bits behind the point overflow 32 bits, 15 do not",
        "values up to 2^215 fit no scale of 32 bits",
    ];
    assert_eq!(texts, expected);
    let steep = TemperatureTerms { reference: 25.0, bias_slope: [0.0, -300.0, 0.0], scale_slope: [0.0; 3] };
    let refused = IntegerCompensator::new(&with(1.0, 0.0), Some(&steep), 9).unwrap_err();
    assert_eq!(refused.to_string(), "a temperature term is -300, expected at most 256 by magnitude");
    let foreign = TriadRecord { unit_in: RawUnit::StandardGravity, ..record(with(1.0, 0.0), None) };
    let refused = IntegerCorrector::from_record(&foreign, 9).unwrap_err();
    assert_eq!(refused, IntegerRefusal::NotCounts { unit: RawUnit::StandardGravity });
    assert_eq!(refused.to_string(), "raw samples are in g, not in counts");
}

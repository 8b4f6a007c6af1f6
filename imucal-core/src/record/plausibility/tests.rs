use super::*;
use crate::record::{FirstOrder, HigherOrder};
use crate::temperature::TemperatureCurvature;
use std::string::ToString;

/// A fit as it is accepted.
fn triad(unit_in: RawUnit, unit_out: RawUnit, gain: f32) -> TriadRecord {
    TriadRecord {
        gain: [[gain, 0.01 * gain, 0.0], [0.0, gain, 0.0], [0.0, 0.0, 0.9 * gain]],
        bias: [0.0; 3],
        unit_in,
        unit_out,
        model: "T9".parse().unwrap(),
        temperature: None,
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

/// The units of a sensor, the SI side first, and the size of each.
const UNITS: [(Sensor, &[(RawUnit, f64)]); 3] = [
    (
        Sensor::Accelerometer,
        &[
            (RawUnit::MetrePerSecondSquared, 1.0),
            (RawUnit::StandardGravity, 9.80665),
            (RawUnit::MilliGravity, 9.80665e-3),
        ],
    ),
    (
        Sensor::Gyroscope,
        &[(RawUnit::RadianPerSecond, 1.0), (RawUnit::DegreePerSecond, core::f64::consts::PI / 180.0)],
    ),
    (
        Sensor::Magnetometer,
        &[
            (RawUnit::MicroTesla, 1.0),
            (RawUnit::MilliGauss, 0.1),
            (RawUnit::Gauss, 100.0),
            (RawUnit::NanoTesla, 1e-3),
        ],
    ),
];

#[test]
fn accepted_gains_pass_in_every_unit_and_wrong_units_do_not() {
    for (sensor, units) in UNITS {
        for (unit, size) in units {
            let of = |gain: f64| triad(*unit, units[0].0, gain as f32).check(sensor);
            for factor in [0.5, 1.0, 2.0] {
                assert_eq!(of(factor * size), Ok(()), "{unit:?}");
            }
            for (_, other) in units.iter().filter(|(other, _)| other != unit) {
                let refused = of(*other).unwrap_err();
                assert!(matches!(refused, Defect::OutOfRange { figures: Figures::Gain, .. }), "{refused}");
            }
        }
    }
}

#[test]
fn a_gain_to_a_unit_that_is_not_the_si_side_is_held_to_their_ratio() {
    let of =
        |gain: f32| triad(RawUnit::MilliGravity, RawUnit::StandardGravity, gain).check(Sensor::Accelerometer);
    for gain in [5e-4, 1e-3, 2e-3] {
        assert_eq!(of(gain), Ok(()), "{gain}");
    }
    for gain in [1e-4, 9.6e-2, 1.0] {
        assert!(of(gain).is_err(), "{gain}");
    }
}

#[test]
fn every_sensor_takes_its_own_units_alone() {
    for (sensor, units) in UNITS {
        for unit in RawUnit::ALL {
            let own = units.iter().any(|(each, _)| *each == unit)
                || unit == RawUnit::Counts
                || (unit == RawUnit::Arbitrary && sensor == Sensor::Magnetometer);
            let found = triad(unit, unit, 1.0).check(sensor);
            assert_eq!(found, if own { Ok(()) } else { Err(Defect::ForeignUnit { sensor, unit }) });
        }
    }
}

#[test]
fn counts_of_every_converter_pass_and_a_scale_of_no_converter_does_not() {
    let of =
        |gain: f32| triad(RawUnit::Counts, RawUnit::MetrePerSecondSquared, gain).check(Sensor::Accelerometer);
    // 24 bits of ±0.2 m/s², 16 bits of ±16 g, 8 bits of ±200 g.
    for gain in [2.4e-8, 4.8e-3, 15.3] {
        assert_eq!(of(gain), Ok(()), "{gain}");
    }
    for gain in [1e-12, 1e-30, 1e5, 1e30] {
        assert!(of(gain).is_err(), "{gain}");
    }
}

#[test]
fn each_figure_is_held_to_its_limits_and_named_with_them() {
    type Spoil = fn(&mut TriadRecord, f32);
    let spoiled: [(Figures, Spoil, &[f32], &[f32]); 11] = [
        (Figures::AxisRatio, |t, x| (t.unit_in, t.gain[1][1]) = (RawUnit::Counts, x), &[0.25], &[0.1]),
        (Figures::Bias, |t, x| t.bias[2] = x, &[-99.0, 99.0], &[-101.0, 101.0]),
        (Figures::Reference, |t, x| warm(t).reference = x, &[-40.0, 125.0], &[-101.0, 298.15]),
        (Figures::BiasSlope, |t, x| warm(t).bias_slope[1] = x, &[-0.9, 0.9], &[-1.1, 1.1]),
        (Figures::ScaleSlope, |t, x| warm(t).scale_slope[0] = x, &[-9e-3], &[-0.02, 0.02]),
        (Figures::GainStd, |t, x| t.quality.gain_std[0][1] = x, &[0.0, 0.9], &[-1e-9, 1.1]),
        (Figures::BiasStd, |t, x| t.quality.bias_std[0] = x, &[0.0, 99.0], &[-1e-9, 101.0]),
        (Figures::Rms, |t, x| t.quality.rms = x, &[0.0, 99.0], &[-1e-9, 101.0]),
        (Figures::HeldOutRms, |t, x| t.quality.held_out_rms = Some(x), &[0.0], &[-1e-9, 101.0]),
        (Figures::Condition, |t, x| t.quality.condition = x, &[1.0, 1e6], &[-3.0, 0.0, 0.9]),
        (Figures::Coverage, |t, x| t.quality.coverage = x, &[0.0, 1.0], &[-1e-9, 1.001]),
    ];
    for (figures, spoil, passing, refused) in spoiled {
        let of = |x: f32| {
            let mut triad = triad(RawUnit::MetrePerSecondSquared, RawUnit::MetrePerSecondSquared, 1.0);
            spoil(&mut triad, x);
            triad.check(Sensor::Accelerometer)
        };
        for x in passing {
            assert_eq!(of(*x), Ok(()), "{figures:?} {x}");
        }
        for x in refused {
            let defect = of(*x).unwrap_err();
            assert!(matches!(defect, Defect::OutOfRange { figures: at, .. } if at == figures), "{defect}");
            assert!(defect.to_string().contains(figures.name()), "{defect}");
        }
        for x in [f32::NAN, f32::INFINITY] {
            let at = of(x).unwrap_err();
            assert!(matches!(at, Defect::NotFinite { .. }), "{figures:?}: {at}");
        }
    }
}

fn warm(triad: &mut TriadRecord) -> &mut TemperatureTerms<f32> {
    triad.temperature.get_or_insert(TemperatureTerms {
        reference: 25.0,
        bias_slope: [0.0; 3],
        scale_slope: [0.0; 3],
    })
}

/// A triad with every part of higher order, each of them as sensors have it.
fn full() -> TriadRecord<HigherOrder> {
    let mut linear = triad(RawUnit::MetrePerSecondSquared, RawUnit::MetrePerSecondSquared, 1.0);
    warm(&mut linear);
    let terms = NonlinearTerms { quadratic: [1e-4, 0.0, -1e-4], ..NonlinearTerms::none() };
    let (nothing, range) = (TemperatureCurvature { bias: [0.0; 3], scale: [0.0; 3] }, 100.0);
    linear.with_order(HigherOrder {
        warmth: Some(TemperatureQuality {
            span: [-20.0, 60.0],
            bias_slope_std: [0.0; 3],
            scale_slope_std: [0.0; 3],
        }),
        curvature: Some(CurvatureRecord { terms: nothing, std: nothing }),
        nonlinearity: Some(NonlinearRecord { range, terms, std: NonlinearTerms::none() }),
    })
}

#[test]
fn each_figure_of_higher_order_is_held_to_its_limits_and_named_with_them() {
    type Spoil = fn(&mut HigherOrder, f32);
    fn warmth(order: &mut HigherOrder) -> &mut TemperatureQuality {
        order.warmth.as_mut().unwrap()
    }
    fn curvature(order: &mut HigherOrder) -> &mut CurvatureRecord {
        order.curvature.as_mut().unwrap()
    }
    fn nonlinearity(order: &mut HigherOrder) -> &mut NonlinearRecord {
        order.nonlinearity.as_mut().unwrap()
    }
    let spoiled: [(Figures, Spoil, &[f32], &[f32]); 14] = [
        (Figures::TemperatureSpan, |o, x| warmth(o).span[0] = x, &[-40.0, 60.0], &[-101.0, 61.0]),
        (Figures::TemperatureSpan, |o, x| warmth(o).span[1] = x, &[-20.0, 125.0], &[-21.0, 251.0]),
        (Figures::BiasSlopeStd, |o, x| warmth(o).bias_slope_std[2] = x, &[0.9], &[-1e-9, 1.1]),
        (Figures::ScaleSlopeStd, |o, x| warmth(o).scale_slope_std[1] = x, &[9e-3], &[-1e-9, 0.02]),
        (Figures::BiasCurvature, |o, x| curvature(o).terms.bias[0] = x, &[-9e-3, 9e-3], &[-0.02, 0.02]),
        (Figures::ScaleCurvature, |o, x| curvature(o).terms.scale[0] = x, &[-9e-5], &[-2e-4, 2e-4]),
        (Figures::BiasCurvatureStd, |o, x| curvature(o).std.bias[1] = x, &[9e-3], &[-1e-9, 0.02]),
        (Figures::ScaleCurvatureStd, |o, x| curvature(o).std.scale[1] = x, &[9e-5], &[-1e-9, 2e-4]),
        (Figures::NonlinearRange, |o, x| nonlinearity(o).range = x, &[1.0, 490.0], &[-1.0, 0.0, 2e4]),
        // 2 · 100 · 1e-4 of the quadratic term is there already.
        (Figures::Nonlinearity, |o, x| nonlinearity(o).terms.quadratic[0] = x, &[-4.9e-4], &[5.1e-4]),
        (Figures::Nonlinearity, |o, x| nonlinearity(o).terms.cubic[0] = x, &[2.6e-6], &[-2.8e-6]),
        (Figures::Nonlinearity, |o, x| nonlinearity(o).terms.cross[2][1] = x, &[3.9e-4], &[-4.1e-4]),
        (Figures::NonlinearityStd, |o, x| nonlinearity(o).std.cubic[2] = x, &[3e-5], &[-1e-9, 4e-5]),
        (Figures::NonlinearityStd, |o, x| nonlinearity(o).std.cross[0][0] = x, &[4e-3], &[-1e-9, 6e-3]),
    ];
    for (figures, spoil, passing, refused) in spoiled {
        let of = |x: f32| {
            let mut triad = full();
            spoil(&mut triad.order, x);
            triad.check(Sensor::Accelerometer)
        };
        for x in passing {
            assert_eq!(of(*x), Ok(()), "{figures:?} {x}");
        }
        for x in refused {
            let defect = of(*x).unwrap_err();
            assert!(matches!(defect, Defect::OutOfRange { figures: at, .. } if at == figures), "{defect}");
            assert!(defect.to_string().contains(figures.name()), "{defect}");
        }
        for x in [f32::NAN, f32::INFINITY] {
            let at = of(x).unwrap_err();
            assert!(matches!(at, Defect::NotFinite { .. }), "{figures:?}: {at}");
        }
    }
}

#[test]
fn figures_of_temperature_terms_that_are_not_there_are_refused() {
    type Spoil = fn(&mut HigherOrder);
    let cases: [(Figures, Spoil); 2] = [
        (Figures::TemperatureSpan, |order| order.curvature = None),
        (Figures::BiasCurvature, |order| order.warmth = None),
    ];
    for (figures, spoil) in cases {
        let mut triad = full();
        spoil(&mut triad.order);
        assert_eq!(triad.check(Sensor::Accelerometer), Ok(()));
        triad.temperature = None;
        let defect = Defect::WithoutTerms { sensor: Sensor::Accelerometer, figures };
        assert_eq!(triad.check(Sensor::Accelerometer), Err(defect));
        assert!(defect.to_string().contains(figures.name()), "{defect}");
    }
}

#[test]
fn a_field_without_magnitude_is_refused_and_one_of_no_planet_too() {
    let of = |norm| {
        let mut triad = triad(RawUnit::MilliGauss, RawUnit::MilliGauss, 1.0);
        triad.quality.field_norm = Some(norm);
        triad.check(Sensor::Magnetometer)
    };
    assert_eq!(of(475.0), Ok(()));
    for norm in [0.0, -475.0, 1e6] {
        assert!(of(norm).is_err(), "{norm}");
    }
}

#[test]
fn a_refusal_says_what_was_found_and_what_was_expected() {
    let refused = triad(RawUnit::DegreePerSecond, RawUnit::RadianPerSecond, 1.0).check(Sensor::Gyroscope);
    let text = refused.unwrap_err().to_string();
    assert_eq!(text, "gyr: the gain is 1.000, expected 5.817e-3 to 5.235e-2");
    let refused = triad(RawUnit::Counts, RawUnit::RadianPerSecond, 1e-12).check(Sensor::Gyroscope);
    assert_eq!(refused.unwrap_err().to_string(), "gyr: the gain is 1.000e-12, expected 1.000e-9 to 1000.000");
}

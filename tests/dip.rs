//! A magnetometer brought into the accelerometer's axes: real pairs, their jackknife, and a known rotation.

use imucal_core::rotation::exp;
use imucal_host::{
    calibrate::{
        Follows, Options, Status, calibrate,
        fit::alignment::{Alignment, align},
    },
    recording::{Recording, SensorKind},
    simulator::{SimulatedUnit, Tumble, record},
};
use imucal_tests::{
    data,
    rig::{Draw, moments, rms},
    simulated,
};
use nalgebra::{Matrix3, Rotation3, Vector3};
use rayon::prelude::*;

/// Specific force and field at a rest, each in its sensor's calibrated axes.
type Pair = (Vector3<f64>, Vector3<f64>);

/// The pairs of a laser distance meter's shots, both sensors calibrated; the magnetometer is already turned into the
/// accelerometer's axes, which changes no angle's error.
fn pairs(file: &str) -> Option<(Alignment, Vec<Pair>)> {
    let mut recording = Recording::read(&data::real(file)?).expect("a good recording");
    // Its magnetometer's x and y are swapped against the accelerometer's: see the last test.
    let mag = recording.mag.as_mut().expect("recorded");
    mag.values.iter_mut().for_each(|value| value.swap_rows(0, 1));
    let calibration = calibrate(&recording, &Options::default(), &|_| {});
    let [(acc, _), (mag, alignment)] = [SensorKind::Acc, SensorKind::Mag].map(|kind| {
        let fit = calibration.sensor(kind).and_then(|outcome| outcome.accepted()).expect("accepted");
        let values = recording.sensor(kind).expect("recorded").values.iter();
        (values.map(|value| fit.triad.correct(value)).collect::<Vec<_>>(), fit.alignment.clone())
    });
    Some((alignment.expect("24 rests tell it"), acc.into_iter().zip(mag).collect()))
}

/// The alignment without one pair.
fn without(pairs: &[Pair], left_out: usize) -> Alignment {
    let others: Vec<Pair> =
        pairs.iter().enumerate().filter(|(k, _)| *k != left_out).map(|(_, pair)| *pair).collect();
    align(&others).expect("23 pairs tell it")
}

/// Angle of the field below the horizon at a pair, by an alignment.
fn dip(pair: &Pair, alignment: &Alignment) -> f64 {
    (alignment.axes.rotation * pair.1).angle(&pair.0) - std::f64::consts::FRAC_PI_2
}

/// The rotation vector from one rotation to another, in the axes both lead to.
fn between(from: &Matrix3<f64>, to: &Matrix3<f64>) -> Vector3<f64> {
    Rotation3::from_matrix_unchecked(to * from.transpose()).scaled_axis()
}

#[test]
fn the_dip_of_pairs_left_out_is_that_of_the_others() {
    // Found: 0.17° and 0.27°; the limits leave half as much again.
    for (file, limit) in [("disto-SAP6_HC.csv", 0.25f64), ("disto-SAP6_BB.csv", 0.4)] {
        let Some((alignment, pairs)) = pairs(file) else { return };
        assert_eq!((pairs.len(), alignment.rests.len()), (24, 24), "{file}");
        let errors: Vec<f64> = (0..pairs.len())
            .map(|k| {
                let others = without(&pairs, k);
                dip(&pairs[k], &others) - others.dip.0
            })
            .collect();
        let held_out = rms(&errors).to_degrees();
        let reported = alignment.held_out_rms.expect("reported").to_degrees();
        println!(
            "{file}: held out {held_out:.3}°, reported {reported:.3}°, dip {:.2}°",
            alignment.dip.0.to_degrees()
        );
        assert!(held_out < limit, "{file}: {held_out}°");
        // One Gauss–Newton step from all pairs is the fit without one, to the square of a step of a milliradian.
        assert!((held_out / reported - 1.0).abs() < 0.02, "{file}: {held_out} and {reported}");
    }
}

#[test]
fn standard_errors_are_those_of_a_jackknife_within_a_factor_of_two() {
    for file in ["disto-SAP6_HC.csv", "disto-SAP6_BB.csv"] {
        let Some((_, pairs)) = pairs(file) else { return };
        let all = align(&pairs).expect("24 pairs tell it");
        let count = pairs.len() as f64;
        let moves: Vec<[f64; 4]> = (0..pairs.len())
            .map(|k| {
                let one = without(&pairs, k);
                let turned = between(&all.axes.rotation, &one.axes.rotation);
                [turned.x, turned.y, turned.z, one.dip.0 - all.dip.0]
            })
            .collect();
        let std = [
            all.axes.covariance.m11.sqrt(),
            all.axes.covariance.m22.sqrt(),
            all.axes.covariance.m33.sqrt(),
            all.dip.1,
        ];
        for (k, std) in std.into_iter().enumerate() {
            let mean = moves.iter().map(|moved| moved[k]).sum::<f64>() / count;
            let square: f64 = moves.iter().map(|moved| (moved[k] - mean).powi(2)).sum();
            let jackknife = ((count - 1.0) / count * square).sqrt();
            let ratio = std / jackknife;
            println!("{file}, {k}: {:.4}°, jackknife {:.4}°", std.to_degrees(), jackknife.to_degrees());
            assert!((0.5..2.0).contains(&ratio), "{file}, {k}: {ratio}");
        }
    }
}

#[test]
fn a_known_mounting_is_recovered_from_noisy_directions() {
    let mut scores = Vec::new();
    for seed in 0..20 {
        let mut draw = Draw::new(seed);
        let mounted = draw.attitude().into_inner();
        let field = Vector3::new(25.1, 2.2, 40.3);
        let pairs: Vec<Pair> = (0..24)
            .map(|_| {
                let c_n_s = draw.attitude();
                // A thousandth of each length, as of good rests.
                let force = c_n_s * Vector3::new(0.0, 0.0, -9.8) + draw.normals() * 0.0098;
                (force, mounted.transpose() * (c_n_s * field) + draw.normals() * 0.047)
            })
            .collect();
        let found = align(&pairs).expect("24 attitudes tell it");
        let error = between(&mounted, &found.axes.rotation);
        for axis in 0..3 {
            let score = error[axis] / found.axes.covariance[(axis, axis)].sqrt();
            assert!(score.abs() < 3.0, "seed {seed}, axis {axis}: {score}");
            scores.push(score);
        }
        let dip = (found.dip.0 - (40.3f64 / 25.1f64.hypot(2.2)).atan()) / found.dip.1;
        assert!(dip.abs() < 3.0, "seed {seed}, dip: {dip}");
    }
    let (mean, std) = moments(&scores);
    println!("mounting: mean {mean:.3}, standard deviation {std:.3}");
    // 60 scores: three standard errors of their mean and of their spread.
    assert!(mean.abs() < 0.39, "{mean}");
    assert!((std - 1.0).abs() < 0.28, "{std}");
}

#[test]
fn a_magnetometer_mounted_upside_down_is_recovered() {
    let scores: Vec<f64> = (0..20u64).into_par_iter().flat_map_iter(mounted_upside_down).collect();
    let (mean, std) = moments(&scores);
    println!("through the calibration: mean {mean:.3}, standard deviation {std:.3} of {}", scores.len());
    // 180 scores of 20 recordings, nine gains of a recording from eight errors: three standard errors of the spread.
    assert_eq!(scores.len(), 180);
    assert!(mean.abs() < 0.23, "{mean}");
    assert!((std - 1.0).abs() < 0.2, "{std}");
    let largest = scores.iter().fold(0.0f64, |most, score| most.max(score.abs()));
    assert!(largest < 4.0, "of 180 normal scores one in 90 times has a larger one: {largest}");
}

/// Scores of the gain of a magnetometer that is mounted upside down on a board with an accelerometer.
fn mounted_upside_down(seed: u64) -> Vec<f64> {
    let mut draw = Draw::new(300 + seed);
    let mounted = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0)) * exp(&(draw.normals() * 0.05));
    let mut unit = SimulatedUnit { interval: 0.02, ..SimulatedUnit::mtx() };
    // Whose axes the accelerometer's errors turn as well: here it has hardly any.
    unit.acc.noise /= 20.0;
    unit.mag.truth.gain = mounted * unit.mag.truth.gain;
    let recording = record("mounted.csv", &Tumble::new(24, 400 + seed), &unit, 500 + seed);
    let options = Options { skip: vec![SensorKind::Gyr], multipliers: vec![4.0], ..Options::default() };
    let calibration = calibrate(&recording, &options, &|_| {});
    let outcome = calibration.sensor(SensorKind::Mag).expect("recorded");
    let fit = outcome.accepted().unwrap_or_else(|| panic!("seed {seed}: {:?}", outcome.verdict));
    let found = fit.alignment.as_ref().expect("24 rests tell it");
    let off = between(&mounted, &found.axes.rotation).norm();
    assert!(off < 2e-3, "seed {seed}: {off} rad: some ten times its error, but not upright");
    let (gain_std, _) = fit.raw_std();
    let error = fit.raw_triad().gain - unit.mag.truth.gain;
    error.component_div(&gain_std).iter().copied().collect()
}

#[test]
fn a_real_magnetometer_with_two_axes_swapped_is_refused_by_name() {
    for file in ["disto-SAP6_HC.csv", "disto-SAP6_BB.csv"] {
        let Some(path) = data::real(file) else { return };
        let mut recording = Recording::read(&path).expect("a good recording");
        // Without a site either explanation may be true; in the north, where the field points down, one is.
        for (latitude, because) in
            [(None, "add [site] latitude_deg"), (Some(52.0), "the other way than at [site]")]
        {
            recording.manifest.site.latitude_deg = latitude;
            let calibration = calibrate(&recording, &Options::default(), &|_| {});
            let mag = calibration.sensor(SensorKind::Mag).expect("recorded");
            let refused = mag.verdict.as_ref().expect_err("refused");
            assert!(
                refused.advice.contains("mag.axis_swap (mag_x and mag_y are swapped)"),
                "{file}: {refused:?}"
            );
            assert!(refused.advice.contains(because), "{file}: {refused:?}");
        }
    }
}

#[test]
fn a_magnetometer_is_suspect_where_the_declared_field_dips_otherwise() {
    let mut recording = simulated::tumbled(24, 4000);
    let found = |recording: &Recording| {
        let calibration = calibrate(recording, &Options::default(), &|_| {});
        let mag = calibration.sensor(SensorKind::Mag).expect("recorded");
        (mag.status(), mag.suspicions.iter().map(|found| found.follows).collect::<Vec<_>>())
    };
    assert_eq!(found(&recording), (Status::Accepted, Vec::new()));
    // Its own dips by 57.6°; this one, of Oslo, by 73°.
    recording.manifest.site.field_ned_ut = Some([15.0, 0.8, 49.0]);
    assert_eq!(found(&recording), (Status::Suspect, vec![Follows::Field]));
}

#[test]
fn a_magnetometer_that_turns_against_the_unit_half_way_is_suspect() {
    for seed in 0..5 {
        let mut recording = simulated::tumbled(24, 4100 + seed);
        let half = recording.rows() / 2;
        let slip = exp(&(Vector3::new(0.6, 0.64, 0.48) * 2f64.to_radians()));
        let mag = recording.mag.as_mut().expect("recorded");
        mag.values[half..].iter_mut().for_each(|value| *value = slip * *value);
        let calibration = calibrate(&recording, &Options::default(), &|_| {});
        let mag = calibration.sensor(SensorKind::Mag).expect("recorded");
        let follows: Vec<_> = mag.suspicions.iter().map(|found| found.follows).collect();
        assert!(mag.status() == Status::Suspect && follows.contains(&Follows::Time), "{seed}: {follows:?}");
    }
}
